"""Templates of the report filled in: whatever is not markup already is escaped where it enters one."""

from __future__ import annotations

import re
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from diagnosis.report.tables import number_as_chosen
from diagnosis.report.text import spoken

_NO_TEXT: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


def rendered(template: str, **facts: object) -> Markup:
    """A template of the folder beside this module with its facts; a fact that it asks for must be there."""
    return Markup(_ENVIRONMENT.get_template(template).render(facts))


def plain_text(value: Any) -> Any:
    """Markup as it is; a text with � for characters that are not text, or that turn its direction."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return _NO_TEXT.sub("\ufffd", value).encode("utf-8", "replace").decode("utf-8")


def pixels(value: float) -> str:
    """A coordinate: a tenth of a pixel keeps pictures small."""
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("diagnosis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=plain_text,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    environment.filters |= {"px": pixels, "spoken": spoken, "as_chosen": number_as_chosen}
    return environment


_ENVIRONMENT: Final = _environment()
