"""Where bundled files and the user's own lie."""

from __future__ import annotations

from pathlib import Path

import pytest

from energy import folders

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.nojit
def test_bundled_folder_of_a_checkout_lies_beside_the_packages() -> None:
    assert folders.bundled_folder("data", "cycles") == ROOT / "data" / "cycles"
    assert folders.bundled_folder("web") == ROOT / "web"


@pytest.mark.nojit
def test_bundled_folder_of_an_installed_wheel_lies_in_the_public_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folders, "ROOT", tmp_path)
    for place in ("joulepath/data/graphs", "data/graphs"):  # another package may have brought a folder `data`
        (tmp_path / place).mkdir(parents=True)
    assert folders.bundled_folder("data", "graphs") == tmp_path / "joulepath" / "data" / "graphs"


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("/data/home", "/data/home/joulepath"),
        ("", "/home/someone/.local/share/joulepath"),
        ("relative/path", "/home/someone/.local/share/joulepath"),  # which the specification says to ignore
    ],
)
def test_users_folder_is_that_of_the_xdg_specification(
    monkeypatch: pytest.MonkeyPatch, given: str, expected: str
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("HOME", "/home/someone")
    monkeypatch.setenv("XDG_DATA_HOME", given)
    assert folders.user_folder() == Path(expected)
    assert folders.user_graphs_folder() == Path(expected) / "graphs"
