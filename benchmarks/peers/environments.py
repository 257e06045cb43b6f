"""Environments of their own for other engines, in a cache folder outside of the project."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

NAMES: Final = ("python3.14", "python3.13", "python3.12", "python3.11", "python3", "python")
ASK_VERSION: Final = "import ensurepip, sys, venv; print(*sys.version_info[:2])"
ASK_S: Final = 30.0
INSTALL_S: Final = 900.0
DONE: Final = "installed"
OWN: Final = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")


class PeerUnavailableError(RuntimeError):
    """An engine can't be measured on this machine; the message says why in one line."""

    def __init__(self, engine: str, reason: str) -> None:
        self.engine = engine
        self.reason = reason
        super().__init__(f"{engine} left out: {reason}")


@dataclass(frozen=True, slots=True)
class Wanted:
    """An engine's packages, and from which Python version up to which one they have wheels, both included."""

    engine: str
    requirements: tuple[str, ...]
    least: tuple[int, int]
    most: tuple[int, int]


def default_cache() -> Path:
    """Where environments are kept (XDG base directory specification)."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(given) if os.path.isabs(given) else Path("~/.cache").expanduser()) / "joulepath/peers"


def interpreters() -> Iterator[tuple[Path, tuple[int, int]]]:
    """Interpreters that can make environments, with their versions: this one, those in PATH and those of pyenv."""
    root = Path(os.environ.get("PYENV_ROOT") or Path("~/.pyenv").expanduser())
    found = [sys.executable, *(shutil.which(name) for name in NAMES), *sorted(root.glob("versions/3.*/bin/python"))]
    for path in dict.fromkeys(Path(path) for path in found if path):
        version = _version(path)
        if version is not None:
            yield path, version


def _version(python: Path) -> tuple[int, int] | None:
    try:
        done = subprocess.run([python, "-c", ASK_VERSION], capture_output=True, text=True, timeout=ASK_S, check=True)
    except (OSError, subprocess.SubprocessError):
        return None  # a stand-in for a version that is not there, or one without venv
    major, minor = done.stdout.split()
    return int(major), int(minor)


def environment(wanted: Wanted, cache: Path, found: Iterable[tuple[Path, tuple[int, int]]] | None = None) -> Path:
    """The interpreter of an environment with the wanted packages, made where it is not there yet.

    found: interpreters to choose from, by default those of this machine. Raises PeerUnavailableError.
    """
    candidates = interpreters() if found is None else found
    fitting = next((candidate for candidate in candidates if wanted.least <= candidate[1] <= wanted.most), None)
    if fitting is None:
        least, most = (".".join(map(str, version)) for version in (wanted.least, wanted.most))
        raise PeerUnavailableError(wanted.engine, f"needs Python {least} to {most}, and no such interpreter was found")
    python, version = fitting
    name = wanted.requirements[0].replace("==", "-")
    folder = cache / f"{name}-python{version[0]}.{version[1]}"
    own = folder / "bin/python"
    if (folder / DONE).is_file():
        return own
    folder.parent.mkdir(parents=True, exist_ok=True)
    run_for(wanted.engine, [str(python), "-m", "venv", "--clear", str(folder)])
    pip = [str(own), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]
    run_for(wanted.engine, [*pip, *wanted.requirements])
    (folder / DONE).touch()
    return own


def clean_environment(**settings: str) -> dict[str, str]:
    """The variables of this process without those of its own Python environment, and with some more."""
    return {name: value for name, value in os.environ.items() if name not in OWN} | settings


def run_for(engine: str, command: list[str], cwd: Path | None = None) -> None:
    """Run a program that an engine needs; raises PeerUnavailableError with the last it said where it fails."""
    try:
        subprocess.run(
            command, capture_output=True, text=True, timeout=INSTALL_S, check=True, env=clean_environment(), cwd=cwd
        )
    except subprocess.CalledProcessError as error:
        raise PeerUnavailableError(engine, said_last(error.stderr or error.stdout)) from error
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PeerUnavailableError(engine, str(error)) from error


def said_last(output: str) -> str:
    """The last line of a program's output that names an error, or the last one at all."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line.lower()]
    return (errors or lines or ["it failed without a word"])[-1]
