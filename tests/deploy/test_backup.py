"""The commands of docs/operations.md back up a service at work, and bring all of it back elsewhere."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import httpx2
import pytest

from benchmarks.browser import served
from energy.vehicle.files import load_vehicles
from energy.vehicle.vehicle import Vehicle
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import VEHICLE
from tests.app.recorded import write_winter
from tests.app.store.postgresql_server import OWNER, programs, running_server
from tests.deploy.files import PAGES, compose, text_of

if TYPE_CHECKING:
    from tests.app.store.postgresql_server import Server

BLOCKS = re.findall(r"^```sh\n(.*?)^```$", text_of(PAGES[1]), re.MULTILINE | re.DOTALL)
CAR = "hyundai-kona-64"
WAIT_S = 120.0


class BackedUp(NamedTuple):
    """A folder with the backup of a database, and what had been acknowledged before it began."""

    folder: Path
    vehicles: set[str]
    diagnosis: dict[str, Any]
    documents: dict[str, str]


def run(word: str, folder: Path) -> str:
    """What the page's commands with a word print, on folders of the test in place of the machine's."""
    (block,) = (block for block in BLOCKS if word in block)
    for name in ("/var/lib/joulepath", "/var/backups"):
        block = block.replace(name, str(folder / Path(name).name))
    block = re.sub(r"--owner \w+ --group \w+ ", "", block).replace("python3 ", f"{sys.executable} ")
    return subprocess.run(["bash", "-euo", "pipefail", "-c", block], check=True, capture_output=True, text=True).stdout


def asking(address: str) -> httpx2.Client:
    return httpx2.Client(base_url=address, timeout=60.0, trust_env=False)


def diagnosed(client: httpx2.Client, drives: Path) -> dict[str, Any]:
    """A diagnosis that is done, of recordings written into a folder."""
    car = load_vehicles(VEHICLES)[CAR]
    assert isinstance(car, Vehicle)
    write_winter(drives, car)
    files = [("recordings", (path.name, path.read_bytes(), "text/csv")) for path in sorted(drives.glob("*.csv"))]
    queued = client.post("/diagnoses", data={"vehicle": CAR}, files=files)
    assert queued.status_code == 202, queued.text
    until = time.monotonic() + WAIT_S
    while (diagnosis := client.get(queued.headers["location"]).json())["state"] in ("queued", "running"):
        assert time.monotonic() < until
        time.sleep(0.2)
    assert diagnosis["state"] == "done", diagnosis
    found: dict[str, Any] = diagnosis
    return found


def documents_of(client: httpx2.Client, diagnosis: dict[str, Any]) -> dict[str, str]:
    """All that is kept of a diagnosis, by its kind."""
    links = {name: path for name, path in diagnosis["links"].items() if name != "self" and path is not None}
    found = {name: client.get(path).raise_for_status().text for name, path in links.items()}
    for trip in client.get(links["trips"]).json()["trips"]:
        found[trip["id"]] = client.get(trip["links"]["self"]).raise_for_status().text
    return found


@pytest.fixture(scope="module")
def backed_up(tmp_path_factory: pytest.TempPathFactory) -> BackedUp:
    folder = tmp_path_factory.mktemp("backup")
    live, backups, drives = folder / "joulepath", folder / "backups", folder / "drives"
    for place in (live, backups):
        place.mkdir()
    database = f"sqlite:///{live / 'vehicles.sqlite'}"
    with served(folder, JOULEPATH_DATABASE_URL=database) as address, asking(address) as client:
        diagnosis = diagnosed(client, drives)
        documents = documents_of(client, diagnosis)
        acknowledged: list[str] = []
        stop = threading.Event()

        def store_without_end() -> None:
            with asking(address) as own:
                for k in count():
                    if stop.is_set():
                        return
                    own.put(f"/vehicles/van-{k}", json=VEHICLE).raise_for_status()
                    acknowledged.append(f"van-{k}")

        writer = threading.Thread(target=store_without_end)
        writer.start()
        while len(acknowledged) < 20:
            time.sleep(0.01)
        before = set(acknowledged)
        run("live.backup(copy)", folder)
        while len(acknowledged) < len(before) + 5:  # writing goes on after it
            assert writer.is_alive()
            time.sleep(0.01)
        stop.set()
        writer.join()
    shutil.rmtree(live)
    return BackedUp(folder, before, diagnosis, documents)


def test_backup_of_a_service_that_is_written_to_holds_all_that_was_stored_before(backed_up: BackedUp) -> None:
    live = backed_up.folder / "joulepath"
    live.mkdir()
    assert run("integrity_check", backed_up.folder).strip() == "ok"
    elsewhere = backed_up.folder / "elsewhere"
    elsewhere.mkdir()
    database = f"sqlite:///{live / 'vehicles.sqlite'}"
    with served(elsewhere, JOULEPATH_DATABASE_URL=database) as address, asking(address) as client:
        assert backed_up.vehicles <= {each["id"] for each in client.get("/vehicles").json()["vehicles"]}
        for name in sorted(backed_up.vehicles)[:3]:
            assert client.get(f"/vehicles/{name}").json()["mass_kg"] == VEHICLE["mass_kg"]
        assert client.get(f"/diagnoses/{backed_up.diagnosis['id']}").json() == backed_up.diagnosis
        assert documents_of(client, backed_up.diagnosis) == backed_up.documents
        assert client.put("/vehicles/after", json=VEHICLE).status_code == 201


def test_backup_of_graphs_comes_back_whole_and_a_torn_one_is_refused(tmp_path: Path) -> None:
    graphs = tmp_path / "joulepath" / "graphs"
    (tmp_path / "backups").mkdir()
    save_graph(street_grid("grid", Terrain.SYNTHETIC), graphs / "grid")
    (block,) = (block for block in BLOCKS if "tar --create" in block)
    pack, unpack = block.splitlines()
    place = {"/var/lib/joulepath": str(tmp_path / "joulepath"), "/var/backups": str(tmp_path / "backups")}
    for name, path in place.items():
        pack, unpack = pack.replace(name, path), unpack.replace(name, path)
    subprocess.run(["bash", "-c", pack], check=True)
    shutil.rmtree(graphs)
    subprocess.run(["bash", "-c", unpack], check=True)
    check = [sys.executable, "-m", "app.cli", "graphs", "check", str(graphs / "grid")]
    assert "as it was written" in subprocess.run(check, check=True, capture_output=True, text=True).stdout
    (graphs / "grid" / "head.npy").write_bytes((graphs / "grid" / "head.npy").read_bytes()[:-8])
    torn = subprocess.run(check, check=False, capture_output=True, text=True)
    assert (torn.returncode, "head.npy" in torn.stderr) == (1, True)


def run_in_database(word: str, server: Server, folder: Path) -> None:
    """Run the page's command with a word, as it stands there, its files in a folder.

    In place of Docker, a script runs what would run in the container of the database on a server of the test.
    """
    (block,) = (block for block in BLOCKS if word in block)
    within = ("compose", "--file", "deploy/compose.yaml", "exec", "-T", "database")
    script = folder / "docker"
    script.write_text(
        f"""#!/bin/bash -eu
