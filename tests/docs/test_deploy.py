"""The examples of proxies say what the service's settings say."""

from __future__ import annotations

import re
from typing import Final

import pytest

from app.settings import Settings
from tests.docs.named_code import ROOT

pytestmark = pytest.mark.nojit

EXAMPLES: Final = ("nginx.conf", "Caddyfile")
SIZE: Final = re.compile(r"(?:client_max_body_size|max_size) +(\d+)(?:m|MiB)\b")
FIELDS: Final = Settings.model_fields


@pytest.mark.parametrize("name", EXAMPLES)
def test_settings_that_an_example_names_are_there(name: str) -> None:
    named = re.findall(r"JOULEPATH_([A-Z_]+)", (ROOT / "deploy" / name).read_text(encoding="utf-8"))
    assert named
    assert {each.lower() for each in named} <= set(FIELDS)


@pytest.mark.parametrize("name", EXAMPLES)
def test_proxy_lets_bodies_through_that_the_service_takes_and_waits_longer_than_it_works(name: str) -> None:
    text = (ROOT / "deploy" / name).read_text(encoding="utf-8")
    limits = [FIELDS[field].default for field in ("body_limit_bytes", "diagnosis_limit_bytes")]
    assert sorted(int(size) * 1024**2 for size in SIZE.findall(text)) == limits
    waits = [int(seconds) for seconds in re.findall(r"(?:proxy_read_timeout|response_header_timeout) +(\d+)s", text)]
    assert min(waits) > FIELDS["time_limit_s"].default
    (idle,) = re.findall(r"(?:keepalive_timeout|keepalive) +(\d+)s *(?:; +#|\n)", text)
    assert int(idle) < FIELDS["keep_alive_s"].default
