"""A reader who follows a tutorial: saves its files, types its commands, runs its Python, opens its page.

A block of another language than sh, python and text is a file, saved under the name that the line before it ends with
("Save it as `NAME`:"). A block of text is what the block before it printed or, where an address stands right before it,
what the page there says. `…` stands for what varies: within a line, or for any lines where it has a line of its own.
"""

from __future__ import annotations

import io
import re
import shlex
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

from playwright.sync_api import expect

from app.cli.main import cli
from benchmarks.browser import served

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser

ROOT: Final = Path(__file__).resolve().parents[2]
TUTORIALS: Final = ROOT / "docs" / "tutorials"
SERVICE: Final = "http://127.0.0.1:8000"
BLOCK: Final = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SAVED: Final = re.compile(r"`([\w.-]+)`:$")
OPENED: Final = re.compile(r"\((http://127\.0\.0\.1:\d+[^)]*)\)")
COMPILING: Final = "compiling kernels, "
PATIENCE_MS: Final = 20_000


class Block(NamedTuple):
    """A fenced block of a page, and the prose right before it."""

    before: str
    language: str
    text: str


def blocks(page: str) -> Iterator[Block]:
    """The blocks of a page in their order."""
    end = 0
    for found in BLOCK.finditer(page):
        yield Block(page[end : found.start()].strip().rpartition("\n\n")[2], found[1], found[2])
        end = found.end()


def matches(shown: str, printed: str) -> bool:
    """Whether this was printed, but for what `…` stands for."""
    lines = [
        "(?:.*\n)*?" if line.strip() == "…" else ".*?".join(map(re.escape, line.split("…"))) + " *\n"
        for line in shown.splitlines()
    ]
    return re.fullmatch("".join(lines), printed if printed.endswith("\n") else f"{printed}\n") is not None


class Reader:
    """Follows blocks one after the other, in a folder that is the current one; browser: asked for where a page is."""

    def __init__(self, folder: Path, browser: Callable[[], Browser]) -> None:
        self._folder, self._browser = folder, browser
        self._names: dict[str, Any] = {}
        self._printed = ""
        self._addresses: dict[str, str] = {}
        self._running = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._running.close()

    def follow(self, block: Block) -> None:
        """Do what a block says, or compare what it shows; a wrong block fails the test."""
        if block.language == "text":
            self._compare(block)
        elif block.language == "python":
            with self._printing():
                exec(compile(self._here(block.text), "tutorial", "exec"), self._names)
        elif block.language == "sh":
            with self._printing():
                for line in block.text.replace("\\\n", " ").splitlines():
                    self._type(line)
        else:
            saved = SAVED.search(block.before)
            assert saved, f"no line names the file of the block that begins {block.text[:40]!r}"
            Path(saved[1]).write_text(self._here(block.text), encoding="utf-8")

    @contextmanager
    def _printing(self) -> Iterator[None]:
        """Keep what is printed, as a terminal shows it, but for what only a first start says."""
        with redirect_stdout(io.StringIO()) as printed, redirect_stderr(printed):
            yield
        lines = printed.getvalue().splitlines(keepends=True)
        self._printed = "".join(line for line in lines if not line.startswith(COMPILING))

    def _here(self, text: str) -> str:
        """The text with the addresses at which things run here."""
        for shown, address in self._addresses.items():
            text = text.replace(shown, address)
        return text

    def _type(self, line: str) -> None:
        words = shlex.split(line, comments=True)
        settings = {}
        while words and re.match(r"[A-Z_]+=", words[0]):
            name, _, settings[name] = words.pop(0).partition("=")
        if words[:2] == ["joulepath", "serve"]:
            self._serve(words[2:], settings)
        elif words[:1] == ["joulepath"]:
            assert not settings
            code = cli(words[1:], standalone_mode=False)
            assert not code, f"{line!r} ends with {code}"
        elif words[:3] == ["python", "-m", "http.server"]:
            self._serve_files(int(words[3]))
        else:
            raise AssertionError(f"{line!r} is not understood here")

    def _serve(self, options: list[str], settings: dict[str, str]) -> None:
        if options[:1] == ["--graph"]:
            settings["JOULEPATH_DEFAULT_GRAPH"] = options[1]
        else:
            assert not options, options
        for name, value in settings.items():
            if port := re.fullmatch(r"http://127\.0\.0\.1:(\d+)", value):
                self._serve_files(int(port[1]))
                settings[name] = self._here(value)
        self._addresses[SERVICE] = self._running.enter_context(served(self._folder.parent, **settings))

    def _serve_files(self, port: int) -> None:
        if f"http://127.0.0.1:{port}" in self._addresses:  # since the service was told of the page's address
            return
        handler = partial(_Quiet, directory=str(self._folder))
        server = self._running.enter_context(ThreadingHTTPServer(("127.0.0.1", 0), handler))
        Thread(target=server.serve_forever, daemon=True).start()
        self._running.callback(server.shutdown)
        self._addresses[f"http://127.0.0.1:{port}"] = f"http://127.0.0.1:{server.server_port}"

    def _compare(self, block: Block) -> None:
        opened = OPENED.search(block.before)
        if opened:
            self._look(self._here(opened[1]), block.text)
        else:
            assert matches(block.text, self._printed), f"shown:\n{block.text}\nprinted:\n{self._printed}"

    def _look(self, address: str, shown: str) -> None:
        page = self._browser().new_page(viewport={"width": 900, "height": 600})
        faults: list[str] = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(address)
        for line in shown.splitlines():
            expect(page.locator("body")).to_contain_text(line, timeout=PATIENCE_MS)
        page.close()
        assert not faults, "\n".join(faults)


class _Quiet(SimpleHTTPRequestHandler):
    """Files of a folder, without a log."""

    def log_message(self, format: str, *args: object) -> None:
        pass
