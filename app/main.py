"""The HTTP application."""

from __future__ import annotations

import asyncio
import logging
import signal
from contextlib import asynccontextmanager, suppress
from threading import Thread
from typing import TYPE_CHECKING, Any, Final

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline
from pydantic.json_schema import models_json_schema
from starlette.datastructures import MutableHeaders
from starlette.middleware.gzip import GZipMiddleware

from app import VERSION
from app.access.roles import HEALTH
from app.diagnosing.use_cases import Diagnoses
from app.errors.handlers import install_error_handlers
from app.errors.problems import PROBLEM_TYPE
from app.http.admission import Admission
from app.http.body_limit import BodyLimit
from app.http.cors import CrossOrigin
from app.http.descriptions import describe
from app.http.examples.problems import gate_codes, problems
from app.http.faces.installing import install_faces
from app.http.gate import Gate, SecurityHeaders
from app.http.metrics import Metrics
from app.http.observed import Observed
from app.http.readiness import DatabaseProbe
from app.http.routes import (
    diagnoses,
    graphs,
    health,
    matrix,
    metrics,
    places,
    range,
    route,
    simulate,
    stations,
    tiles,
    vehicles,
)
from app.http.routes.access import COMPRESSED_BYTES, COMPRESSION
from app.http.web import install_web
from app.schemas.diagnosis import DiagnosisRequest
from app.schemas.route import RouteFeatureCollection
from app.service.service import Service
from app.settings import Settings
from routing.errors import RoutingError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOG: Final = logging.getLogger(__name__)
DESCRIPTION: Final = """Routes that take the least energy, and areas that can be reached, for electric vehicles, from
physics.

Numbers carry their unit in their name. States of charge are fractions 0..1. Energy is positive when it leaves the
battery. Errors are problem details (RFC 9457) with a stable `code`; every answer names the data that it rests on.
"""
ROUTERS: Final = (
    route.router,
    matrix.router,
    range.router,
    simulate.router,
    vehicles.router,
    diagnoses.router,
    graphs.router,
    stations.router,
    places.router,
    tiles.router,
    health.router,
    metrics.router,
)
TAGS: Final = (
    ("route", "routes, plans with charging stops, and matrices of energy and time"),
    ("range", "areas that can be reached"),
    ("simulate", "the energy of a speed profile or of a row of links, without a map"),
    ("places", "places by their name, and names of places"),
    ("vehicles", "vehicles that requests can name: bundled and stored ones"),
    ("graphs", "road networks, their charging stations, and their tiles"),
    ("diagnoses", "why recordings differ from the model"),
    ("health", "whether the service is alive and ready, and what it did"),
)
PAGES: Final = ("/docs", "/redoc")
# the bundled pages need inline scripts; nothing may come from another host
PAGE_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data:; worker-src 'self' blob:; font-src 'self' data:; frame-ancestors 'self'"
)
KEY_SCHEMES: Final = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "a key of `joulepath keys add`"},
    "header": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "the same in a header of its own"},
}


class PagePolicy:
    """ASGI middleware that sends the bundled pages with the policy that keeps them offline."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and the policy with the answer to one for a page."""
        if scope["type"] != "http" or scope["path"] not in PAGES:
            await self.app(scope, receive, send)
            return

        async def send_with_policy(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["Content-Security-Policy"] = PAGE_POLICY
            await send(message)

        await self.app(scope, receive, send_with_policy)


def create_app(settings: Settings | None = None, service: Service | None = None) -> FastAPI:
    """The application; graphs are loaded and kernels compiled before it serves, unless a loaded service is given."""
    chosen = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        running = service
        if running is None:
            running = Service(chosen)
            running.load_all()
        admission = Admission(chosen.search_threads, chosen.time_limit_s, chosen.search_queue_limit)
        running_diagnoses = Diagnoses(running)
        app.state.service, app.state.admission, app.state.diagnoses = running, admission, running_diagnoses
        with suppress(NotImplementedError, RuntimeError, ValueError):  # not on this system, or not the main thread
            asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, reload_soon, running)
        app.state.database_probe = probe = DatabaseProbe(running.database)
        try:
            yield
        finally:
            app.state.service = app.state.admission = app.state.diagnoses = app.state.database_probe = None
            probe.close()
            admission.close()
            running_diagnoses.close()
            if service is None:
                running.close()

    app = FastAPIOffline(
        title="joulepath",
        summary="Energy-aware routing for electric vehicles",
        description=DESCRIPTION,
        version=VERSION,
        license_info={"name": "Apache-2.0", "identifier": "Apache-2.0"},
        lifespan=lifespan,
        separate_input_output_schemas=False,
        swagger_ui_parameters={"validatorUrl": "none"},
        generate_unique_id_function=operation_id,
        servers=[{"url": chosen.public_url or "/", "description": "this service"}],
        openapi_tags=[{"name": name, "description": described} for name, described in TAGS],
        telemetry={"logs": False},  # which would hold what was sent; requests and stages are traced
    )
    app.state.metrics = Metrics(app.state)
    for router in ROUTERS:
        app.include_router(router)

    install_faces(app, chosen)
    install_web(app, chosen)

    app.add_middleware(PagePolicy)
    install_error_handlers(app, allowed_methods)
    app.add_middleware(BodyLimit, limit_bytes=chosen.body_limit_bytes, upload_limit_bytes=chosen.diagnosis_limit_bytes)
    app.add_middleware(GZipMiddleware, minimum_size=COMPRESSED_BYTES, compresslevel=COMPRESSION)
    app.add_middleware(Gate, settings=chosen)
    app.add_middleware(CrossOrigin, origins=chosen.cors_origins)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Observed, metrics=app.state.metrics, log_client=chosen.log_client)  # the outermost

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = openapi_document(app, chosen.keys_file is not None)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]  # the documented way to extend the document
    return app


