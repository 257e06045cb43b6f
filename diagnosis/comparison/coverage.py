"""How often a recorded drive took an energy in the range that was predicted: replayed quantiles against ∫P dt."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import BytesIO
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.special import ndtr
from scipy.stats import binomtest

from diagnosis.comparison.comparison import NORMAL_QUANTILE
from energy.chain.sampling import RESIDUAL_SD_FRAC, SAMPLES, SEED, residual_fracs, sampled_vehicles
from energy.chain.uncertainty import QUANTILES
from energy.conditions import STILL, Conditions
from energy.replay.replay import SMOOTHING_M, graded, replay
from energy.units import JOULE_PER_KWH
from energy.vehicle.consumption_table import ConsumptionTableVehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

CONFIDENCE_FRAC: Final = 1.0 - 2.0 * float(ndtr(-NORMAL_QUANTILE))  # 95.0004 %, what ± 1.96 SD hold
DPI: Final = 120
FONT_PT: Final = 12
SUMMER: Final = "#d1792b"
WINTER: Final = "#2f6db3"
GREY: Final = "#5c6670"


@dataclass(frozen=True, slots=True)
class TripPrediction:
    """One recorded drive and what its replay predicts.

    energy_p10_j, energy_p50_j, energy_p90_j: not exceeded with a probability of 10, 50 and 90 %. simulated_j: of the
    vehicle as it is. ambient_k: median of the recording, None where it has none. standing_measured_w,
    standing_simulated_w: mean power while the car stands, None where it never does.
    """

    trip_id: str
    distance_m: float
    duration_s: float
    ambient_k: float | None
    measured_j: float
    simulated_j: float
    energy_p10_j: float
    energy_p50_j: float
    energy_p90_j: float
    standing_measured_w: float | None
    standing_simulated_w: float | None

    @property
    def covered(self) -> bool:
        """Whether the measured energy lies in the central interval."""
        return self.energy_p10_j <= self.measured_j <= self.energy_p90_j

    @property
    def error_frac(self) -> float:
        """Error of the median, positive where the prediction is larger [-]."""
        return self.energy_p50_j / self.measured_j - 1.0


@dataclass(frozen=True, slots=True)
class Coverage:
    """How a group of predictions does.

    covered, below, above: trips whose measured energy lies in, below and above the central 80 % interval.
    covered_low_frac, covered_high_frac: Wilson's 95 % interval of the share covered, trips taken as independent.
    bias_frac, sd_frac, mape_frac: mean, standard deviation and mean size of the median's error; sd of one trip is 0.
    half_width_frac: half of the central interval over its median, mean over trips.
    """

    trips: int
    covered: int
    below: int
    above: int
    covered_low_frac: float
    covered_high_frac: float
    bias_frac: float
    sd_frac: float
    mape_frac: float
    half_width_frac: float


def source_model(recording: Recording) -> Conditions:
    """Conditions of the source's model: no effect at all."""
    del recording
    return STILL


def at_terminals(vehicle: Vehicle | ConsumptionTableVehicle) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle without the battery's internal resistance, whose loss ∫V·I at the terminals does not hold."""
    if isinstance(vehicle, ConsumptionTableVehicle):
        return vehicle
    sd = {name: value for name, value in vehicle.sd.items() if name != "effects.battery_resistance_ohm"}
    effects = replace(vehicle.effects, battery_resistance_ohm=0.0)
    return replace(vehicle, effects=effects, sd=MappingProxyType(sd))


def predict(
    vehicle: Vehicle | ConsumptionTableVehicle,
    recordings: Sequence[Recording],
    conditions_of: Callable[[Recording], Conditions],
    *,
    samples: int = SAMPLES,
    seed: int = SEED,
    residual_sd_frac: float = RESIDUAL_SD_FRAC,
    smoothing_m: float = SMOOTHING_M,
) -> tuple[TripPrediction, ...]:
    """Energy of each recorded drive at the battery's terminals, from its speed and elevation alone.

    Each is replayed with the same sampled vehicles and model residuals, E = E_sim + f·D as in energy.chain.uncertainty.
    Raises ConditionsError and VehicleError as energy.chain.sampling.sampled_vehicles does, and as replay does.
    """
    vehicle = at_terminals(vehicle)
    vehicles = sampled_vehicles(vehicle, samples, seed)
    residual = residual_fracs(samples, seed, residual_sd_frac)
    found = []
    for recording in recordings:
        profile, conditions = graded(recording.profile(), smoothing_m), conditions_of(recording)
        plain = driven = replay(vehicle, profile, conditions=conditions)
        energy = np.empty(samples)
        for k, sampled in enumerate(vehicles):
            if sampled is not vehicle:
                driven = replay(sampled, profile, conditions=conditions)
            energy[k] = driven.energy_j + residual[k] * driven.dissipated_j
        p10_j, p50_j, p90_j = np.quantile(energy, QUANTILES).tolist()
        stands = (profile.speed_mps[:-1] == 0.0) & (profile.speed_mps[1:] == 0.0)
        found.append(
            TripPrediction(
                trip_id=recording.id,
                distance_m=recording.distance_m(),
                duration_s=float(recording.time_s[-1] - recording.time_s[0]),
                ambient_k=None if recording.ambient_k is None else float(np.nanmedian(recording.ambient_k)),
                measured_j=recording.energy_j(),
                simulated_j=plain.energy_j,
                energy_p10_j=p10_j,
                energy_p50_j=p50_j,
                energy_p90_j=p90_j,
                standing_measured_w=_mean(recording.power_w[recording.speed_mps == 0.0]),
                standing_simulated_w=_mean(plain.power_w[stands], np.diff(profile.time_s)[stands]),
            )
        )
    return tuple(found)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> float | None:
    return None if values.size == 0 else float(np.average(values, weights=weights))


