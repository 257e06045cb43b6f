"""What pydantic says of a request, in the words of problems."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

from app.errors.problems import MAX_FIELDS, MAX_VALUE_CHARS, field_problem, make_problem, shortened
from app.schemas.learned_effects import EFFECTS_BRANCH, EFFECTS_ID_BRANCH
from app.schemas.problem import ErrorCode, FieldProblem, Problem
from app.schemas.vehicles.services import SERVICE_BRANCHES
from app.schemas.vehicles.vehicle import ID_BRANCH, PHYSICAL_BRANCH, TABLE_BRANCH
from routing.places import degrees_text
from routing.spelling import question, similar_choice

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


LEAST_SHARE: Final = 0.9  # of what an upper bound is that of a share; assumed
LEAST_PERCENT: Final = 2.0  # that a share above 1 is taken for; assumed
MOST_ROUNDS_DEG: Final = 3600.0  # up to which a longitude may be counted on by a map that goes on; assumed
QUOTED: Final = re.compile("'([^']*)'")  # a value in pydantic's list of those that are allowed
FACTOR: Final = "_factor"  # end of the names of fields up to 1 that are no shares
# parts of a location that name a branch of a union, not a field
BRANCHES: Final = frozenset(
    {
        *("named", "pair", "text", "metric", "epa", "count", "values", "[key]"),
        *(ID_BRANCH, PHYSICAL_BRANCH, TABLE_BRANCH, EFFECTS_ID_BRANCH, EFFECTS_BRANCH),
        *SERVICE_BRANCHES.values(),
    }
)


def validation_detail(error: ValidationError) -> str:
    """What is wrong with something that pydantic refused, in one line."""
    return validation_problem(error.errors(), "").detail.removeprefix("the body is ")


def validation_problem(errors: Sequence[Any], instance: str) -> Problem:
    """What is answered for the errors that pydantic reports of one request."""
    if any(error["type"] == "json_invalid" for error in errors):
        reason = str(errors[0].get("ctx", {}).get("error", errors[0]["msg"]))
        field = field_problem("", None, f"valid JSON: {reason}")
        return make_problem(ErrorCode.MALFORMED_JSON, f"the body is not valid JSON: {reason}", [field], instance)
    fields = [_validation_field(error) for error in errors[:MAX_FIELDS]]
    first = fields[0]
    name, value = first.field or "the request", first.value
    if errors[0]["type"] == "missing":
        detail = f"{name} is missing, it is required"
    else:
        detail = f"{name} is {json.dumps(value, ensure_ascii=False)}, allowed: {first.allowed}"
    if len(errors) > 1:
        detail += f" (and {len(errors) - 1} more)"
    return make_problem(ErrorCode.INVALID_REQUEST, detail, fields, instance)


def _validation_field(error: Any) -> FieldProblem:
    """The field, value and allowed range of one error that pydantic reports."""
    context = error.get("ctx") or {}
    path = _path(error["loc"])
    kind, value = error["type"], error.get("input")
    if kind == "refused":
        name = ".".join(part for part in (path, context["field"]) if part).replace(".[", "[")
        return field_problem(name, context["value"], context["allowed"])
    if kind == "missing":
        return field_problem(path, None, "required")
    if kind == "extra_forbidden":
        return field_problem(path, value, "no field of this name")
    if isinstance(value, bytes):
        return field_problem(
            path, value.decode("utf-8", "replace"), "a JSON object, sent with Content-Type: application/json"
        )
    if kind in ("enum", "literal_error"):
        meant = _choice(context, value)
    else:
        meant = "" if path.endswith(FACTOR) else _question(context, value)
    return field_problem(path, value, _allowed(kind, context, str(error["msg"])) + meant)


def _choice(context: Mapping[str, object], value: object) -> str:
    """What is asked of a text that is like one of the values that are allowed."""
    if not isinstance(value, str):
        return ""
    return question(similar_choice(value, QUOTED.findall(str(context.get("expected", "")))))


def _question(context: Mapping[str, object], value: object) -> str:
    """What is asked of a share up to 1 that seems to be in percent, and of a longitude counted on round the world.

    A text, as in an address, holds a number.
    """
    bound = context.get("le", context.get("ge"))
    try:
        number = float(value) if isinstance(value, (int, float, str)) else math.nan
    except (OverflowError, ValueError):
        return ""
    most = context.get("le")
    if isinstance(most, (int, float)) and LEAST_SHARE <= most <= 1 and LEAST_PERCENT <= number <= 100.0 * most:
        return f"; did you mean {number / 100.0:g}?"
    if bound in (-180, 180) and abs(number) <= MOST_ROUNDS_DEG:  # those of longitudes only
        return f"; did you mean {degrees_text(math.remainder(number, 360.0))}?"
    return ""


def _allowed(kind: str, context: Mapping[str, object], message: str) -> str:
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return "an object"
    if kind in ("too_short", "too_long"):
        few = kind == "too_short"
        count = context["min_length" if few else "max_length"]
        return f"at {'least' if few else 'most'} {count} item{'' if count == 1 else 's'}"
    if kind == "timezone_naive":
        return "a local time without a time zone, such as 2026-11-30T08:15"
    if kind in ("datetime_parsing", "datetime_from_date_parsing", "datetime_type"):
        return "a local time, such as 2026-11-30T08:15"
    if kind == "string_pattern_mismatch":
        return f"text that matches {context['pattern']}"
    for start in ("Input should be ", "String should have ", "Value error, "):
        message = message.removeprefix(start)
    message = message.partition(", unable to parse ")[0]
    message = message.replace("greater than or equal to", "at least").replace("less than or equal to", "at most")
    return message.replace("greater than", "above").replace("less than", "below")


def _path(location: Sequence[str | int]) -> str:
    path = ""
    for depth, part in enumerate(location):
        if isinstance(part, int):
            path += f"[{part}]"
        elif not (depth == 0 and part in ("body", "query", "path")) and part not in BRANCHES:
            path += f".{part}" if path else part
    return shortened(path, MAX_VALUE_CHARS)
