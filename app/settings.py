"""Settings of the service, from environment variables that start with JOULEPATH_."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from app.access.addresses import networks
from app.schemas.base import refusal
from app.schemas.place import MAX_PLACES
from energy.folders import bundled_folder, user_folder, user_graphs_folder
from routing.cache_budget import DEFAULT_BYTES

BUNDLED_DATA = bundled_folder("data")
STYLE_FORMS = "https://HOST/PATH, http://HOST/PATH or /PATH on this host"
ORIGIN_FORMS = "https://HOST, http://HOST or either with :PORT, separated by commas"
_ORIGIN_FORM = re.compile(r"https?://[A-Za-z0-9.*-]+(:[0-9]+)?\Z|https?://\[[0-9a-fA-F:]+\](:[0-9]+)?\Z")
_STYLE_FORM = re.compile(r"(https?://[A-Za-z0-9.-]+(:[0-9]+)?)?/[!-~]*\Z")
ADDRESS_FORMS = "https://HOST/PATH or http://HOST/PATH, without a query"
_ADDRESS_FORM = re.compile(r"https?://[A-Za-z0-9.-]+(:[0-9]+)?(/[A-Za-z0-9._~/%-]*)?\Z")
HOST_FORMS = "names such as energy.example.org, *.example.org, 192.0.2.7 or [2001:db8::7], without a port"
NETWORK_FORMS = "addresses or networks such as 10.0.0.7 or 10.0.0.0/8, separated by commas; * for all"
_HOST_FORM = re.compile(r"(\*\.)?[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*\.?\Z|\[[0-9a-fA-F:.]+\]\Z")
DATABASE_FILE = "vehicles.sqlite"
MOST_WORKERS = 256
FaceName = Literal["osrm", "ors", "valhalla"]
DATABASE_FORMS = "sqlite:///PATH or postgresql://USER:PASSWORD@HOST/NAME"


def default_database_url() -> str:
    """An SQLite file in the user's data folder; one that an older joulepath has left in ~/.local/share stays in use."""
    file = user_folder() / DATABASE_FILE
    older = Path(os.path.expanduser("~/.local/share/joulepath")) / DATABASE_FILE
    named = os.path.isabs(os.environ.get("XDG_DATA_HOME", ""))
    return f"sqlite:///{older if not named and older.is_file() and not file.exists() else file}"


def default_graph_dirs() -> tuple[Path, ...]:
    """The user's own graphs, then those that come with joulepath."""
    return user_graphs_folder(), BUNDLED_DATA / "graphs"


