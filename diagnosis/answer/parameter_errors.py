"""Numbers of the vehicle that its drives contradict."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.findings import LEAST_SHARE_FRAC
from diagnosis.answer.results import ParameterError
from diagnosis.causes.nuisance import PARAMETERS, SENSOR_COLUMNS
from diagnosis.fit.jackknife import additions, equations, first_least, solve
from diagnosis.fit.model import priors
from diagnosis.fit.windows import FINE_WINDOW_S, SENSOR_NAMES, TOTALS_S, is_heightless, measured_size_j
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.causes.nuisance import Parameter
    from diagnosis.fit.jackknife import Equations
    from diagnosis.fit.model import Model


GAINS: Final = ("acceleration_gain", "grade_gain")  # together the same as mass
STEADY_CLIMATE: Final = ("heating_w_per_k", "cooling_w_per_k")
BOUND_FRAC: Final = 1e-4  # of the way between its bounds, so near to one of them a number is at it


BY_HILLS: Final = ("mass_kg", "recuperation_eff")
MOST_FILLED_FRAC: Final = 0.2  # of the drives


def parameter_errors(model: Model) -> tuple[ParameterError, ...]:
    """Parameters that must differ from the file's, found like effects beside everything else that was found."""
    system = _about_nameplate(model)
    beside = list(SENSOR_NAMES)
    beside += [*(name for name in model.solution.names if name not in SENSOR_NAMES and not _is_parameter(name))]
    measured_j = measured_size_j(model.windows)
    open_ = [parameter for parameter in PARAMETERS if _can_be_told(model, parameter)]
    wrong: list[Parameter] = []
    while open_:
        names = [*beside, *(parameter.name for parameter in wrong)]
        added = additions(system, names, [parameter.name for parameter in open_])
        gain = float(solve(system, names).losses.sum()) - added.losses.sum(axis=0)
        share = np.abs(added.coefficients) * [_size_j(model, parameter.name) / measured_j for parameter in open_]
        passes = (np.abs(added.z) >= model.threshold.z) & (share >= LEAST_SHARE_FRAC) & (gain > 0.0)
        if not passes.any():
            break
        wrong.append(open_.pop(int(first_least(np.where(passes, -gain, np.inf)))))
    solution = solve(system, [*beside, *(parameter.name for parameter in wrong)])
    strain = max(1.0, float(np.sqrt(np.mean([(solution.value(name) / _sd_of(name)) ** 2 for name in GAINS]))))
    found = []
    for parameter in wrong:
        weights = np.array([float(name == parameter.name) for name in solution.names])
        shift = solution.value(parameter.name)
        half = float(np.hypot(solution.half_width(weights), strain * solution.half_width_within(system, weights)))
        nameplate = float(getattr(model.nameplate, parameter.name))
        energy_j = shift * sum(float(trip.column(parameter.name).sum()) for trip in model.windows)
        if abs(shift) <= max(half, parameter.sd_of(model.nameplate)) or abs(energy_j) < LEAST_SHARE_FRAC * measured_j:
            continue  # another parameter that came later has taken it over
        at_bound = _at_bound(parameter, model, nameplate + shift)
        others = [
            other.name for other in PARAMETERS if other not in wrong and _alike(system, beside, wrong, parameter, other)
        ]
        found.append(
            ParameterError(
                parameter=parameter.name,
                family=parameter.family,
                unit=parameter.unit,
                nameplate=nameplate,
                fitted=nameplate + shift,
                ci95=(nameplate + shift - half, nameplate + shift + half),
                energy_kwh=energy_j / JOULE_PER_KWH,
                energy_share_frac=energy_j / measured_j,
                aliases=(*parameter.aliases, *others),
                text=f"{parameter.name} is {nameplate:.4g} {parameter.unit} in the vehicle's file; the drives ask for"
                f" {nameplate + shift:.4g} ± {half:.2g}"
                + (", as far from it as a car of this file can be." if at_bound else ".")
                + (f" It may as well be {' or '.join(others)}." if others else ""),
                at_bound=at_bound,
            )
        )
    return tuple(found)


def _can_be_told(model: Model, parameter: Parameter) -> bool:
    """Whether drives tell a number at all.

    The linear part of the road load only bends what A and C make. Of whole drives alone none can be told. Where samples
    are too far apart to see accelerations, or no height was recorded, mass and efficiencies take what is lost between;
    mass and recuperation do so where heights that were filled in err by a percent of grade.
    """
    if parameter.name == "road_load_b_n_per_mps" or model.noise.window_s > TOTALS_S:
        return False
    if parameter.name == "aux_power_w":
        # without a temperature it takes what climate draws, and beside a climate what another threshold of it would
        known = any(trip.ambient_k is not None for trip in model.windows)
        return known and not any(candidate.term.name in STEADY_CLIMATE for candidate in model.found)
    seen = model.noise.window_s <= FINE_WINDOW_S and not is_heightless(model.windows)
    if parameter.name in BY_HILLS:
        filled = sum(trip.recording.elevation_source is not None for trip in model.trips)
        seen = seen and filled <= MOST_FILLED_FRAC * len(model.trips)
    return seen or parameter.name == "road_load_c_n_per_mps2"


def _about_nameplate(model: Model) -> Equations:
    """The equations of what the vehicle's file leaves, its parameters about those of the file."""
    shifts = {parameter.name: _shift(model, parameter) for parameter in PARAMETERS}
    known = priors(model.system.names, model.nameplate, model.nameplate, model.trips[0].drive.battery)
    precision = np.where([_is_parameter(name) for name in model.system.names], 0.0, known.precision)
    known = replace(known, precision=precision)
    moved = []
    for trip in model.windows:
        more_j = sum((shift * trip.column(name) for name, shift in shifts.items()), np.zeros(trip.begin_s.size))
        moved.append(replace(trip, simulated_j=trip.simulated_j - more_j))
    return equations(moved, model.roots, known)


def _at_bound(parameter: Parameter, model: Model, value: float) -> bool:
    low, high = parameter.bounds(model.nameplate)
    return min(value - low, high - value) <= BOUND_FRAC * (high - low)


def _sd_of(name: str) -> float:
    return next(sensor.sd for sensor in SENSOR_COLUMNS if sensor.name == name)


def _shift(model: Model, parameter: Parameter) -> float:
    return float(getattr(model.vehicle, parameter.name)) - float(getattr(model.nameplate, parameter.name))


def _size_j(model: Model, name: str) -> float:
    return sum(abs(float(trip.column(name).sum())) for trip in model.windows)


def _is_parameter(name: str) -> bool:
    return any(parameter.name == name for parameter in PARAMETERS)


def _alike(
    system: Equations, beside: Sequence[str], wrong: Sequence[Parameter], parameter: Parameter, other: Parameter
) -> bool:
    """Whether another parameter in the place of one loses no more on trips left out than chance would."""
    names = [*beside, *(named.name for named in wrong if named is not parameter)]
    worse = (
        additions(system, names, [other.name]).losses[:, 0] - additions(system, names, [parameter.name]).losses[:, 0]
    )
    return bool(worse.sum() <= 2.0 * worse.std(ddof=1) * np.sqrt(worse.size))
