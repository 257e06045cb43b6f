"""The package as it is installed: its wheel alone, in an environment of its own, used from an empty folder."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import sysconfig
import time
import urllib.request
import venv
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parents[2]
PLACES: Final = ("--start", "43.872,-36.433", "--goal", "43.697,-35.19")
START_LIMIT_S: Final = 600.0  # a first start compiles; here only so that a server that hangs ends the test
TOP_LEVEL: Final = {"app", "diagnosis", "energy", "joulepath", "proof", "reproduction", "routing"}


class Installed(NamedTuple):
    """An environment with the wheel, and an empty folder to work in."""

    python: Path
    packages: Path
    folder: Path
    environment: dict[str, str]

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True, text=True, check=False
        )

    def joulepath(self, *arguments: str) -> str:
        ran = self.run(str(self.python.with_name("joulepath")), *arguments)
        assert ran.returncode == 0, ran.stderr
        return ran.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from the source distribution, as from the checkout: what either lacks is missing here."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "sdist", "--directory", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (source,) = folder.glob("*.tar.gz")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--wheel-dir", str(folder), str(source)], cwd=folder, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel in a new environment that sees the dependencies of this one, but not its joulepath.

    What lies in this one's site-packages is on the path there, without its .pth files being read: so the editable
    joulepath is not. The cache of kernels is that of the user, or a first compilation would take minutes.
    """
    place = tmp_path_factory.mktemp("installed")
    venv.create(place / "venv", with_pip=False, symlinks=True)
    python = place / "venv" / "bin" / "python"
    packages = Path(
        sysconfig.get_path("purelib", "venv", vars={"base": str(place / "venv"), "platbase": str(place / "venv")})
    )
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run([*pip, str(wheel)], check=True, capture_output=True, cwd=place)
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    folder = place / "empty"
    folder.mkdir()
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("JOULEPATH_", "PYTHON"))}
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    homes = {"HOME": str(place / "home"), "XDG_DATA_HOME": str(place / "data"), "XDG_CACHE_HOME": cache}
    return Installed(python, packages, folder, kept | homes)


def test_wheel_carries_what_is_read_by_path_and_the_licences(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    inside = [name.partition("/")[2] for name in names if name.startswith("joulepath/")]
    for folder in ("data/graphs", "data/vehicles", "data/cycles", "web"):
        tracked = subprocess.run(
            ["git", "ls-files", "-z", folder], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.split("\0")[:-1]
        assert sorted(name for name in inside if name.startswith(f"{folder}/")) == sorted(tracked)
    assert "py.typed" in inside
    assert {name.split("/")[-1] for name in names if ".dist-info/licenses/" in name} == {"LICENSE", "NOTICE"}
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == TOP_LEVEL


def test_modules_are_those_of_the_wheel(installed: Installed) -> None:
    program = f"import importlib; [print(importlib.import_module(n).__file__) for n in {sorted(TOP_LEVEL)}]"
    ran = installed.run(str(installed.python), "-c", program)
    assert ran.stderr == ""
    assert [Path(line).parents[1] for line in ran.stdout.splitlines()] == [installed.packages] * len(TOP_LEVEL)


def test_vehicles_and_graphs_are_found_from_an_empty_folder(installed: Installed) -> None:
    vehicles = json.loads(installed.joulepath("vehicles", "list", "--json"))
    bundled = [file.stem for file in (ROOT / "data" / "vehicles").glob("*.toml")]
    assert [vehicle["id"] for vehicle in vehicles["vehicles"]] == sorted(bundled)
    graphs = json.loads(installed.joulepath("graphs", "list", "--json"))
    data = installed.packages / "joulepath" / "data" / "graphs"
    assert graphs["paths"] == {name: str(data / name) for name in ("coquimbo", "highlands")}
    own = str(Path(installed.environment["XDG_DATA_HOME"]) / "joulepath" / "graphs")
    assert graphs["folders"] == [{"path": own, "exists": False}, {"path": str(data), "exists": True}]


def test_vehicles_are_checked_on_the_bundled_cycles(installed: Installed) -> None:
    assert "hyundai-kona-64" in installed.joulepath("vehicles", "check", "hyundai-kona-64")


def test_route_and_python_interface_answer_alike_from_an_empty_folder(installed: Installed) -> None:
    answer = json.loads(installed.joulepath("route", *PLACES, "--soc", "0.5", "--json"))
    program = (
        "import joulepath as j; r, = j.route(j.Graph.load('highlands'), j.Vehicle.load('hyundai-kona-64'),"
        "start=(43.872, -36.433), goal=(43.697, -35.19), soc_frac=0.5); print(repr(r.energy_kwh))"
    )
    ran = installed.run(str(installed.python), "-c", program)
    assert ran.returncode == 0, ran.stderr
    assert float(ran.stdout) == answer["routes"][0]["energy_kwh"]
    assert list(installed.folder.iterdir()) == []


@pytest.fixture(scope="module")
def server(installed: Installed) -> Iterator[str]:
    """The address of `joulepath serve` from the empty folder."""
    log = installed.folder.parent / "log.txt"
    command = [str(installed.python.with_name("joulepath")), "serve", "--port", "0"]
    with (
        log.open("w") as written,
        subprocess.Popen(command, cwd=installed.folder, env=installed.environment, stderr=written) as process,
    ):
        try:
            until = time.monotonic() + START_LIMIT_S
            while not (found := re.search(r"running on (http://\S+)", said := log.read_text(encoding="utf-8"))):
                assert process.poll() is None, said
                assert time.monotonic() < until, said
                time.sleep(0.05)
            yield found[1]
        finally:
            process.terminate()


def ask(address: str, body: dict[str, Any] | None = None) -> tuple[int, bytes]:
    data = None if body is None else json.dumps(body).encode()
    sent = urllib.request.Request(address, data, {"Content-Type": "application/json"})
    with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(sent) as response:
        return response.status, response.read()


def test_server_answers_page_health_route_and_docs_from_an_empty_folder(server: str) -> None:
    status, page = ask(server + "/")
    assert (status, page) == (200, (ROOT / "web" / "index.html").read_bytes())
    for path in ("/healthz", "/readyz", "/docs", "/web/lib/maplibre-gl.js", "/web/js/main.js"):
        assert ask(server + path)[0] == 200
    status, answer = ask(server + "/route", {"start": [-36.433, 43.872], "goal": [-35.19, 43.697], "soc": 0.5})
    assert status == 200
    assert json.loads(answer)["routes"][0]["feasible"] is True


def test_server_keeps_vehicles_in_the_users_data_folder(server: str, installed: Installed) -> None:
    assert ask(server + "/vehicles")[0] == 200
    assert (Path(installed.environment["XDG_DATA_HOME"]) / "joulepath" / "vehicles.sqlite").is_file()