class Settings(BaseSettings):
    """What can be set from outside; lists of folders are separated as in PATH, lists of origins by commas."""

    model_config = SettingsConfigDict(env_prefix="JOULEPATH_", extra="ignore", frozen=True)

    host: str = Field(default="127.0.0.1", description="address that the server listens on")
    port: int = Field(default=8000, ge=0, le=65535, description="port that the server listens on")
    workers: int = Field(default=1, ge=1, le=MOST_WORKERS, description="processes that serve as one")
    graph_dirs: Annotated[tuple[Path, ...], NoDecode] = Field(
        default_factory=default_graph_dirs,
        description="folders with one graph in each subfolder; the first of a name wins",
    )
    vehicle_dir: Path = Field(default=BUNDLED_DATA / "vehicles", description="folder with one TOML file a vehicle")
    database_url: str = Field(
        default_factory=default_database_url, repr=False, description=f"database of stored vehicles: {DATABASE_FORMS}"
    )
    database_create: bool = Field(
        default=True, description="whether a database that is missing or empty is made; false where it has to be there"
    )
    default_graph: str = Field(
        default="highlands", description="graph of requests without places that name none, and of graphs of one size"
    )
    default_vehicle: str = Field(default="hyundai-kona-64", description="vehicle of range requests and inline defaults")
    snap_limit_m: float = Field(
        default=1000.0, gt=0, le=50_000, description="farthest road that a point is moved to [m]"
    )
    label_limit: int | None = Field(
        default=None, ge=1, description="most labels that one search may make; by default in proportion to the graph"
    )
    cache_limit_bytes: int = Field(
        default=DEFAULT_BYTES,
        ge=0,
        description="most memory of what is kept between requests: graphs as vehicles see them, known drives [B]",
    )
    matrix_limit_places: int = Field(
        default=100, ge=1, le=MAX_PLACES, description="most sources, and most targets, of one matrix"
    )
    faces: Annotated[tuple[FaceName, ...], NoDecode] = Field(
        default=get_args(FaceName),
        description="other engines that are spoken too, separated by commas: osrm, ors, valhalla; empty for none",
    )
    faces_soc: float = Field(
        default=0.8, ge=0, le=1, description="state of charge at departure of requests to faces that name none"
    )
    body_limit_bytes: int = Field(default=4 * 1024 * 1024, ge=1024, description="largest request body [B]")
    recordings_dir: Path | None = Field(
        default=None, description="folder whose recordings diagnoses may name; without it, they are uploaded"
    )
    diagnosis_limit_bytes: int = Field(
        default=256 * 1024 * 1024, ge=1024, description="largest sum of the recordings of one diagnosis [B]"
    )
    diagnosis_limit_files: int = Field(default=1000, ge=1, le=10_000, description="most recordings of one diagnosis")
    diagnosis_queue_limit: int = Field(default=8, ge=1, description="most diagnoses that are queued or running")
    diagnosis_upload_limit: int = Field(
        default=8, ge=1, description="most uploads that arrive at a time, of which half may be of one client"
    )
    diagnosis_unpacked_bytes: int = Field(
        default=1024 * 1024 * 1024, ge=1024, description="most that the recordings of one diagnosis unpack to [B]"
    )
    diagnosis_memory_bytes: int = Field(
        default=4 * 1024 * 1024 * 1024,
        ge=64 * 1024 * 1024,
        description="most memory of one diagnosis, beyond that of program and graph [B]",
    )
    diagnosis_time_limit_s: float = Field(default=3600.0, gt=0, description="longest run of one diagnosis [s]")
    time_limit_s: float = Field(default=30.0, gt=0, description="longest wait for an answer [s]")
    search_threads: int = Field(
        default=max(os.cpu_count() or 1, 1), ge=1, description="searches that run at the same time"
    )
    search_queue_limit: int = Field(
        default=256, ge=1, le=100_000, description="most searches that wait for a thread; more are refused"
    )
    log_format: Literal["text", "json"] = Field(default="text", description="a line of the log as text or as JSON")
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="least of what is logged; requests are logged as info"
    )
    log_client: bool = Field(default=False, description="whether the client's address stands in the log of requests")
    keys_file: Path | None = Field(
        default=None, description="file of API keys, made by `joulepath keys add`; with it, requests need a key"
    )
    open_without_keys: bool = Field(
        default=False, description="listen on other addresses than this machine's own without demanding keys"
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="names that the service is called by, *.example.org for all below; empty for any"
    )
    trusted_proxies: Annotated[tuple[str, ...], NoDecode] = Field(
        default=("127.0.0.1", "::1"),
        description="addresses and networks of proxies, whose X-Forwarded-For names the client; * for all",
    )
    rate_limit_per_s: float = Field(
        default=50.0, ge=0, description="units a second that a key, or an address without one, may ask for; 0 for any"
    )
    rate_burst: int = Field(default=500, ge=1, description="units that may be asked for at once")
    daily_quota: int = Field(default=0, ge=0, description="units a day of a key, or an address; 0 for any")
    connection_limit: int = Field(default=1000, ge=1, le=100_000, description="most connections at a time")
    address_connection_limit: int = Field(
        default=200, ge=1, description="most connections of one address, but for proxies and this machine"
    )
    head_limit_s: float = Field(default=10.0, gt=0, description="longest wait for the whole head of a request [s]")
    body_wait_s: float = Field(
        default=20.0, gt=0, description="longest wait for a body, or until an answer is read, besides its own time [s]"
    )
    least_bytes_per_s: float = Field(
        default=2000.0, gt=0, description="slowest that bodies may arrive and answers be read [B/s]"
    )
    keep_alive_s: float = Field(default=5.0, gt=0, description="how long a connection waits for its next request [s]")
    stop_limit_s: float = Field(
        default=20.0, gt=0, description="longest from being told to stop to the end; half of it for requests [s]"
    )
    log_limit_per_s: float = Field(default=500.0, gt=0, description="most lines of the access log a second")
    cors_origins: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="web origins that may call the service from a browser; * for all"
    )
    public_url: str | None = Field(
        default=None,
        description="address of the service as its clients reach it, in answers that name whole addresses; without it, "
        "that of the request",
    )
    map_style_url: str | None = Field(
        default=None,
        description="MapLibre style of the web map's ground; without it, the graph's own roads and heights",
    )
    map_origins: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="origins that the style draws from, besides its own"
    )

    @field_validator("database_url")
    @classmethod
    def _known_database(cls, value: str) -> str:
        from app.store.database import driver_url  # takes a while to import

        try:
            driver_url(value)
        except ValueError as error:  # the value may hold a password
            raise refusal("", str(error), DATABASE_FORMS) from error
        return value

    @field_validator("log_format", "log_level", mode="before")
    @classmethod
    def _in_any_case(cls, value: object) -> object:
        return value.lower() if isinstance(value, str) else value

    @field_validator("recordings_dir", "keys_file", mode="before")
    @classmethod
    def _no_folder_where_empty(cls, value: object) -> object:
        return None if value == "" else value  # which would be the working directory

    @field_validator("map_style_url")
    @classmethod
    def _reachable_style(cls, value: str | None) -> str | None:
        if not value:
            return None
        if not _STYLE_FORM.match(value):
            raise refusal("", value, STYLE_FORMS)
        return value

    @field_validator("public_url")
    @classmethod
    def _whole_address(cls, value: str | None) -> str | None:
        if not value:
            return None
        if not _ADDRESS_FORM.match(value):
            raise refusal("", value, ADDRESS_FORMS)
        return value.rstrip("/")

    @field_validator("map_origins")
    @classmethod
    def _whole_origins(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for origin in value:
            if not _ORIGIN_FORM.match(origin):
                raise refusal("", origin, ORIGIN_FORMS)
        return value

    @field_validator("trusted_proxies")
    @classmethod
    def _known_networks(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for text in value:
            try:
                networks([text])
            except ValueError as error:
                raise refusal("", text, NETWORK_FORMS) from error
        return value

    @field_validator("allowed_hosts")
    @classmethod
    def _host_names(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if not _HOST_FORM.match(name):
                raise refusal("", name, HOST_FORMS)
        return tuple(name.lower() for name in value)

    @field_validator("graph_dirs", mode="before")
    @classmethod
    def _split_paths(cls, value: object) -> object:
        return tuple(Path(part) for part in value.split(os.pathsep) if part) if isinstance(value, str) else value

    @field_validator("cors_origins", "map_origins", "allowed_hosts", "trusted_proxies", "faces", mode="before")
    @classmethod
    def _split_origins(cls, value: object) -> object:
        return tuple(part.strip() for part in value.split(",") if part.strip()) if isinstance(value, str) else value
