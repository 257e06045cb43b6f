"""Where compiled kernels are cached: a folder keyed by the kernels' own text, so that an edit is never missed.

numba's disk cache looks only at the file of the function it caches; a kernel that calls a jitted function
of another file would keep the old one. Importing this module before a kernel is compiled sets the folder.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numba
from numba.core import event

from energy.compiled.progress import compilations

if TYPE_CHECKING:
    from collections.abc import Callable

LOG: Final = logging.getLogger(__name__)
PACKAGES: Final = ("diagnosis", "energy", "routing")
ROOT: Final = Path(__file__).resolve().parents[2]
LOCATORS: Final = ("UserProvidedCacheLocator", "InTreeCacheLocator", "UserWideCacheLocator", "IPythonCacheLocator")


def _kernel_files() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("kernels*.py"))


def _digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in _kernel_files():
        digest.update(path.relative_to(ROOT).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _home() -> Path:
    given = os.environ.get("XDG_CACHE_HOME", "")
    return Path(given if os.path.isabs(given) else os.path.expanduser("~/.cache")) / "joulepath" / "kernels"


class KernelLocator:
    """Where numba keeps a kernel: by its module, wherever the packages lie.

    numba's own locators have the path of the source file in that of the cache, so that each environment would compile
    everything anew. The folder is keyed by the text of all kernels, and compiled code depends on nothing else.
    """

    def __init__(self, file: Path, line: int) -> None:
        self._py_file = str(file)  # numba reads both where it warns
        self._lineno = line
        self._room = ".".join(file.relative_to(ROOT).parent.parts)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> KernelLocator | None:
        """The locator of a kernel; None for any other function, which numba's own locators then serve."""
        path = Path(file)
        if not path.name.startswith("kernels") or not any(path.is_relative_to(ROOT / name) for name in PACKAGES):
            return None
        found = cls(path, function.__code__.co_firstlineno)
        try:
            found.ensure_cache_path()
        except OSError:
            return None
        return found

    def ensure_cache_path(self) -> None:
        """Make the folder; raises OSError."""
        os.makedirs(self.get_cache_path(), exist_ok=True)

    def get_cache_path(self) -> str:
        """The folder of the kernel's room."""
        return os.path.join(str(getattr(numba.config, "CACHE_DIR")), self._room)  # noqa: B009  (as below)

    def get_source_stamp(self) -> str:
        """What makes a cached kernel stale; here the folder's name does."""
        return "by folder"

    def get_disambiguator(self) -> str:
        """What tells kernels of the same name in one file apart."""
        return str(self._lineno)


class _Listener(event.Listener):
    """Tells of kernels that numba compiles, since they are not in the cache."""

    def on_start(self, event: Any) -> None:
        """A function is being compiled."""
        if (name := _kernel_name(event)) is not None:
            compilations.begin(name)

    def on_end(self, event: Any) -> None:
        """A function is compiled."""
        if _kernel_name(event) is not None:
            compilations.end()


def _kernel_name(compiled: Any) -> str | None:
    function = compiled.data["dispatcher"].py_func
    package, _, module = str(function.__module__).partition(".")
    return f"{module.rpartition('.')[2]}.{function.__qualname__}" if package in PACKAGES else None


def _is_writable(folder: Path) -> bool:
    if not folder.is_absolute():  # as where the user has no home
        return False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _cache_folder() -> Path:
    """The folder of these kernels; one for this process and its children where that can't be written."""
    folder = _home() / _digest()
    if _is_writable(folder):
        return folder
    own = Path(tempfile.mkdtemp(prefix="joulepath-kernels-"))  # nobody else may put code there
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(own)
    LOG.warning(
        "compiled kernels can't be kept in %s, which can't be written: they are compiled at each start; "
        "XDG_CACHE_HOME names another folder",
        folder,
    )
    return own


if not os.environ.get("NUMBA_CACHE_DIR"):
    setattr(numba.config, "CACHE_DIR", str(_cache_folder()))  # noqa: B010  (numba's stubs don't know it)
    setattr(  # noqa: B010  (an older numba looks at CACHE_DIR only, and compiles anew for each place)
        numba.config, "CACHE_LOCATOR_CLASSES", ",".join((f"{KernelLocator.__module__}.KernelLocator", *LOCATORS))
    )
event.register("numba:compile", _Listener())  # type: ignore[no-untyped-call]
