"""Files of deployment name settings, addresses, ports, folders and commands that exist."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from typer.main import get_command

from app.cli.main import cli
from app.errors.problems import KINDS
from app.main import described_routes
from app.schemas.problem import Problem
from app.settings import Settings
from tests.deploy.files import (
    DEPLOY,
    DOCKERFILE,
    NGINX,
    PAGES,
    ROOT,
    compose,
    container,
    dockerfile_environment,
    kubernetes,
    nginx_values,
    text_of,
    unit,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

FILES = [DOCKERFILE, *(path for path in sorted(DEPLOY.iterdir()) if path.suffix != ".md"), *PAGES]
VARIABLE = re.compile(r"\bJOULEPATH_[A-Z_]+[A-Z]\b")
BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+|\{[^}]*\})(/[\w/{}.-]*)")
BYTES = {"k": 2**10, "m": 2**20, "Gi": 2**30}


def seconds(text: str) -> float:
    assert text.endswith("s")
    return float(text[:-1])


def size(text: str) -> int:
    number, unit_name = re.fullmatch(r"(\d+)(\w*)", text).groups()  # type: ignore[union-attr]
    return int(number) * BYTES[unit_name]


def methods(path: str) -> set[str]:
    """What may be asked of an address of the service; / is the map."""
    found = {method for route in described_routes() if route.path_regex.match(path) for method in route.methods or ()}
    return found | {"GET"} if path == "/" else found


def commands() -> Iterator[tuple[str, list[str]]]:
    """Commands of this project and of Dask, with where they stand."""
    for name, service in compose()["services"].items():
        if service.get("command"):
            yield f"compose: {name}", service["command"]
    yield "Dockerfile", ["joulepath", "serve"]
    (start,) = unit()["ExecStart"]
    yield "unit", [Path(start.split()[0]).name, *start.split()[1:]]
    for page in PAGES:
        for block in BLOCK.findall(text_of(page)):
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line.split(" > ")[0], comments=True)
                for k, word in enumerate(words[:-1]):  # others of that name are services, users and folders
                    is_program = word == "joulepath" or word.endswith("/bin/joulepath")
                    if is_program and words[k + 1] in get_command(cli).commands:  # type: ignore[attr-defined]
                        yield f"{page.name}: {line}", ["joulepath", *words[k + 1 :]]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_setting_that_is_named_is_one_of_the_service(path: Path) -> None:
    known = {f"JOULEPATH_{name.upper()}" for name in Settings.model_fields}
    assert set(VARIABLE.findall(text_of(path))) <= known


def test_settings_that_are_given_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    given = [
        dockerfile_environment(),
        compose()["services"]["joulepath"]["environment"],
        kubernetes()["ConfigMap"]["data"],
        dict(re.findall(r"^#? ?(JOULEPATH_\w+)=(.+)$", text_of(DEPLOY / "joulepath.env"), re.MULTILINE)),
    ]
    assert all(any(name.startswith("JOULEPATH_") for name in environment) for environment in given)
    for environment in given:
        with monkeypatch.context() as patch:
            for name, value in environment.items():
                default = re.fullmatch(r"\$\{\w+:-(.*)\}", value)
                patch.setenv(name, default[1] if default else value)
            Settings()


def test_every_address_that_is_asked_is_one_of_the_service() -> None:
    found = container()
    probes = [found[f"{name}Probe"]["httpGet"] for name in ("startup", "liveness", "readiness")]
    asked = [(f"kubernetes: {probe}", probe["path"]) for probe in probes]
    for path in FILES:
        asked += [(path.name, address) for _, address in ADDRESS.findall(text_of(path))]
    assert len(asked) > 6
    assert not [(where, path) for where, path in asked if not methods(path)]
    assert {probe["path"] for probe in probes} == {"/healthz", "/readyz"}
    assert "/readyz" in text_of(DOCKERFILE)
    for path in ("/diagnoses", "/reload"):
        assert methods(path)
        assert f" {path} {{" in text_of(NGINX)


def test_ports_are_the_same_wherever_they_are_named() -> None:
    port = dockerfile_environment()["JOULEPATH_PORT"]
    services = compose()["services"]
    assert re.findall(r"^EXPOSE (\d+)$", text_of(DOCKERFILE), re.MULTILINE) == [port]
    assert [str(each["containerPort"]) for each in container()["ports"]] == [port]
    assert f"server joulepath:{port};" in text_of(NGINX)
    assert "joulepath" in services
    (listens,) = nginx_values("listen")
    outside = listens.split()[0]
    assert [each.rpartition(":")[2] for each in services["proxy"]["ports"]] == [outside]
    assert f"127.0.0.1:{outside}/healthz" in services["proxy"]["healthcheck"]["test"][-1]
    (start,), (after,) = unit()["ExecStart"], unit()["ExecStartPost"]
    assert f"--port {port}" in start
    assert f"http://127.0.0.1:{port}/readyz" in after
    (service_port,) = kubernetes()["Service"]["spec"]["ports"]
    assert service_port["targetPort"] in {each["name"] for each in container()["ports"]}
    scheduler = services["scheduler"]["command"]
    assert f"tcp://scheduler:{scheduler[scheduler.index('--port') + 1]}" in services["worker"]["command"]


def test_folders_of_graphs_database_and_kernels_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the service looks, by the environment that it is given, is where volumes are."""
    for environment, kept, cache in (
        (dockerfile_environment(), "/var/lib/joulepath", "/var/lib/joulepath/cache"),
        (dict(pair.split("=", 1) for pair in unit()["Environment"]), "/var/lib/joulepath", "/var/cache/joulepath"),
    ):
        assert environment["XDG_CACHE_HOME"] == cache
        with monkeypatch.context() as patch:
            for name, value in environment.items():
                patch.setenv(name, value)
            settings = Settings()
        assert settings.graph_dirs[0] == Path(kept, "graphs")
        assert settings.database_url == f"sqlite:///{kept}/vehicles.sqlite"
    assert re.findall(r"^VOLUME (.*)$", text_of(DOCKERFILE), re.MULTILINE) == ["/var/lib/joulepath"]
    for name in ("joulepath", "worker", "batch"):
        assert {"state:/var/lib/joulepath", "graphs:/var/lib/joulepath/graphs"} <= set(
            compose()["services"][name]["volumes"]
        )
    mounted = {each["name"]: each["mountPath"] for each in container()["volumeMounts"]}
    assert mounted == {"graphs": "/var/lib/joulepath/graphs", "cache": "/var/lib/joulepath/cache", "uploads": "/tmp"}
    assert (unit()["StateDirectory"], unit()["CacheDirectory"]) == (["joulepath"], ["joulepath"])


