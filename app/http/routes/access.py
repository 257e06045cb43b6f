"""What every endpoint shares: the running service, and answers in the media type asked for."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Depends, Request, Response
from fastapi.responses import JSONResponse
from isal import igzip

from app.errors.raised import NotReadyError
from app.http.admission import Admission
from app.observation import Stage, stage
from app.schemas.lean.formats import MEDIA_TYPES, AnswerFormat
from app.service.service import Service

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel

# what endpoints depend on is async, since plain functions would each be run on a thread of their own

GEOJSON: Final = "application/geo+json"
JSON: Final = "application/json"
COMPRESSED_BYTES: Final = 1000  # least of what is compressed
TAG_BYTES: Final = 12
UNCHANGED: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "The caller has this answer, by its If-None-Match"}
}
_MEASURED: Final = re.compile(rb'"seconds":[0-9.e+-]+')  # how long a search took, which no two answers share
COMPRESSION: Final = 1  # a fifth of the time of the best, 7 % larger


async def running_service(request: Request) -> Service:
    """The service of this process; raises NotReadyError until its graphs are loaded."""
    service = getattr(request.app.state, "service", None)
    if not isinstance(service, Service):
        raise NotReadyError
    return service


async def search_admission(request: Request) -> Admission:
    """What lets searches to their threads; raises NotReadyError as running_service does."""
    admission = getattr(request.app.state, "admission", None)
    if not isinstance(admission, Admission):
        raise NotReadyError
    return admission


RunningService = Annotated[Service, Depends(running_service)]
Searches = Annotated[Admission, Depends(search_admission)]


class GeoJSONResponse(JSONResponse):
    """An answer as GeoJSON."""

    media_type = GEOJSON


def answer(model: BaseModel, media_type: str = JSON) -> Response:
    """A schema as a response, serialised once."""
    return Response(model.model_dump_json(), media_type=media_type)


def answer_in(request: Request, form: AnswerFormat, body: bytes, name: str) -> Response:
    """A body in a format; a browser saves all but JSON and GeoJSON as a file of that name."""
    headers = {"Vary": "Accept"}
    if form not in (AnswerFormat.JSON, AnswerFormat.GEOJSON):
        headers["Content-Disposition"] = f'attachment; filename="{name}.{form.value}"'
    return long_answer(request, body, MEDIA_TYPES[form], headers)


def kept_answer(request: Request, model: BaseModel) -> Response:
    """A schema as a response to GET that clients may keep and ask again for, as `long_answer` sends it."""
    return long_answer(request, model.model_dump_json().encode())


def long_answer(
    request: Request, body: bytes, media_type: str = JSON, headers: Mapping[str, str] | None = None
) -> Response:
    """A body as a response, compressed here where the client takes that, so that it is not on the event loop.

    Answers to GET have a weak tag of their contents, and are not sent again to who has them: 304.
    """
    response = _packed(request, body, media_type, headers)
    if request.method == "GET":
        same = _MEASURED.sub(b"", body)
        tag = f'"{hashlib.blake2b(same, digest_size=TAG_BYTES).hexdigest()}"'
        kept = {"ETag": f"W/{tag}", "Cache-Control": "no-cache", "Vary": "Accept, Accept-Encoding, Accept-Language"}
        if has_tag(request.headers.get("If-None-Match"), tag):
            return Response(status_code=304, headers=kept)
        response.headers.update(kept)
    return response


def root_address(request: Request, service: Service) -> str:
    """The address of the service as clients reach it, without a slash at the end."""
    own = f"{request.url.scheme}://{request.url.netloc}{request.scope.get('root_path', '')}"
    return service.settings.public_url or own.rstrip("/")


def _packed(request: Request, body: bytes, media_type: str, headers: Mapping[str, str] | None) -> Response:
    # the test of the compressing middleware, which leaves alone what is compressed
    if len(body) < COMPRESSED_BYTES or "gzip" not in request.headers.get("Accept-Encoding", ""):
        return Response(body, media_type=media_type, headers=headers)
    with stage(Stage.WRITE):
        packed = igzip.compress(body, COMPRESSION, mtime=0)
    packing = {"Vary": "Accept-Encoding", "Content-Encoding": "gzip"}
    if headers is not None:
        packing = {**headers, **packing, "Vary": f"{headers.get('Vary', '')}, Accept-Encoding".removeprefix(", ")}
    return Response(packed, media_type=media_type, headers=packing)


def has_tag(if_none_match: str | None, tag: str) -> bool:
    """Whether an If-None-Match header names a tag (RFC 9110 section 13.1.2, weak comparison)."""
    known = [part.strip().removeprefix("W/") for part in (if_none_match or "").split(",")]
    return tag in known or known == ["*"]
