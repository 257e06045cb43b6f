"""The table on docs/configuration.md, written from the settings class: `python -m docs.settings_table`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic_core import PydanticUndefined

from app.settings import BUNDLED_DATA, Settings

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

PAGE: Final = Path(__file__).resolve().parent / "configuration.md"
HEADER: Final = ("variable", "values", "default", "meaning")
PLACE: Final = re.compile(r"(<!-- settings -->\n).*?(<!-- /settings -->)", re.DOTALL)
# defaults that differ between machines, or that nothing stands for
IN_WORDS: Final = {
    "graph_dirs": "`joulepath/graphs` in the user's data folder, then the bundled `data/graphs`",
    "database_url": "`joulepath/vehicles.sqlite` in the user's data folder",
    "search_threads": "number of processors",
    "label_limit": "20 for each link, at least 1000000",
}
BOUNDS: Final = ((Ge, "ge", "≥"), (Gt, "gt", ">"), (Le, "le", "≤"), (Lt, "lt", "<"))
NAMES: Final = {bool: "`true`, `false`", int: "whole number", float: "number", str: "text", Path: "path"}


def settings_table() -> str:
    """All settings as Markdown, in the order of the class."""
    rows = []
    for name, field in Settings.model_fields.items():
        if not field.description:
            raise ValueError(f"the setting {name} has no description")
        rows.append((f"`JOULEPATH_{name.upper()}`", values_of(field), default_of(name, field), field.description))
    lines = [HEADER, ("---",) * len(HEADER), *(tuple(cell.replace("|", "\\|") for cell in row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def values_of(field: FieldInfo) -> str:
    """What a setting may be, with its bounds."""
    bounds = [
        f"{sign} {_number(getattr(constraint, bound))}"
        for kind, bound, sign in BOUNDS
        for constraint in field.metadata
        if isinstance(constraint, kind)
    ]
    return ", ".join([_kind(field.annotation), *bounds])


def _kind(annotation: Any) -> str:
    if get_origin(annotation) is Literal:
        return ", ".join(f"`{value}`" for value in get_args(annotation))
    named = [part for part in get_args(annotation) if part not in (type(None), Ellipsis)]
    if get_origin(annotation) is tuple:
        return "paths" if Path in named else "list"
    return NAMES[named[0] if named else annotation]


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) else str(value)


def default_of(name: str, field: FieldInfo) -> str:
    """What holds where a setting is not made."""
    if name in IN_WORDS:
        return IN_WORDS[name]
    value = field.default
    if value is PydanticUndefined:
        raise ValueError(f"say in IN_WORDS what the default of {name} is, which is made at the start")
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, Path):
        return f"the bundled `data/{value.relative_to(BUNDLED_DATA).as_posix()}`"
    return f"`{_number(value) if isinstance(value, float) else value}`"


def with_table(page: str) -> str:
    """The page with its table renewed."""
    text, count = PLACE.subn(lambda match: f"{match[1]}{settings_table()}\n{match[2]}", page)
    if count != 1:
        raise ValueError(f"{PAGE.name} has {count} places for the settings, needs one")
    return text


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