@pytest.mark.parametrize(
    ("where", "words"), list(commands()), ids=lambda value: value if isinstance(value, str) else ""
)
def test_every_command_and_its_options_exist(where: str, words: list[str]) -> None:
    program, *rest = words
    if program == "dask":
        from distributed.cli import dask_scheduler, dask_worker

        {"scheduler": dask_scheduler, "worker": dask_worker}[rest[0]].main.make_context(rest[0], rest[1:])
        return
    assert program == "joulepath", where
    command: Any = get_command(cli)
    name = ""
    while hasattr(command, "commands"):
        name, *rest = rest
        assert name in command.commands
        command = command.commands[name]
    if "--help" not in rest:
        command.make_context(name, rest)


def test_pages_show_commands() -> None:
    shown = [where for where, _ in commands()]
    assert sum("README.md" in where for where in shown) >= 4
    assert sum("operations.md" in where for where in shown) >= 2


def test_times_and_sizes_fit_those_of_the_service() -> None:
    settings = Settings()
    for wait in nginx_values("proxy_read_timeout"):
        assert seconds(wait) > settings.time_limit_s + 1.0
    bodies, uploads = (size(text) for text in nginx_values("client_max_body_size"))
    assert (bodies, uploads) == (settings.body_limit_bytes, settings.diagnosis_limit_bytes)
    stops = [
        seconds(compose()["services"]["joulepath"]["stop_grace_period"]),
        float(kubernetes()["Deployment"]["spec"]["template"]["spec"]["terminationGracePeriodSeconds"]) - 5.0,
        float(unit()["TimeoutStopSec"][0]),
    ]
    assert all(stop > settings.time_limit_s + 15.0 for stop in stops)  # the queue of diagnoses is given 15 s
    volumes = {each["name"]: each for each in kubernetes()["Deployment"]["spec"]["template"]["spec"]["volumes"]}
    waiting = (settings.diagnosis_upload_limit + settings.diagnosis_queue_limit) * settings.diagnosis_limit_bytes
    assert size(volumes["uploads"]["emptyDir"]["sizeLimit"]) > waiting


