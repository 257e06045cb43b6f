"""Diagnoses: what is asked, how far each is, and what it says."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from app.schemas.base import Answered, Count, Number, Sent
from app.schemas.place import LineString
from app.schemas.problem import Problem
from app.schemas.vehicles.vehicle import VehicleChoice
from app.store.diagnoses import DiagnosisState
from diagnosis.answer.results import Verdict
from diagnosis.holdout import MOST_FRAC

MAX_PATTERNS: Final = 1000
MAX_RECORDINGS: Final = 10_000
Pattern = Annotated[str, Field(min_length=1, max_length=200)]
RecordingPath = Annotated[str, Field(min_length=1, max_length=1000)]


class DiagnosisOptions(Sent):
    """How recordings are to be diagnosed; unknown fields are errors."""

    vehicle: VehicleChoice | None = Field(
        default=None, description="the vehicle that was driven, given by its physics; without it, the default vehicle"
    )
    hide: list[Pattern] = Field(
        default=[],
        max_length=MAX_PATTERNS,
        description="columns that are dropped while reading, by name or pattern such as `*Heat*`, letter case aside",
    )
    holdout: list[Pattern] = Field(
        default=[],
        max_length=MAX_PATTERNS,
        description="trips kept out of the fit, by id or pattern; a trip's id is its file's name without the ending",
    )
    holdout_fraction: Number = Field(
        default=0.0, ge=0, le=MOST_FRAC, description="share of all trips that is drawn to be kept out as well"
    )
    seed: Count = Field(default=1, ge=0, le=2**31 - 1, description="the same seed draws the same")
    graph: str | None = Field(
        default=None,
        max_length=200,
        description="name of a graph to which recordings with positions are matched, and from which those without"
        " height get it; without it, to none",
    )


class DiagnosisRequest(DiagnosisOptions):
    """A diagnosis of recordings that lie on the server."""

    recordings: list[RecordingPath] = Field(
        min_length=1,
        max_length=MAX_RECORDINGS,
        description="files, folders or patterns below the configured folder of recordings",
    )


class RefusedRecording(Answered):
    """A file that could not be used."""

    file: str
    error: str = Field(description="what is wrong, where in the file, and what is allowed")


class DiagnosisLinks(Answered):
    """Paths of what belongs to a diagnosis."""

    self: str
    report: str | None = Field(description="HTML page; null until it is done")
    effects: str | None = Field(description="effects.json; null until it is done")
    residuals: str | None = Field(description="GeoJSON of where it differs from measurement; null until it is done")
    trips: str | None = Field(description="its trips, each with a path to it along time; null until it is done")


class DiagnosisSummary(Answered):
    """How far a diagnosis is."""

    id: str = Field(description="once it is done, also the id of its `effects` in requests")
    state: DiagnosisState
    stage: str = Field(description="what is being done; empty unless it runs")
    progress: float = Field(description="share of the work that is done, 0..1")
    vehicle: str = Field(description="id of the vehicle, `inline` for one that was sent")
    created: datetime
    recordings: int | None = Field(description="number of files; null for one that was queued before this was kept")
    verdict: Verdict | None = Field(description="what the drives say as a whole; null until it is done")
    text: str | None = Field(description="the first thing that was concluded, in words; null until it is done")
    links: DiagnosisLinks


class DiagnosisAnswer(DiagnosisSummary):
    """A diagnosis with what it says."""

    request: DiagnosisRequest = Field(description="as understood; of uploaded recordings, the names of the files")
    refused: list[RefusedRecording] = Field(description="files that could not be used and were left aside")
    warnings: list[str] = Field(description="trips that are not on the graph that was asked for, each with the reason")
    problem: Problem | None = Field(description="why it failed; null unless it did")
    result: dict[str, Any] | None = Field(description="the object of diagnosis.json; null until it is done")


class DiagnosisList(Answered):
    """All diagnoses, the latest first."""

    diagnoses: list[DiagnosisSummary]


class TripLinks(Answered):
    """Paths of what belongs to a trip."""

    self: str = Field(description="the trip along time")


class TripOutline(Answered):
    """One trip of a diagnosis; its energies are in `result.trips`."""

    id: str
    held_out: bool = Field(description="whether it was kept out of the fit")
    points: int = Field(description="length of its arrays")
    duration_s: float = Field(description="of what was compared, without gaps of the recording [s]")
    bbox: tuple[float, float, float, float] | None = Field(
        description="west, south, east, north of its positions [deg]; null where none were recorded"
    )
    links: TripLinks


class TripList(Answered):
    """The trips of a diagnosis, in the order of `result.trips`."""

    trips: list[TripOutline]


class TripTimelineAnswer(Answered):
    """One trip along time, at most 600 points; all arrays are of one length, powers and speeds are means."""

    id: str
    held_out: bool
    t_s: list[float] = Field(description="where each point begins, since the recording's first sample [s]")
    duration_s: list[float] = Field(description="how long each lasts, without gaps of the recording [s]")
    speed_kmh: list[float]
    measured_w: list[float] = Field(description="power from the battery, as recorded [W]")
    before_w: list[float] = Field(description="by the model with its own numbers refitted, without findings [W]")
    after_w: list[float] = Field(description="by the model with findings, the trip's own power not used [W]")
    lat: list[float | None] | None = Field(
        description="latitude in the middle of each point [deg], null where it is not known; null without positions"
    )
    lon: list[float | None] | None = Field(description="longitude, likewise [deg]")


class ResidualProperties(Answered):
    """What was measured less the model with all findings at one place, with names of simplestyle for drawing it."""

    mean_w: float = Field(description="above 0 where more was measured than modelled [W]")
    ci95: tuple[float, float] | None = Field(description="95 % interval of mean_w [W]; null for a single trip")
    wh_per_km: float | None = Field(description="null where nothing moved")
    wh_per_km_ci95: tuple[float, float] | None
    energy_wh: float = Field(description="over all passes [Wh]")
    trips: int
    passes: int
    stroke: str = Field(pattern="^#[0-9a-f]{6}$", description="from blue (less than modelled) to red (more)")
    stroke_opacity: float = Field(alias="stroke-opacity", description="lower where the interval has 0 in it")
    stroke_width: float = Field(alias="stroke-width")


class LinkResidualProperties(ResidualProperties):
    """Residual of a link of the graph, over all trips that passed it."""

    link: int = Field(description="id of the directed link")
    name: str = Field(description="name of its road")


class TrackResidualProperties(ResidualProperties):
    """Residual of a stretch of one recorded track, about 250 m long."""

    trip: str
    t_s: float = Field(description="where the stretch begins, since the recording's first sample [s]")
    duration_s: float = Field(description="how long it lasts, without gaps of the recording [s]")


class ResidualFeature(Answered):
    """GeoJSON Feature of one link, or of one stretch of a track."""

    type: Literal["Feature"] = "Feature"
    geometry: LineString
    properties: LinkResidualProperties | TrackResidualProperties


class ResidualCollection(Answered):
    """Residuals as GeoJSON: on links where recordings were matched to a graph, else along their tracks."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    kind: Literal["links", "tracks"]
    graph: str | None = Field(description="name of the graph whose links they are; null for tracks")
    features: list[ResidualFeature] = Field(description="none where no recording has positions")
