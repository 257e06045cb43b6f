"""What README.md, docs/python.md and the notebook show of the Python interface runs."""

from __future__ import annotations

import inspect
import io
import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import nbformat
import pytest

import joulepath
from energy.vehicle.files import load_vehicle
from tests.app.recorded import write_winter

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parents[2]
NOTEBOOK: Final = ROOT / "docs" / "notebooks" / "first_route.ipynb"
PAGE: Final = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
# in a process of its own, since Jupyter's libraries and this suite disagree about warnings
EXECUTE: Final = """
import sys
import nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=1200, kernel_name="python3").execute()
nbformat.write(notebook, sys.argv[2])
"""


def blocks(page: str) -> Iterator[tuple[str, str | None]]:
    """Each Python block of a page, with the text block that follows it right away, if one does."""
    for code, shown in re.findall(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```$)?", page, re.MULTILINE | re.DOTALL):
        yield code, shown or None


@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_python_of_a_page_prints_what_it_shows(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_winter(tmp_path / "drives", load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml"))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    found = list(blocks((ROOT / page).read_text(encoding="utf-8")))
    assert found
    assert any(shown is not None for _, shown in found)
    for code, shown in found:
        printed = io.StringIO()
        with redirect_stdout(printed):
            exec(compile(code, page, "exec"), names)
        if shown is not None:
            assert printed.getvalue() == shown


def test_page_names_everything_that_is_public() -> None:
    for name in joulepath.__all__:
        assert f"`{name}" in PAGE, name
        thing = getattr(joulepath, name)
        if inspect.isfunction(thing) and name != "show_compilation":
            for argument in inspect.signature(thing).parameters:
                assert f"`{argument}" in PAGE, f"{name}({argument})"
        if is_dataclass(thing) and thing.__module__.startswith("joulepath."):
            for field in fields(thing):
                assert f"`{field.name}`" in PAGE, f"{name}.{field.name}"


def test_notebook_runs_and_shows_routes_areas_and_plots(tmp_path: Path) -> None:
    executed = tmp_path / "executed.ipynb"
    apart = {"IPYTHONDIR": str(tmp_path), "JUPYTER_CONFIG_DIR": str(tmp_path), "JUPYTER_PREFER_ENV_PATH": "1"}
    ran = subprocess.run(
        [sys.executable, "-c", EXECUTE, str(NOTEBOOK), str(executed)],
        env=os.environ | apart,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    cells = [cell for cell in nbformat.read(executed, as_version=4).cells if cell.cell_type == "code"]
    outputs = [output for cell in cells for output in cell.outputs]
    printed = "".join(output.get("text", "") for output in outputs if output.output_type == "stream")
    assert "eco       137.0 km  110.1 min  15.09 kWh, charge 50% → 26.4%" in printed
    assert "feasible: False" in printed
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2


def test_notebook_is_stored_without_outputs() -> None:
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
