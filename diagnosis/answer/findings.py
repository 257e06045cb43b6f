"""A fitted model as findings, parameter errors and unexplained structure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.regimes import regimes
from diagnosis.answer.results import Coefficient, Finding, Rival, Unexplained
from diagnosis.answer.separation import sentence, separating
from diagnosis.causes.families import Family
from diagnosis.causes.library import candidates
from diagnosis.fit.axes import AXES, Axis
from diagnosis.fit.jackknife import FORM_SD_FRAC, additions, solve
from diagnosis.fit.levels import CLEAR_Z, levels, loads, trip_wind
from diagnosis.fit.model import BOX
from diagnosis.fit.scan import CELL_M, DRAWS, cell_centre_deg
from diagnosis.fit.selection import RIVAL_LOSS_FRAC
from diagnosis.fit.standstill import at_standstill
from diagnosis.fit.windows import FINE_WINDOW_S, TOTALS_S, is_heightless, measured_size_j
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.causes.terms import Candidate
    from diagnosis.fit.levels import Level, TripWind
    from diagnosis.fit.model import Model
    from diagnosis.fit.scan import Structure

MOST_REGIMES: Final = 4
LEAST_SHARE_FRAC: Final = 0.01
NEED_ACCELERATIONS: Final = (Family.RECUPERATION, Family.DRIVETRAIN, Family.BATTERY, Family.MASS)
LIKE_HILLS: Final = (Family.WIND, Family.MASS, Family.RECUPERATION, Family.DRIVETRAIN)
# standard deviation of an effect's energy by its real form being another than the library's, by family: measured on
# made worlds of a seed that no page tells of
FORM_SD_FRACS: Final = {
    Family.AERODYNAMIC: 0.1,
    Family.ROLLING: 0.42,
    Family.DRIVETRAIN: 0.32,
    Family.WIND: 0.3,
    Family.RECUPERATION: 0.17,
    Family.MASS: 0.15,
    Family.BATTERY: 0.1,
}
BEND: Final = "load_curvature"
LEAST_BEND: Final = 2.5  # percent of efficiency at 20 kW, that usual drives do not reach (1.9 in 99 % of made ones)
BEND_SD: Final = 5.0
STANDING_FAMILIES: Final = (Family.THERMAL, Family.AUXILIARY)
SEEN_STANDING: Final = 0.75  # of heat, that standstill must show, or part of it moves with the car
# times the half width of an interval by jackknife and form, by family: about what 95 % of true energies in 194 claims
# of made worlds of retired seeds lay within (split conformal); of tyres, the temperature they refer to differs anyway
WIDER: Final = {
    Family.RECUPERATION: 0.9,
    Family.MASS: 1.2,
    Family.DRIVETRAIN: 1.3,
    Family.WIND: 1.5,
}
SHOWN_AXES: Final = (Axis.AMBIENT, Axis.SINCE_START, Axis.SPEED, Axis.STANDSTILL, Axis.POWER, Axis.SOC)


def findings(model: Model) -> tuple[Finding, ...]:
    """Effects that were found, terms of one effect together, the largest first; and levels of single trips."""
    effects: dict[str, list[Candidate]] = {}
    for candidate in model.found:
        effects.setdefault(candidate.term.effect, []).append(candidate)
    found = []
    for effect, terms in effects.items():
        beside = [
            candidate
            for candidate in model.companions
            if candidate.term.effect == effect and candidate.label in model.solution.names
        ]
        finding = _finding(model, effect, terms, beside)
        if not _can_be_told(model, finding.family):
            continue
        low_kwh, high_kwh = finding.energy_kwh_ci95 or (0.0, 0.0)
        if low_kwh > 0.0 or high_kwh < 0.0 or any(candidate.term.oscillates for candidate in terms):
            found.append(finding)
    bend = _power_loss(model) if _can_be_told(model, Family.DRIVETRAIN) else None
    if bend is not None:
        found.append(bend)
    wind = trip_wind(model) if _can_be_told(model, Family.WIND) else None
    level = levels(model)
    if wind is not None and level is not None:  # either may stand in for the other
        if level.z >= CLEAR_Z or trip_wind(model, level) is None:
            wind = None
        else:
            level = None
    if wind is not None:
        found.append(_wind_finding(model, wind))
    if level is not None:
        found.append(_level_finding(level))
    return tuple(sorted(found, key=lambda finding: -finding.energy_share_frac))


def _power_loss(model: Model) -> Finding | None:
    """Losses that grow with power faster than efficiencies let them, by how those bend; None where they bend as usual.

    A battery's resistance and a drive's losses look alike in it, and are told apart by voltage alone.
    """
    families = {candidate.term.family for candidate in model.found}
    if BEND not in model.solution.names or families & {Family.DRIVETRAIN, Family.BATTERY, Family.MASS}:
        return None
    k = model.solution.names.index(BEND)
    value, sd = float(model.solution.coefficients[k]), float(model.solution.sd()[k])
    energy_j = value * sum(float(trip.column(BEND).sum()) for trip in model.windows)
    share = energy_j / measured_size_j(model.windows)
    if value < LEAST_BEND or value < BEND_SD * sd or share < LEAST_SHARE_FRAC or loads(model) is not None:
        return None
    battery = model.trips[0].drive.battery
    rivals = [Rival("battery_resistance", Family.BATTERY)] if battery is None or battery.share is None else []
    rivals += _instead_of_bend(model)
    half_j = 1.96 * float(np.hypot(sd / value, FORM_SD_FRACS[Family.DRIVETRAIN])) * energy_j
    text = f"{sentence('power_loss')} took {energy_j / JOULE_PER_KWH:.2f} kWh, {share:.1%} of all."
    recording = None
    if rivals:
        text += f" It cannot be told from {' or '.join(sentence(rival.effect).lower() for rival in rivals)}."
        recording = f"A recording with {separating(Family.DRIVETRAIN, rivals[0].family)}."
    if rivals and rivals[0].family is Family.BATTERY:
        recording = "A recording with voltage and current beside the power."
    return Finding(
        effect="power_loss",
        family=Family.DRIVETRAIN,
        text=text,
        coefficients=(Coefficient("efficiency_loss_at_20_kw", "%", value, (value - 1.96 * sd, value + 1.96 * sd)),),
        energy_kwh=energy_j / JOULE_PER_KWH,
        energy_kwh_ci95=_interval_kwh(Family.DRIVETRAIN, energy_j, half_j),
        energy_share_frac=share,
        t=value / sd,
        ambiguous_with=tuple(rivals),
        separating_recording=recording,
    )


def _instead_of_bend(model: Model) -> list[Rival]:
    """Effects of the library that gain half as much on left-out trips in the place of an efficiency that bends."""
    beside = [name for name in model.solution.names if name != BEND and name in model.system.names]
    tried = [
        candidate
        for candidate in candidates([trip.drive for trip in model.trips])
        if candidate.label in model.system.names and candidate.label not in beside
    ]
    if not tried:
        return []
    none = float(solve(model.system, beside).losses.sum())
    gain = none - float(additions(model.system, beside, [BEND]).losses.sum())
    added = additions(model.system, beside, [candidate.label for candidate in tried])
    gains = none - added.losses.sum(axis=0)
    found: dict[str, Rival] = {}
    for k in np.argsort(-gains, kind="stable").tolist():
        term = tried[k].term
        if gains[k] >= RIVAL_LOSS_FRAC * gain > 0.0 and 0.0 < added.coefficients[k] <= term.most:
            found.setdefault(term.effect, Rival(term.effect, term.family))
    return list(found.values())


def _can_be_told(model: Model, family: Family) -> bool:
    """Whether these drives can tell a family at all: not what needs accelerations where they are not seen.

    Without height, what goes with the way, such as wind by heading, may be hills.
    """
    if model.noise.window_s > TOTALS_S and family not in (Family.THERMAL, Family.AUXILIARY):
        return False
    if model.noise.window_s > FINE_WINDOW_S and family in NEED_ACCELERATIONS:
        return False
    return not (is_heightless(model.windows) and family in LIKE_HILLS)


def unexplained(model: Model) -> tuple[Unexplained, ...]:
    """Structures that no effect explains, the largest first."""
    each = [
        _unexplained(model, structure, model.solution.value(f"{BOX}{k}"), k)
        for k, structure in enumerate(model.structures)
    ]
    found = [one for one in each if one.ci95_w is None or one.ci95_w[0] > 0.0 or one.ci95_w[1] < 0.0]
    return tuple(sorted(found, key=lambda structure: -abs(structure.energy_kwh)))


def _finding(model: Model, effect: str, terms: Sequence[Candidate], beside: Sequence[Candidate]) -> Finding:
    labels = {candidate.label for candidate in (*terms, *beside)}
    sums = np.array(
        [
            sum(float(trip.column(name).sum()) for trip in model.windows) if name in labels else 0.0
            for name in model.solution.names
        ]
    )
    energy_j = float(sums @ model.solution.coefficients)
    half_j = model.solution.half_width(sums, FORM_SD_FRACS.get(terms[0].term.family, FORM_SD_FRAC))
    measured_j = measured_size_j(model.windows)
    by_trip = [float((_own_w(model, k, labels) * trip.duration_s).sum()) for k, trip in enumerate(model.windows)]
    moved_j = float(np.abs(by_trip).sum())
    rivals = (
        {rival.term.effect: rival.term.family for candidate in terms for rival in model.rivals[candidate.label]}
        if all(model.rivals[candidate.label] for candidate in terms)
        else {}
    )
    family = terms[0].term.family
    rivals |= model.stability.instead(family)
    # sums have no standstill, which is what tells heat from tyres
    if model.noise.window_s > TOTALS_S and family is Family.THERMAL:
        rivals |= {"rolling_temperature": Family.ROLLING}
    standing = at_standstill(model, labels) if family is Family.THERMAL else None
    if standing is not None and standing.high < SEEN_STANDING:
        rivals |= {"rolling_temperature": Family.ROLLING}
    elif standing is not None and standing.low > SEEN_STANDING:  # nothing that moves the car is there at standstill
        rivals = {effect: other for effect, other in rivals.items() if other in STANDING_FAMILIES}
    first = next(iter(rivals.values()), None)
    share = moved_j / measured_j
    text = (
        f"{sentence(effect)} took {energy_j / JOULE_PER_KWH:.2f} kWh in {len(model.windows)} drives,"
        f" {energy_j / measured_j:.1%} of all."
    )
    if standing is not None:
        ratio, low, high = (max(value, 0.0) for value in (standing.ratio, standing.low, standing.high))
        text += f" Standstill shows {ratio:.0%} of it ({low:.0%} to {high:.0%})."
    if rivals:
        text += f" It cannot be told from {' or '.join(sentence(name).lower() for name in rivals)}."
    return Finding(
        effect=effect,
        family=family,
        text=text,
        coefficients=tuple(_coefficients(model, [*terms, *beside])),
        energy_kwh=energy_j / JOULE_PER_KWH,
        energy_kwh_ci95=_interval_kwh(family, energy_j, half_j),
        energy_share_frac=share,
        t=max((model.z[candidate.label] for candidate in terms), key=abs),
        located=_located(model, labels),
        ambiguous_with=tuple(Rival(name, other) for name, other in rivals.items()),
        separating_recording=None if first is None else f"A recording with {separating(family, first)}.",
        standing_ratio=None if standing is None else standing.ratio,
        standing_ratio_ci95=None if standing is None else (standing.low, standing.high),
    )


def _interval_kwh(family: Family, energy_j: float, half_j: float) -> tuple[float, float]:
    """95 % interval of an energy [kWh], by half of what jackknife and form make of it [J]."""
    half_j *= WIDER.get(family, 1.0)
    return (energy_j - half_j) / JOULE_PER_KWH, (energy_j + half_j) / JOULE_PER_KWH


def _coefficients(model: Model, terms: Sequence[Candidate]) -> list[Coefficient]:
    found = []
    for candidate in terms:
        weights = np.array([float(name == candidate.label) for name in model.solution.names])
        value, half = model.solution.value(candidate.label), model.solution.half_width(weights)
        found.append(Coefficient(candidate.term.name, candidate.term.unit, value, (value - half, value + half)))
        if candidate.term.shape is not None:
            shape = candidate.term.shape
            name = f"{candidate.term.name.rsplit('_w', 1)[0].removesuffix('_frac')}_{shape.name}"
            found.append(Coefficient(name, shape.unit, candidate.shape, model.shape_ci95.get(candidate.label)))
    return found


def _own_w(model: Model, k: int, labels: set[str]) -> NDArray[np.float64]:
    """Power that some terms add in the windows of a fitted trip, float64 (n,) [W]."""
    trip = model.windows[k]
    total = sum((model.solution.value(label) * trip.column(label) for label in labels), np.zeros(trip.begin_s.size))
    return np.asarray(total / trip.duration_s, np.float64)


def _located(model: Model, labels: set[str]) -> tuple[RegimeResidual, ...]:
    """Regimes in which the residual without some terms departs, those in which the terms took most energy."""
    residuals_w = [model.residual_w(k) + _own_w(model, k, labels) for k in range(len(model.windows))]
    own = [_own_w(model, k, labels) for k in range(len(model.windows))]
    found = []
    for axis in SHOWN_AXES:
        known = zip(regimes(model.windows, axis, residuals_w), regimes(model.windows, axis, own), strict=True)
        departing = [(abs(own_regime.energy_kwh), regime) for regime, own_regime in known if regime.departs]
        if departing:
            found.append(max(departing, key=lambda pair: pair[0]))
    return tuple(regime for _, regime in sorted(found, key=lambda pair: -pair[0])[:MOST_REGIMES])


def _level_finding(level: Level) -> Finding:
    size, half = level.size, level.half
    half_kwh = abs(half / size * level.energy_j) / JOULE_PER_KWH
    energy_kwh = level.energy_j / JOULE_PER_KWH
    shown = f"{size:+.0%}" if level.kind.unit == "1" else f"{size:+.3g} {level.kind.unit}"
    which = f"on {len(level.trips)} trips"
    if level.since is not None:
        which = level.since if level.drifts else f"on all {len(level.trips)} trips {level.since}"
    text = f"{sentence(level.kind.effect)}: {shown} {which}, {energy_kwh:.2f} kWh."
    rivals = tuple(Rival(rival.effect, rival.family) for rival in level.rivals)
    recording = None
    if rivals:
        text += f" It cannot be told from {' or '.join(sentence(rival.effect).lower() for rival in rivals)}."
        recording = f"A recording, loaded in the same way, with {separating(level.kind.family, rivals[0].family)}."
    name = "mean_rise_frac" if level.kind.unit == "1" else "mean_rise"
    return Finding(
        effect=level.kind.effect,
        family=level.kind.family,
        text=text,
        coefficients=(Coefficient(name, level.kind.unit, size, (size - half, size + half)),),
        energy_kwh=energy_kwh,
        energy_kwh_ci95=_interval_kwh(level.kind.family, level.energy_j, JOULE_PER_KWH * half_kwh),
        energy_share_frac=level.share_frac,
        t=level.z,
        trips=level.trips,
        ambiguous_with=rivals,
        separating_recording=recording,
    )


def _wind_finding(model: Model, wind: TripWind) -> Finding:
    energy_kwh = wind.energy_j / JOULE_PER_KWH
    spread = 1.96 * FORM_SD_FRAC * wind.mean_mps
    half_kwh = 1.96 * FORM_SD_FRAC * wind.share_frac * measured_size_j(model.windows) / JOULE_PER_KWH
    return Finding(
        effect="steady_wind",
        family=Family.WIND,
        text=f"{sentence('steady_wind')}, other on each trip, of {wind.mean_mps:.1f} m/s at the vehicle's height moved"
        f" {wind.share_frac:.1%} of the energy.",
        coefficients=(
            Coefficient("wind_speed_mps", "m/s", wind.mean_mps, (wind.mean_mps - spread, wind.mean_mps + spread)),
        ),
        energy_kwh=energy_kwh,
        energy_kwh_ci95=_interval_kwh(Family.WIND, wind.energy_j, JOULE_PER_KWH * half_kwh),
        energy_share_frac=wind.share_frac,
        t=wind.ratio,
        trips=tuple(trip.trip_id for trip in model.windows),
    )


def _unexplained(model: Model, structure: Structure, mean_w: float, k: int) -> Unexplained:
    weights = np.array([float(name == f"{BOX}{k}") for name in model.solution.names])
    half_w = model.solution.half_width(weights)
    hours = sum(
        float((inside * trip.duration_s).sum()) for inside, trip in zip(structure.inside, model.windows, strict=True)
    )
    energy_kwh = mean_w * hours / JOULE_PER_KWH
    box = structure.box
    axis = AXES[box.axis]
    where = f"at {axis.name.replace('_', ' ')} {box.low:.4g} to {box.high:.4g} {axis.unit}"
    if box.axis is Axis.PLACE:
        latitude, longitude = cell_centre_deg(int(box.low))
        where = f"within some {(box.high + 0.5) * CELL_M:.0f} m of {latitude:.4f}, {longitude:.4f}"
    return Unexplained(
        axis=axis.name,
        unit=axis.unit,
        low=box.low,
        high=box.high,
        mean_w=mean_w,
        ci95_w=(mean_w - half_w, mean_w + half_w),
        energy_kwh=energy_kwh,
        p=max(structure.p, 1.0 / DRAWS),
        trips=structure.trips,
        text=f"{mean_w:+.0f} ± {half_w:.0f} W {where}, {energy_kwh:.2f} kWh on {len(structure.trips)} trips, that no"
        " effect of the library explains.",
        low_ci95=structure.low_set,
        high_ci95=structure.high_set,
    )