def operation_id(route: APIRoute) -> str:
    """The name of an operation in generated clients, as findRoute: that of its function."""
    first, *further = route.name.split("_")
    return first + "".join(word.capitalize() for word in further)


def reload_soon(service: Service) -> None:
    """Reload graphs on a thread, and log what is wrong with them."""

    def reload() -> None:
        try:
            service.reload_graphs()
        except RoutingError as error:
            LOG.warning("graphs are not reloaded: %s", error)

    Thread(target=reload, name="reload", daemon=True).start()


def described_routes() -> list[APIRoute]:
    """All documented endpoints."""
    return [
        route
        for router in ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute) and route.include_in_schema
    ]


def allowed_methods(path: str) -> set[str]:
    """Methods of the endpoints at an address, for the Allow header of a 405.

    An address that is an endpoint's own, as /reload, is no graph of that name.
    """
    matching = [route for route in described_routes() if route.path_regex.match(path)]
    own = [route for route in matching if route.path == path]
    return {method for route in own or matching for method in route.methods or ()}


def openapi_document(app: FastAPI, keys_demanded: bool = False) -> dict[str, Any]:
    """The OpenAPI document, with problems under their own media type and the schemas that only extensions name."""
    document = get_openapi(
        title=app.title,
        version=app.version,
        summary=app.summary,
        description=app.description,
        license_info=app.license_info,
        servers=app.servers,
        tags=app.openapi_tags,
        routes=app.routes,
        separate_input_output_schemas=False,
    )
    _, extra = models_json_schema(
        [(model, "validation") for model in (RouteFeatureCollection, DiagnosisRequest, *places.SCHEMAS)],
        ref_template="#/components/schemas/{model}",
    )
    schemas = document["components"]["schemas"]
    for name, schema in extra["$defs"].items():
        schemas.setdefault(name, schema)
    for unused in ("HTTPValidationError", "ValidationError"):
        schemas.pop(unused, None)
    describe(schemas)
    for operations in document["paths"].values():
        for operation in operations.values():
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    merged: dict[str, Any] = {}
                    for content in response.pop("content").values():
                        merged |= content
                    response["content"] = {PROBLEM_TYPE: merged}
    for described in described_routes():
        operations = document["paths"][described.path]
        for method in described.methods or ():
            _restore_examples(operations[method.lower()]["responses"], described.responses)
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            codes = gate_codes(method.upper(), path, "requestBody" in operation)
            _add_problems(operation["responses"], problems(path, *codes))
            if keys_demanded and path in HEALTH:
                operation["security"] = []
    if keys_demanded:
        document["components"]["securitySchemes"] = KEY_SCHEMES
        document["security"] = [{name: []} for name in KEY_SCHEMES]
    return document


def _add_problems(responses: dict[str, Any], further: dict[int | str, dict[str, Any]]) -> None:
    """Put problems beside those that an operation has declared itself."""
    for status, added in further.items():
        empty = {"schema": {"$ref": "#/components/schemas/Problem"}, "examples": {}}
        known = responses.setdefault(str(status), {"description": "", "content": {PROBLEM_TYPE: empty}})
        known["description"] = "; ".join(part for part in (known["description"], added["description"]) if part)
        known["content"][PROBLEM_TYPE]["examples"] |= added["content"][PROBLEM_TYPE]["examples"]


def _restore_examples(responses: dict[str, Any], declared: dict[int | str, dict[str, Any]]) -> None:
    """Put the examples in place again as they were declared: the framework drops every null from them."""
    for status, response in declared.items():
        for media_type, content in response.get("content", {}).items():
            for key in ("example", "examples"):
                if key in content:
                    responses[str(status)]["content"][media_type][key] = content[key]
