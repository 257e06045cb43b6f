"""The body of POST /diagnoses: a form with files, or JSON."""

from __future__ import annotations

import json
from contextlib import aclosing, suppress
from typing import TYPE_CHECKING, Any, Final

from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from app.errors.diagnosing import (
    MalformedFormError,
    SourceError,
    UnsupportedMediaTypeError,
    UploadsFullError,
)
from app.errors.raised import BodyTooLargeError
from app.http.json_body import read_json
from app.schemas.diagnosis import MAX_PATTERNS, MAX_RECORDINGS, DiagnosisOptions, DiagnosisRequest
from diagnosis.holdout import MOST_FRAC

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, AsyncIterator

    from fastapi import Request
    from starlette.datastructures import FormData

MULTIPART: Final = "multipart/form-data"
JSON: Final = "application/json"
FILES: Final = "recordings"
LISTS: Final = ("hide", "holdout")
NUMBERS: Final = ("holdout_fraction", "seed")

FORM_SCHEMA: Final[dict[str, Any]] = {
    "title": "DiagnosisForm",
    "type": "object",
    "required": [FILES],
    "additionalProperties": False,
    "properties": {
        FILES: {
            "type": "array",
            "minItems": 1,
            "items": {"type": "string", "format": "binary"},
            "description": "recordings, one part each, each with its filename",
        },
        "vehicle": {
            "type": "string",
            "minLength": 1,
            "description": "id of the vehicle that was driven, or a JSON object that describes it by its physics",
        },
        "hide": {
            "type": "array",
            "maxItems": MAX_PATTERNS,
            "items": {"type": "string", "minLength": 1, "maxLength": 200},
            "description": "columns that are dropped while reading, one part each",
        },
        "holdout": {
            "type": "array",
            "maxItems": MAX_PATTERNS,
            "items": {"type": "string", "minLength": 1, "maxLength": 200},
            "description": "trips kept out of the fit, by id or pattern, one part each",
        },
        "holdout_fraction": {"type": "number", "minimum": 0, "maximum": MOST_FRAC},
        "seed": {"type": "integer", "minimum": 0, "maximum": 2**31 - 1},
        "graph": {
            "type": "string",
            "maxLength": 200,
            "description": "name of a graph to which recordings with positions are matched, and from which those"
            " without height get it",
        },
    },
}
FORM_EXAMPLE: Final[dict[str, Any]] = {
    FILES: ["time_s,speed_kmh,power_w\n0,0,400\n1,3.6,2500\n"],
    "vehicle": "bmw-i3-60ah",
    "holdout_fraction": 0.3,
}


async def received_body(request: Request, limit_bytes: int) -> tuple[DiagnosisOptions, list[UploadFile]]:
    """What a body asks for: a DiagnosisRequest for JSON, options with files, to be closed, for a form.

    limit_bytes: of a form. Raises RequestValidationError, MalformedFormError, SourceError, UnsupportedMediaTypeError,
    and BodyTooLargeError or UploadsFullError while files arrive.
    """
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type == MULTIPART:
        return await _form(request, limit_bytes)
    if media_type != JSON:
        raise UnsupportedMediaTypeError(media_type)
    body = await request.body()
    with suppress(ValueError, RecursionError):  # of malformed JSON, which pydantic says in its words
        await read_json(body)
    try:
        return DiagnosisRequest.model_validate_json(body), []
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error


async def _form(request: Request, limit_bytes: int) -> tuple[DiagnosisOptions, list[UploadFile]]:
    arriving = _counted(request.stream(), limit_bytes)
    try:
        async with aclosing(arriving):
            parser = MultiPartParser(
                request.headers, arriving, max_files=MAX_RECORDINGS, max_fields=2 * MAX_PATTERNS + 10
            )
            form = await parser.parse()  # longer files are kept on the disk while they arrive
    except MultiPartException as error:
        raise MalformedFormError(error.message) from error
    except ValueError as error:  # of a charset that is none of text
        raise MalformedFormError(str(error)) from error
    except OSError as error:
        raise UploadsFullError(error) from error
    try:
        return _understood(form)
    except BaseException:
        with suppress(OSError):  # what could not be written is not missed
            await form.close()
        raise


async def _counted(stream: AsyncIterator[bytes], limit_bytes: int) -> AsyncGenerator[bytes, None]:
    """A body as it arrives; raises BodyTooLargeError as soon as it passes the limit."""
    arrived = 0
    async for chunk in stream:
        arrived += len(chunk)
        if arrived > limit_bytes:
            raise BodyTooLargeError(limit_bytes)
        yield chunk


def _understood(form: FormData) -> tuple[DiagnosisOptions, list[UploadFile]]:
    """Options and files of a form."""
    files: list[UploadFile] = []
    values: dict[str, Any] = {}
    for name, value in form.multi_items():
        if name == FILES:
            if not isinstance(value, UploadFile):
                raise SourceError(f"{FILES}[{len(files)}]", "text without a filename", "a file, with its filename")
            files.append(value)
        elif isinstance(value, UploadFile):
            raise SourceError(name, "a file", "text; files are sent as recordings")
        elif name in LISTS:
            values.setdefault(name, []).append(value)
        elif name in values:
            raise SourceError(name, "sent twice", "once")
        else:
            values[name] = _value(name, value)
    if not files:
        raise SourceError(FILES, "missing", "at least one file")
    try:
        return DiagnosisOptions.model_validate(values), files
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error


def _value(name: str, text: str) -> object:
    """A field's value: numbers and a vehicle's object as in JSON; what is none is left to be refused as text."""
    if name in NUMBERS or (name == "vehicle" and text.lstrip().startswith("{")):
        try:
            return json.loads(text)
        except (ValueError, RecursionError):
            if name == "vehicle":
                raise SourceError(name, text, "the id of a vehicle, or a JSON object that describes one") from None
    return text