[ "${{*:1:{len(within)}}}" = {shlex.quote(" ".join(within))} ]
shift {len(within)}
PATH={shlex.quote(str(programs()))} PGHOST=127.0.0.1 PGPORT={server.port} exec "$@"
"""
    )
    script.chmod(0o755)
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
    subprocess.run(["bash", "-euo", "pipefail", "-c", block], check=True, cwd=folder, env=environment)


def test_backup_of_postgresql_brings_everything_back_into_a_new_cluster_and_into_a_changed_database(
    tmp_path: Path,
) -> None:
    live, elsewhere = tmp_path / "live", tmp_path / "elsewhere"
    for place in (live, elsewhere):
        place.mkdir()
    described = compose()["services"]["database"]["environment"]
    assert (described["POSTGRES_USER"], described["POSTGRES_DB"]) == (OWNER, "joulepath")
    vehicles = {f"van-{k}": {**VEHICLE, "mass_kg": 1500.0 + k} for k in range(20)}

    def check(address: str) -> None:
        with asking(address) as client:
            own = {each["id"] for each in client.get("/vehicles").json()["vehicles"] if each["id"].startswith("van-")}
            assert own == set(vehicles)
            for name, vehicle in vehicles.items():
                assert client.get(f"/vehicles/{name}").json()["mass_kg"] == vehicle["mass_kg"]
            assert client.get("/diagnoses").json()["diagnoses"] == listed
            assert client.get(f"/diagnoses/{diagnosis['id']}").json() == diagnosis
            assert documents_of(client, diagnosis) == documents

    with running_server() as server:
        url = server.make_database("joulepath")
        with served(live, JOULEPATH_DATABASE_URL=url) as address, asking(address) as client:
            for name, vehicle in vehicles.items():
                client.put(f"/vehicles/{name}", json=vehicle).raise_for_status()
            diagnosis = diagnosed(client, tmp_path / "drives")
            documents = documents_of(client, diagnosis)
            listed = client.get("/diagnoses").json()["diagnoses"]
            run_in_database("pg_dump", server, tmp_path)
            client.put("/vehicles/van-late", json=VEHICLE).raise_for_status()
            client.put("/vehicles/van-0", json={**VEHICLE, "mass_kg": 999.0}).raise_for_status()
            client.delete("/vehicles/van-1").raise_for_status()
            client.delete(f"/diagnoses/{diagnosis['id']}").raise_for_status()
        run_in_database("pg_restore", server, tmp_path)
        with served(live, JOULEPATH_DATABASE_URL=url) as address:
            check(address)
    with running_server() as fresh:
        url = fresh.make_database("joulepath")
        run_in_database("pg_restore", fresh, tmp_path)
        with served(elsewhere, JOULEPATH_DATABASE_URL=url) as address, asking(address) as client:
            check(address)
            assert client.put("/vehicles/after", json=VEHICLE).status_code == 201
