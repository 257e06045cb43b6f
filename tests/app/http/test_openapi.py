"""The OpenAPI document: complete, true to its own schemas, and readable without a network."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema_rs
import pytest

from app.http.descriptions import MEANT
from app.main import create_app
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fastapi import FastAPI
    from starlette.testclient import TestClient

    from app.settings import Settings


def operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield f"{method.upper()} {path}", operation


def examples_of(content: dict[str, Any]) -> list[Any]:
    if "example" in content:
        return [content["example"]]
    return [example["value"] for example in content.get("examples", {}).values()]


def invalid_reason(document: dict[str, Any], schema: dict[str, Any], value: object) -> str | None:
    whole = {**schema, "components": document["components"]}
    errors = list(jsonschema_rs.Draft202012Validator(whole).iter_errors(value))
    return f"{errors[0].instance_path}: {errors[0].message[:300]}" if errors else None


def test_every_operation_has_summary_description_and_error_responses(app: FastAPI) -> None:
    for name, operation in operations(app.openapi()):
        assert operation["summary"], name
        assert operation["description"], name
        if name != "GET /healthz":
            assert "503" in operation["responses"], name


def test_operations_have_names_that_read_well_and_a_tag_that_is_described(app: FastAPI) -> None:
    document = app.openapi()
    names = [operation["operationId"] for _, operation in operations(document)]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z]+([A-Z][a-z]*)*", name) for name in names)
    assert {"findRoute", "findRange", "listStations", "searchPlaces"} <= set(names)
    described = {tag["name"] for tag in document["tags"] if tag["description"]}
    assert all(set(operation["tags"]) <= described for _, operation in operations(document))


def test_every_schema_and_every_property_is_described(app: FastAPI) -> None:
    schemas = app.openapi()["components"]["schemas"]
    named = [
        *(name for name, schema in schemas.items() if name != "JsonValue" and not schema.get("description")),
        *(
            f"{name}.{field}"
            for name, schema in schemas.items()
            for field, said in schema.get("properties", {}).items()
            if not said.get("description")
        ),
    ]
    assert named == []


def test_every_parameter_is_described(app: FastAPI) -> None:
    for name, operation in operations(app.openapi()):
        for parameter in operation.get("parameters", ()):
            assert parameter.get("description") or parameter["schema"].get("description"), (name, parameter["name"])


def test_what_is_described_for_all_schemas_is_used(app: FastAPI) -> None:
    fields = {
        field for schema in app.openapi()["components"]["schemas"].values() for field in schema.get("properties", {})
    }
    assert set(MEANT) <= fields


def test_document_names_the_server(app: FastAPI, settings: Settings) -> None:
    assert [server["url"] for server in app.openapi()["servers"]] == ["/"]
    elsewhere = create_app(settings.model_copy(update={"public_url": "https://maps.example/energy"}))
    assert elsewhere.openapi()["servers"][0]["url"] == "https://maps.example/energy"


def test_every_error_response_is_a_problem_with_examples_of_known_codes(app: FastAPI) -> None:
    document = app.openapi()
    for name, operation in operations(document):
        for status, response in operation["responses"].items():
            if int(status) < 400:
                continue
            assert list(response["content"]) == ["application/problem+json"], name
            content = response["content"]["application/problem+json"]
            assert content["schema"] == {"$ref": "#/components/schemas/Problem"}
            for example in examples_of(content):
                assert example["code"] in set(ErrorCode)
                assert example["status"] == int(status)


@pytest.mark.parametrize("name", ["POST /route", "POST /matrix", "GET /range", "POST /range", "POST /simulate"])
def test_operation_that_takes_conditions_documents_their_error(app: FastAPI, name: str) -> None:
    (operation,) = (operation for known, operation in operations(app.openapi()) if known == name)
    content = operation["responses"]["422"]["content"]["application/problem+json"]
    assert "invalid_conditions" in {example["code"] for example in examples_of(content)}


def test_every_example_is_valid_against_its_schema(app: FastAPI) -> None:
    document = app.openapi()
    checked = 0
    for name, operation in operations(document):
        bodies = [operation["requestBody"]["content"]] if "requestBody" in operation else []
        for contents in [*bodies, *(response.get("content", {}) for response in operation["responses"].values())]:
            for media_type, content in contents.items():
                examples = examples_of(content)
                assert examples, f"{name} has no example of {media_type}"
                for example in examples:
                    assert invalid_reason(document, content["schema"], example) is None, f"{name} {media_type}"
                    checked += 1
    assert checked > 30


def test_api_page_lists_every_error_code() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "http-api.md").read_text(encoding="utf-8")
    for code in ErrorCode:
        assert f"`{code.value}`" in page


def test_error_codes_are_a_closed_list_in_the_document(app: FastAPI) -> None:
    assert app.openapi()["components"]["schemas"]["ErrorCode"]["enum"] == [code.value for code in ErrorCode]


def test_every_reference_of_the_document_resolves(app: FastAPI) -> None:
    document = app.openapi()
    for name in re.findall(r'"#/components/schemas/([^"]+)"', json.dumps(document)):
        assert name in document["components"]["schemas"]


@pytest.mark.parametrize("path", ["/docs", "/redoc"])
def test_documentation_pages_load_nothing_from_another_host(client: TestClient, path: str) -> None:
    page = client.get(path)
    assert page.status_code == 200
    assert re.search(r"https?://|[\"'(]//", page.text) is None
    assert "default-src 'self'" in page.headers["content-security-policy"]
    for asset in re.findall(r'(?:src|href)="([^"]+)"', page.text):
        assert client.get(asset).status_code == 200, asset


def test_root_leads_to_the_documentation(client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert '<a href="docs">' in page.text
