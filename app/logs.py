"""The log of the service: one line a message, as text or JSON, and one for each request."""

from __future__ import annotations

import json
import logging
import logging.config
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

from app.observation import observation

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.observation import Observation
    from app.settings import Settings

ACCESS: Final = "requests"
LINES_PER_S: Final = 500  # of requests; more are counted, not written


@dataclass(frozen=True, slots=True)
class RequestLine:
    """What is said of one request; key: the name of the one that it came with, never the key itself."""

    method: str
    endpoint: str
    status: int
    seconds: float
    observed: Observation
    client: str | None = None
    key: str | None = None

    def fields(self) -> dict[str, Any]:
        """As JSON takes it, without what is not known."""
        observed = self.observed
        known = {
            "request_id": observed.request_id,
            "method": self.method,
            "endpoint": self.endpoint,
            "status": self.status,
            "duration_ms": round(1000.0 * self.seconds, 1),
            **{f"{name}_ms": round(1000.0 * stage_s, 1) for name, stage_s in observed.stage_s.items()},
            "graph": observed.graph,
            "vehicle": observed.vehicle,
            "labels_settled": observed.labels_settled or None,
            "problem": observed.problem,
            "client": self.client,
            "key": self.key,
        }
        return {name: value for name, value in known.items() if value is not None}

    def __str__(self) -> str:
        """As text."""
        fields = self.fields()
        first = [str(fields.pop(name)) for name in ("method", "endpoint", "status")]
        return " ".join([*first, *(f"{name}={value}" for name, value in fields.items())])


class JsonFormatter(logging.Formatter):
    """A JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
        }
        request = record.args[0] if isinstance(record.args, tuple) and len(record.args) == 1 else None
        if isinstance(request, RequestLine):
            line |= request.fields()
        else:
            line["message"] = record.getMessage()
            if (observed := observation()) is not None:
                line["request_id"] = observed.request_id
        if dropped := getattr(record, "dropped", 0):
            line["dropped"] = dropped
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


class TextFormatter(logging.Formatter):
    """Level and message."""

    def format(self, record: logging.LogRecord) -> str:
        """One message; an exception takes more lines."""
        dropped = getattr(record, "dropped", 0)
        text = f"{record.levelname + ':':<9} {super().format(record)}"
        return f"{text} dropped={dropped}" if dropped else text


class AtMost(logging.Filter):
    """Lets so many records a second through; the next one then says how many were dropped. clock: in seconds."""

    def __init__(self, per_s: float = LINES_PER_S, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._per_s = per_s
        self._clock = clock
        self._second = 0
        self._count = 0
        self._dropped = 0

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is written."""
        second = int(self._clock())
        if second != self._second:
            self._second, self._count = second, 0
        self._count += 1
        if self._count > self._per_s:
            self._dropped += 1
            return False
        record.dropped, self._dropped = self._dropped, 0
        return True


def configure_logs(settings: Settings) -> None:
    """Write the log of this process to its standard error, as the settings say; other libraries' from warnings on."""
    level = settings.log_level.upper()
    formatter = JsonFormatter if settings.log_format == "json" else TextFormatter
    logging.config.dictConfig(
        {
            "version": 1,
            "disable_existing_loggers": False,
            "formatters": {"line": {"()": formatter}},
            "filters": {"at_most": {"()": AtMost, "per_s": settings.log_limit_per_s}},
            "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": "line"}},
            "root": {"handlers": ["stderr"], "level": "ERROR" if level == "ERROR" else "WARNING"},
            "loggers": {
                **{name: {"level": level} for name in ("app", "uvicorn")},
                ACCESS: {"level": level, "filters": ["at_most"]},
            },
        }
    )