def test_problems_of_the_proxy_are_those_of_the_service() -> None:
    """But for too many requests, which only the proxy counts."""
    bodies = [json.loads(body) for body in re.findall(r"return \d+ '(.*)';", text_of(NGINX))]
    assert [body["status"] for body in bodies] == [413, 429, 503]
    for body in (bodies[0], bodies[2]):
        problem = Problem.model_validate(body)
        kind = KINDS[problem.code]
        assert (problem.type, problem.title, problem.status) == (
            f"urn:joulepath:problem:{problem.code}",
            kind.title,
            kind.status,
        )


def test_objects_of_kubernetes_name_each_other() -> None:
    found = kubernetes()
    labels = found["Deployment"]["spec"]["template"]["metadata"]["labels"]
    assert found["Deployment"]["spec"]["selector"]["matchLabels"] == labels
    assert found["Service"]["spec"]["selector"] == labels
    assert found["PodDisruptionBudget"]["spec"]["selector"]["matchLabels"] == labels
    volumes = {each["name"]: each for each in found["Deployment"]["spec"]["template"]["spec"]["volumes"]}
    assert {each["name"] for each in container()["volumeMounts"]} == set(volumes)
    claim = volumes["graphs"]["persistentVolumeClaim"]["claimName"]
    assert claim == found["PersistentVolumeClaim"]["metadata"]["name"]
    assert container()["envFrom"] == [{"configMapRef": {"name": found["ConfigMap"]["metadata"]["name"]}}]
    (secret,) = container()["env"]
    name = secret["valueFrom"]["secretKeyRef"]["name"]
    assert f"create secret generic {name} " in text_of(DEPLOY / "kubernetes.yaml")


def test_nothing_runs_as_root_and_only_the_proxy_is_reached_from_outside() -> None:
    users = re.findall(r"^USER (.*)$", text_of(DOCKERFILE), re.MULTILINE)
    assert users[-1].isdecimal()
    assert int(users[-1]) > 0
    pod = kubernetes()["Deployment"]["spec"]["template"]["spec"]["securityContext"]
    assert (pod["runAsNonRoot"], str(pod["runAsUser"])) == (True, users[-1])
    assert unit()["User"] != ["root"]
    services, networks = compose()["services"], compose()["networks"]
    assert [name for name, service in services.items() if "ports" in service] == ["proxy"]
    assert [name for name, network in networks.items() if not (network or {}).get("internal")] == ["outside"]
    assert [name for name, service in services.items() if "outside" in service["networks"]] == ["proxy"]
    assert not {name for name in ("scheduler", "worker", "batch") if set(services[name]["networks"]) != {"batch"}}


def test_image_is_made_of_what_the_wheel_holds_and_of_the_lock_with_the_driver_of_postgresql() -> None:
    copied = re.findall(r"^COPY (?!--from)(.*) \S+$", text_of(DOCKERFILE), re.MULTILINE)
    sources = {name for line in copied for name in line.split()}
    project = tomllib.loads(text_of(ROOT / "pyproject.toml"))
    included = set(project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"])
    assert included - {"manual"} <= sources  # the manual is made there
    assert all((ROOT / name).exists() for name in sources)
    let_in = {line[1:] for line in text_of(ROOT / ".dockerignore").splitlines() if line.startswith("!")}
    assert sources <= let_in
    lock = text_of(ROOT / "requirements.lock")
    for package in ("psycopg", "psycopg-binary"):
        assert re.search(rf"^{package}==[\d.]+ .*\\\n    --hash=sha256:", lock, re.MULTILINE)


def test_base_images_can_be_given_with_their_digest() -> None:
    (default,) = re.findall(r"^ARG PYTHON_IMAGE=(\S+)$", text_of(DOCKERFILE), re.MULTILINE)
    assert set(re.findall(r"^FROM (\S+)", text_of(DOCKERFILE), re.MULTILINE)) == {"${PYTHON_IMAGE}"}
    services = compose()["services"]
    given = [
        services["joulepath"]["build"]["args"]["PYTHON_IMAGE"],
        *(services[n]["image"] for n in ("proxy", "database")),
    ]
    names = [re.fullmatch(r"\$\{(\w+):-(\S+)\}", text) for text in given]
    assert all(names)
    assert names[0] is not None
    assert names[0][2] == default
    for found in names:
        assert found is not None
        assert f"# {found[1]}={found[2]}@sha256:" in text_of(DEPLOY / "example.env")
