"""Problems as answers of the HTTP application."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from app.errors.diagnosing import TooManyDiagnosesError
from app.errors.problems import PROBLEM_TYPE, problem_bytes
from app.errors.raised import OverloadedError, RefusedBodyError
from app.errors.table import TABLE, problem_of
from app.observation import note_problem
from energy.errors import Refusal
from routing.errors import AbandonedError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

RETRY_S: Final = 5
REQUEST_ID: Final = "X-Request-Id"
CLIENT_GONE: Final = 499  # for logs, as other servers have it


def problem_response(error: Exception, instance: str, headers: Mapping[str, str] | None = None) -> Response:
    """The HTTP answer for an error."""
    problem = problem_of(error, instance)
    note_problem(problem.code.value)
    sent = dict(headers or {})
    if isinstance(error, TooManyDiagnosesError):
        sent["Connection"] = "close"  # files that are still arriving are not waited for
    if problem.status in (429, 503):
        sent.setdefault("Retry-After", str(error.retry_s if isinstance(error, OverloadedError) else RETRY_S))
    return Response(problem_bytes(problem), problem.status, sent, media_type=PROBLEM_TYPE)


def install_error_handlers(app: FastAPI, allowed_methods: Callable[[str], set[str]]) -> None:
    """Answer every refusal, error of the table, of validation and of the framework as a problem.

    allowed_methods: of an address; the framework names those of the first matching route only.
    """

    def handle(request: Request, error: Exception) -> Response:
        headers = dict(error.headers or {}) if isinstance(error, HTTPException) else {}
        if isinstance(error, HTTPException) and error.status_code == 405:
            methods = allowed_methods(request.url.path)
            headers |= {"Allow": ", ".join(sorted(methods))} if methods else {}
        if (request_id := request.scope.get(REQUEST_ID)) is not None:
            headers[REQUEST_ID] = request_id  # a fault is answered outside of what else sends it
        refused = error.refusal if isinstance(error, RefusedBodyError) else error
        return problem_response(refused, request.url.path, headers)

    def handle_refusal(request: Request, error: Exception) -> Response:
        if isinstance(error, Refusal) and not error.code:
            raise error  # a fault of the service, to be logged as one
        return handle(request, error)

    def handle_abandoned(request: Request, error: Exception) -> Response:
        return Response(status_code=CLIENT_GONE)  # which nobody reads

    app.add_exception_handler(AbandonedError, handle_abandoned)
    app.add_exception_handler(ClientDisconnect, handle_abandoned)  # while its body was read
    app.add_exception_handler(Refusal, handle_refusal)
    for kind in (*TABLE, RequestValidationError, HTTPException, Exception):
        app.add_exception_handler(kind, handle)
