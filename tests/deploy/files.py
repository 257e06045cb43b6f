"""The files that people deploy with, as the tests read them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import yaml

ROOT: Final = Path(__file__).resolve().parents[2]
DEPLOY: Final = ROOT / "deploy"
DOCKERFILE: Final = ROOT / "Dockerfile"
NGINX: Final = DEPLOY / "nginx.conf"
UNIT: Final = DEPLOY / "joulepath.service"
PAGES: Final = (DEPLOY / "README.md", ROOT / "docs" / "operations.md")


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def compose() -> dict[str, Any]:
    """The services, networks and volumes of the compose file; its anchors are resolved."""
    loaded: dict[str, Any] = yaml.safe_load(text_of(DEPLOY / "compose.yaml"))
    return loaded


def kubernetes() -> dict[str, dict[str, Any]]:
    """Objects by their kind, of which there is one each."""
    objects = list(yaml.safe_load_all(text_of(DEPLOY / "kubernetes.yaml")))
    by_kind = {each["kind"]: each for each in objects}
    assert len(by_kind) == len(objects)
    return by_kind


def container() -> dict[str, Any]:
    """The container of the Deployment."""
    (found,) = kubernetes()["Deployment"]["spec"]["template"]["spec"]["containers"]
    assert isinstance(found, dict)
    return found


def dockerfile_environment() -> dict[str, str]:
    """What the image's environment holds, of its last stage."""
    joined = text_of(DOCKERFILE).replace("\\\n", " ")
    stage = joined[joined.rindex("\nFROM ") :]
    lines = re.findall(r"^ENV (.*)$", stage, re.MULTILINE)
    return dict(pair.split("=", 1) for line in lines for pair in line.split())


def unit() -> dict[str, list[str]]:
    """Values of the unit's keys, which may come more than once."""
    found: dict[str, list[str]] = {}
    for line in text_of(UNIT).splitlines():
        if line and line[0] not in "#[":
            key, _, value = line.partition("=")
            found.setdefault(key, []).append(value)
    return found


def nginx_values(name: str) -> list[str]:
    """All values of a directive of nginx.conf."""
    return re.findall(rf"^ *{name} +([^;]+);", text_of(NGINX), re.MULTILINE)
