"""Progress bars on the error output, where that is a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from collections.abc import Callable


def stage_bars() -> Progress:
    """Bars that are drawn while it is entered."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    console = Console(stderr=True)
    return Progress(*columns, console=console, disable=not console.is_terminal)


def whole_reporter(progress: Progress) -> Callable[[str, float], None]:
    """What is called with a stage and the share of the whole that is done; draws one bar, named by the stage."""
    bar = progress.add_task("", total=1.0)

    def report(stage: str, done: float) -> None:
        progress.update(bar, description=stage, completed=done)

    return report


def reporter(progress: Progress) -> Callable[[str, float], None]:
    """What is called with a stage and the share of it that is done; draws one bar a stage."""
    bars: dict[str, TaskID] = {}

    def report(stage: str, done: float) -> None:
        if stage not in bars:
            bars[stage] = progress.add_task(stage, total=1.0)
        progress.update(bars[stage], completed=done)

    return report
