"""The body of POST /diagnoses: a form with files, or JSON."""

from __future__ import annotations

import json
from contextlib import aclosing, suppress
from typing import TYPE_CHECKING, Any, BinaryIO, Final, cast

from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from app.diagnosing.arrivals import ArrivingFile
from app.errors.diagnosing import (
    MalformedFormError,
    SourceError,
    UnsupportedMediaTypeError,
    UploadsFullError,
)
from app.errors.raised import BodyTooLargeError
from app.http.json_body import read_json
from app.schemas.diagnosis import MAX_PATTERNS, DiagnosisOptions, DiagnosisRequest
from diagnosis.holdout import MOST_FRAC

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, AsyncIterator
    from pathlib import Path

    from fastapi import Request
    from starlette.datastructures import FormData, Headers

MULTIPART: Final = "multipart/form-data"
JSON: Final = "application/json"
FILES: Final = "recordings"
LISTS: Final = ("hide", "holdout")
NUMBERS: Final = ("holdout_fraction", "seed")
TEXT_BYTES: Final = 2**20  # of all fields and names of files together, which stay in memory

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


class _FormParser(MultiPartParser):
    """Writes files to the disk from their first byte on, numbered in a folder; all other texts share a limit."""

    def __init__(self, headers: Headers, arriving: AsyncGenerator[bytes, None], folder: Path, limit_files: int) -> None:
        super().__init__(headers, arriving, max_files=limit_files + 1, max_fields=2 * MAX_PATTERNS + 10)
        self._folder = folder
        self._limit_files = limit_files
        self._text_bytes = 0

    def on_headers_finished(self) -> None:
        """A part begins."""
        super().on_headers_finished()
        for unused in self._files_to_close_on_error:
            unused.close()
        self._files_to_close_on_error.clear()
        part = self._current_part
        if part.file is not None:
            if self._current_files > self._limit_files:
                raise SourceError(FILES, f"more than {self._limit_files} files", f"1..{self._limit_files} files")
            name = part.file.filename or ""
            self._count_text(len(name))
            file = ArrivingFile(self._folder / str(self._current_files))
            part.file = UploadFile(cast("BinaryIO", file), size=0, filename=name)
        part.item_headers = []

    def on_part_data(self, data: bytes, start: int, end: int) -> None:
        """Bytes of a part arrive."""
        if self._current_part.file is None:
            self._count_text(end - start)
        super().on_part_data(data, start, end)

    def _count_text(self, count: int) -> None:
        self._text_bytes += count
        if self._text_bytes > TEXT_BYTES:
            raise MultiPartException(f"fields and names of files have more than {TEXT_BYTES} bytes")


def _media_type(request: Request) -> str:
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def is_form(request: Request) -> bool:
    """Whether a body is a form."""
    return _media_type(request) == MULTIPART


async def received_request(request: Request) -> DiagnosisRequest:
    """What a body of JSON asks for; raises RequestValidationError and UnsupportedMediaTypeError."""
    media_type = _media_type(request)
    if media_type != JSON:
        raise UnsupportedMediaTypeError(media_type)
    body = await request.body()
    with suppress(ValueError, RecursionError):  # of malformed JSON, which pydantic says in its words
        await read_json(body)
    try:
        return DiagnosisRequest.model_validate_json(body)
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error


async def received_form(
    request: Request, folder: Path, limit_bytes: int, limit_files: int
) -> tuple[DiagnosisOptions, list[tuple[str, Path]]]:
    """Options of a form, and its files by their names as they were sent, which lie in a folder.

    limit_bytes: of the whole. Raises RequestValidationError, MalformedFormError, SourceError, and BodyTooLargeError or
    UploadsFullError while files arrive.
    """
    arriving = _counted(request.stream(), limit_bytes)
    try:
        async with aclosing(arriving):
            form = await _FormParser(request.headers, arriving, folder, limit_files).parse()
    except MultiPartException as error:
        raise MalformedFormError(error.message) from error
    except ValueError as error:  # of a charset that is none of text
        raise MalformedFormError(str(error)) from error
    except OSError as error:
        raise UploadsFullError(error) from error
    return _understood(form)


async def _counted(stream: AsyncIterator[bytes], limit_bytes: int) -> AsyncGenerator[bytes, None]:
    """A body as it arrives; raises BodyTooLargeError as soon as it passes the limit."""
    arrived = 0
    async for chunk in stream:
        arrived += len(chunk)
        if arrived > limit_bytes:
            raise BodyTooLargeError(limit_bytes)
        yield chunk


def _understood(form: FormData) -> tuple[DiagnosisOptions, list[tuple[str, Path]]]:
    """Options and files of a form."""
    files: list[tuple[str, Path]] = []
    values: dict[str, Any] = {}
    for name, value in form.multi_items():
        if name == FILES:
            if not isinstance(value, UploadFile):
                raise SourceError(f"{FILES}[{len(files)}]", "text without a filename", "a file, with its filename")
            files.append((value.filename or "", cast("ArrivingFile", value.file).path))
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
