"""The HTTP contract, from the service's own OpenAPI document."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase
from hypothesis import settings as hypothesis_settings
from schemathesis.specs.openapi.checks import negative_data_rejection, positive_data_acceptance

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from tests.app.expected import database_in

if TYPE_CHECKING:
    from fastapi import FastAPI

schema = schemathesis.openapi.from_dict(create_app(Settings()).openapi())
# what a schema can't say (reserve_soc ≤ soc, weights not all 0, links that follow each other) is refused with 422
UNPROMISED = [positive_data_acceptance]
# a form sends every field as text, so that what is of another type in the schema's words is a text like any other
UNPROMISED_OF_FORMS = [*UNPROMISED, negative_data_rejection]


@pytest.fixture(scope="module")
def tested(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    """The application on the bundled graphs, where the examples lie; every generated call starts and stops it."""
    settings = Settings(database_url=database_in(tmp_path_factory.mktemp("contract")))
    service = Service(settings)
    service.load_all()
    return create_app(settings, service)


@schema.parametrize()
@hypothesis_settings(
    max_examples=25,
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_service_for_any_request_keeps_to_its_openapi(case: schemathesis.Case, tested: FastAPI) -> None:
    sends_form = case.media_type == "multipart/form-data"
    case.call_and_validate(app=tested, excluded_checks=UNPROMISED_OF_FORMS if sends_form else UNPROMISED)