def coverage(predictions: Sequence[TripPrediction]) -> Coverage:
    """Coverage and errors of a group of predictions; raises ValueError without any."""
    if not predictions:
        raise ValueError("no predictions, allowed: at least one")
    error = np.array([trip.error_frac for trip in predictions])
    half = [0.5 * (trip.energy_p90_j - trip.energy_p10_j) / trip.energy_p50_j for trip in predictions]
    covered = sum(trip.covered for trip in predictions)
    low, high = wilson_interval(covered, len(predictions))
    return Coverage(
        trips=len(predictions),
        covered=covered,
        below=sum(trip.measured_j < trip.energy_p10_j for trip in predictions),
        above=sum(trip.measured_j > trip.energy_p90_j for trip in predictions),
        covered_low_frac=low,
        covered_high_frac=high,
        bias_frac=float(error.mean()),
        sd_frac=float(error.std(ddof=1)) if error.size > 1 else 0.0,
        mape_frac=float(np.abs(error).mean()),
        half_width_frac=float(np.mean(half)),
    )


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a probability from counts (Wilson 1927, DOI 10.1080/01621459.1927.10502953), within 0..1."""
    if not 0 <= successes <= trials or trials == 0:
        raise ValueError(f"successes is {successes} of {trials}, allowed: 0..trials, of at least 1")
    found = binomtest(successes, trials).proportion_ci(CONFIDENCE_FRAC, method="wilson")
    return float(found.low), float(found.high)


def coverage_png(
    models: Sequence[tuple[str, Sequence[TripPrediction]]],
    is_winter: Callable[[TripPrediction], bool],
    width_px: int = 1320,
    height_px: int = 720,
) -> bytes:
    """Measured energy over the predicted one with its interval, one panel a model, as a PNG."""
    figure = Figure(figsize=(width_px / DPI, height_px / DPI), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(models), sharex=True, sharey=True, squeeze=False)[0]
    most = max(max(trip.measured_j, trip.energy_p90_j) for _, trips in models for trip in trips) / JOULE_PER_KWH
    for axes, (title, trips) in zip(panels, models, strict=True):
        axes.plot([0.0, 1.06 * most], [0.0, 1.06 * most], color=GREY, linewidth=1.0, zorder=1)
        for winter, colour, label in ((False, SUMMER, "summer"), (True, WINTER, "winter")):
            group = [trip for trip in trips if is_winter(trip) is winter]
            if not group:
                continue
            middle, measured, low, high = (
                np.array([getattr(trip, name) for trip in group]) / JOULE_PER_KWH
                for name in ("energy_p50_j", "measured_j", "energy_p10_j", "energy_p90_j")
            )
            inside = sum(trip.covered for trip in group)
            axes.errorbar(
                middle,
                measured,
                xerr=np.stack((middle - low, high - middle)),
                fmt="o",
                markersize=5.0,
                color=colour,
                elinewidth=1.4,
                alpha=0.85,
                label=f"{label}: {inside} of {len(group)} intervals reach the line",
                zorder=2,
            )
        axes.set_title(title, fontsize=FONT_PT + 1)
        axes.set_xlabel("predicted energy, median and central 80 % [kWh]", fontsize=FONT_PT)
        axes.set_xlim(0.0, 1.06 * most)
        axes.set_ylim(0.0, 1.06 * most)
        axes.set_aspect("equal")
        axes.grid(color="#e3e6e8", linewidth=0.8, zorder=0)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=FONT_PT)
        axes.legend(loc="upper left", fontsize=FONT_PT - 1, frameon=False)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    panels[0].set_ylabel("measured energy [kWh]", fontsize=FONT_PT)
    file = BytesIO()
    figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})
    return file.getvalue()
