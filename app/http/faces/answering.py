"""What all faces share: endpoints that answer every error in their engine's own form."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError
from starlette.requests import ClientDisconnect

from app.errors.handlers import RETRY_S
from app.errors.raised import OverloadedError, RefusedBodyError
from app.errors.table import problem_of
from app.http.json_body import BoundedRequest
from app.http.routes.access import JSON
from app.observation import note_problem
from app.schemas.as_json import as_json
from app.schemas.problem import ErrorCode
from energy.errors import Refusal
from routing.errors import AbandonedError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from typing import TypeVar

    from app.schemas.problem import Problem

    Model = TypeVar("Model", bound=BaseModel)
    Form = Callable[[Problem, "FaceError | None", str], "FaceProblem"]

ASK_LATER: Final = frozenset({429, 503})
NUMBER: Final = re.compile(r"[+-]?(?:\d{1,9}(?:\.\d{0,20})?|\.\d{1,20})(?:[eE][+-]?\d{1,2})?\Z", re.ASCII)


class FaceError(Refusal):
    """A request that an engine would refuse, or that its face can't answer.

    kind: the engine's own name or number of what is wrong. status: of HTTP, where it is not the engine's usual one.
    """

    code = "invalid_request"

    def __init__(self, kind: str | int, field: str, value: object, allowed: str, *, message: str = "") -> None:
        self.kind = kind
        super().__init__(field, value, allowed, message=message)


class OwnFieldError(Refusal):
    """A field of our own in a request of another engine that is not there, or not so."""

    code = "invalid_request"


@dataclass(frozen=True, slots=True)
class FaceProblem:
    """An error as an engine writes it: status of HTTP, and the fields of the body."""

    status: int
    body: dict[str, object]


def face_route(form: Form) -> type[APIRoute]:
    """A class of endpoints that answer errors in a form; faults of the service are left to it."""

    class FaceRoute(APIRoute):
        def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
            handler = super().get_route_handler()

            async def answered(request: Request) -> Response:
                try:
                    return await handler(BoundedRequest(request.scope, request.receive))
                except (AbandonedError, ClientDisconnect):
                    raise
                except Exception as error:
                    return refused(error, request, form)

            return answered

    return FaceRoute


def refused(error: Exception, request: Request, form: Form) -> Response:
    """An error in an engine's form; raises it where it is a fault of the service."""
    raised = error.refusal if isinstance(error, RefusedBodyError) else error
    problem = problem_of(raised, request.url.path)
    if problem.code is ErrorCode.INTERNAL:
        raise error
    note_problem(problem.code.value)
    answer = form(problem, raised if isinstance(raised, FaceError) else None, request.scope["path"])
    headers = {}
    if answer.status in ASK_LATER:
        headers["Retry-After"] = str(raised.retry_s if isinstance(raised, OverloadedError) else RETRY_S)
    return Response(as_json(answer.body), answer.status, headers, media_type=JSON)


def read(model: type[Model], sent: object) -> Model:
    """What was sent as a model; raises RequestValidationError, which is answered as a refusal."""
    try:
        return model.model_validate(sent)
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error


def number_from(text: str) -> float | None:
    """A number as an address has it, None for any other text."""
    return float(text) if NUMBER.match(text) else None


def whole_from(text: str) -> int | None:
    """A whole number in figures, None for any other text."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) <= 9 else None
