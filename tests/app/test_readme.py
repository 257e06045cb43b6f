"""README.md: its commands print what it shows, its command lines parse, its links lead somewhere.

Run as a program (`python -m tests.app.test_readme`), it renews the outputs that README.md shows.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import pytest
from typer.main import get_command

from app.cli.main import cli

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parents[2]
README: Final = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS: Final = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
EXAMPLES: Final = [
    (command, printed)
    for (language, command), (_, printed) in pairwise(BLOCKS)
    if language == "sh" and command.startswith("curl ")
]
COMMAND_LINES: Final = [
    line for language, block in BLOCKS if language == "sh" for line in block.splitlines() if "bin/joulepath " in line
]
NUMBER: Final = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
START_LIMIT_S: Final = 300.0  # a first start compiles; here only so that a server that hangs ends the test


class Pipeline(NamedTuple):
    """A curl command and what its answer is piped through."""

    request: urllib.request.Request
    program: str


def pipeline(command: str, server: str) -> Pipeline:
    """The command as a shell would split it, sent to another server; only what the README uses is understood."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars="|")
    lexer.whitespace_split = True
    lexer.commenters = ""
    words = list(lexer)
    pipe = words.index("|")
    python, option, program = words[pipe + 1 :]
    assert (python, option) == ("python3", "-c")
    headers: dict[str, str] = {}
    url, body = "", None
    arguments = iter(words[1:pipe])
    for argument in arguments:
        if argument == "-H":
            name, value = next(arguments).split(": ", 1)
            headers[name] = value
        elif argument == "-d":
            body = next(arguments).encode()
        elif argument != "-s":
            assert not argument.startswith("-"), f"{argument} is not understood here"
            assert not url
            url = argument
    assert url.startswith("http://127.0.0.1:8000/")
    return Pipeline(urllib.request.Request(url.replace("http://127.0.0.1:8000", server), body, headers), program)


def numbers_and_text(printed: str) -> tuple[list[float], str]:
    """All numbers of a text, and the text with a mark in the place of each."""
    return [float(number) for number in NUMBER.findall(printed)], NUMBER.sub("#", printed).strip()


@contextmanager
def serving(folder: Path) -> Iterator[str]:
    """The address of a server started as `make serve` starts it, on a free port."""
    log = folder / "log.txt"
    command = [sys.executable, "-m", "app.cli", "serve", "--host", "127.0.0.1", "--port", "0"]
    plain = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    with (
        log.open("w") as written,
        subprocess.Popen(command, cwd=ROOT, env=plain, stdout=written, stderr=written) as process,
    ):
        try:
            yield address_in(log, process)
        finally:
            process.terminate()


def address_in(log: Path, process: subprocess.Popen[bytes]) -> str:
    """The address that a starting server writes to its log once it listens."""
    until = time.monotonic() + START_LIMIT_S
    while time.monotonic() < until:
        said = log.read_text(encoding="utf-8")
        found = re.search(r"running on (http://127\.0\.0\.1:\d+)", said)
        if found:
            return found[1]
        assert process.poll() is None, said
        time.sleep(0.05)
    raise AssertionError(f"the server does not listen: {log.read_text(encoding='utf-8')}")


def printed_by(command: str, server: str) -> str:
    """What the command prints, sent without curl: a bare machine may lack it."""
    sent = pipeline(command, server)
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with direct.open(sent.request) as response:
        answer = response.read()
    run = subprocess.run([sys.executable, "-c", sent.program], input=answer, capture_output=True, check=True)
    return run.stdout.decode()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with serving(tmp_path_factory.mktemp("server")) as address:
        yield address


def test_readme_has_five_curl_commands_with_their_output() -> None:
    assert len(EXAMPLES) == 5
    assert README.count("\ncurl ") == 5


@pytest.mark.parametrize("example", EXAMPLES, ids=["route", "range", "winter", "simulate", "charging"])
def test_curl_command_prints_what_the_readme_shows(example: tuple[str, str], server: str) -> None:
    command, shown = example
    printed = printed_by(command, server)
    shown_numbers, shown_text = numbers_and_text(shown)
    printed_numbers, printed_text = numbers_and_text(printed)
    assert printed_text == shown_text, printed
    assert printed_numbers == pytest.approx(shown_numbers, rel=1e-6, abs=1e-9), printed


@pytest.mark.parametrize("line", COMMAND_LINES)
def test_command_line_of_the_readme_has_options_that_exist(line: str) -> None:
    command, rest = get_command(cli), shlex.split(line.split(" > ")[0])[1:]
    name = ""
    while hasattr(command, "commands"):
        name, *rest = rest
        assert name in command.commands
        command = command.commands[name]
    command.make_context(name, rest)


@pytest.mark.parametrize("page", ["README.md", "docs/README.md"])
def test_links_of_a_page_lead_to_files(page: str) -> None:
    path = ROOT / page
    targets = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", path.read_text(encoding="utf-8"))
    assert targets
    for target in targets:
        assert (path.parent / target).is_file(), f"{page}: {target}"


def renew() -> None:
    """Write what the commands print today into README.md."""
    text = README
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder)) as address:
        for command, shown in EXAMPLES:
            text = text.replace(f"```text\n{shown}```", f"```text\n{printed_by(command, address)}```")
    (ROOT / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    renew()
