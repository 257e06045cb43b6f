"""The model that a set of drives asks for: noise, selected effects with their shapes, and unexplained structure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from diagnosis.answer.results import Family
from diagnosis.causes.driven import with_vehicle
from diagnosis.causes.library import Candidate, candidates
from diagnosis.causes.nuisance import PARAMETERS, SENSOR_COLUMNS
from diagnosis.fit.jackknife import additions, equations, solve
from diagnosis.fit.noise import estimated
from diagnosis.fit.scan import Box, boxes, leading, only, scan, strongest
from diagnosis.fit.selection import Selection, alone_z, rivals, scatter_of, select, still_standing, threshold
from diagnosis.fit.windows import FREE, measured_size_j, windows
from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from diagnosis.fit.jackknife import Equations, Solution
    from diagnosis.fit.noise import Noise
    from diagnosis.fit.scan import Scanned, Structure
    from diagnosis.fit.selection import Threshold
    from diagnosis.fit.windows import Trip, Windows
    from energy.vehicle.vehicle import Vehicle

ROUNDS: Final = 3  # of noise and selection, which depend on each other
SHAPES: Final = 9  # tried between the neighbours of a shape of the grid
TRIP_SD_FRAC: Final = 0.02  # of a trip's energy, that its whole may be off
COMPANION_SHARE: Final = 0.03  # of the energy: how much a term that does not stand out may well hold
ACCOMPANYING: Final = ("rolling_temp_per_k",)  # beside thermal terms
MOST_STRUCTURES: Final = 3
HOPES: Final = 2
BOX: Final = "structure"


@dataclass(frozen=True, slots=True)
class Model:
    """A fitted model: everything that predictions and findings are read from.

    vehicle: about which energies are linear; nameplate: of the file. base: parameters and sensors alone, with the noise
    that they leave. companions: terms that are not claimed but fitted about none, since a car that heats its cabin
    will cool it too. solution: with what was found, companions and structures, in that order behind the free columns.
    """

    vehicle: Vehicle
    nameplate: Vehicle
    trips: tuple[Trip, ...]
    windows: tuple[Windows, ...]
    noise: Noise
    roots: tuple[NDArray[np.float64], ...]
    system: Equations
    base: Solution
    threshold: Threshold
    found: tuple[Candidate, ...]
    rivals: Mapping[str, tuple[Candidate, ...]]
    z: Mapping[str, float]
    shape_ci95: Mapping[str, tuple[float, float]]
    structures: tuple[Structure, ...]
    companions: tuple[Candidate, ...]
    solution: Solution

    def left_w(self, k: int, *, left_out: bool = False) -> NDArray[np.float64]:
        """What the model leaves of the power of a fitted trip's windows; left_out: by the fit of the others."""
        beta = self.solution.without[k] if left_out else self.solution.coefficients
        return left_w(self.windows[k], self.solution, beta)


def left_w(trip: Windows, solution: Solution, beta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residual power of a trip's windows after coefficients of a solution, float64 (n,) [W]."""
    columns = trip.columns_j[:, [trip.names.index(name) for name in solution.names]]
    return np.asarray((trip.residual_j() - columns @ beta) / trip.duration_s, np.float64)


def fit(
    trips: Sequence[Trip],
    nameplate: Vehicle,
    seed: int,
    window_s: float,
    on_step: Callable[[str], None],
) -> Model:
    """Fit twice: about the vehicle as its file has it, and about the vehicle that the first fit makes of it."""
    first = _linear_fit(trips, nameplate, nameplate, seed, window_s, on_step)
    vehicle = moved(nameplate, first.solution)
    if vehicle == nameplate:
        return _finished(first, seed, on_step)
    again = [replace(trip, drive=with_vehicle(trip.drive, vehicle)) for trip in trips]
    return _finished(_linear_fit(again, vehicle, nameplate, seed, window_s, on_step), seed, on_step)


def moved(vehicle: Vehicle, solution: Solution) -> Vehicle:
    """The vehicle with the parameters of a fit, as far towards them as stays a vehicle."""
    step = 1.0
    for _ in range(4):
        values: dict[str, Any] = {
            one.name: float(getattr(vehicle, one.name)) + step * solution.value(one.name) for one in PARAMETERS
        }
        values["aux_power_w"] = max(values["aux_power_w"], 0.0)
        values["road_load_a_n"] = max(values["road_load_a_n"], 0.2 * vehicle.road_load_a_n)
        values["road_load_c_n_per_mps2"] = max(values["road_load_c_n_per_mps2"], 0.2 * vehicle.road_load_c_n_per_mps2)
        values["drive_eff"] = float(np.clip(values["drive_eff"], 0.5, 0.99))
        values["recuperation_eff"] = float(np.clip(values["recuperation_eff"], 0.05, 0.98))
        try:
            return replace(vehicle, **values)
        except VehicleError:
            step *= 0.5
    return vehicle


def _linear_fit(
    trips: Sequence[Trip],
    vehicle: Vehicle,
    nameplate: Vehicle,
    seed: int,
    window_s: float,
    on_step: Callable[[str], None],
) -> Model:
    tried = candidates([trip.drive for trip in trips])
    cut = [windows(trip, tried) for trip in trips]
    precision, prior = priors(cut[0].names, vehicle, nameplate)
    left = [trip.residual_j() / trip.duration_s for trip in cut]
    noise, roots, system = _equations(cut, left, window_s, precision, prior)
    base = solve(system, FREE)
    left = [left_w(trip, base, base.without[k]) for k, trip in enumerate(cut)]
    noise, roots, system = _equations(cut, left, window_s, precision, prior)
    base = solve(system, FREE)
    scatter = scatter_of(system, base)
    limit = threshold(system, FREE, tried, seed, scatter)
    selection = select(system, FREE, tried, cut, limit.z)
    seen = [selection.found]
    for _ in range(ROUNDS - 1):
        on_step("selecting effects")
        solution = selection.solution
        left = [left_w(trip, solution, solution.without[k]) for k, trip in enumerate(cut)]
        noise, roots, system = _equations(cut, left, window_s, precision, prior)
        limit = threshold(system, FREE, tried, seed, scatter_of(system, solution))
        selection = select(system, FREE, tried, cut, limit.z)
        if selection.found in seen:
            break
        seen.append(selection.found)
    return Model(
        vehicle=vehicle,
        nameplate=nameplate,
        trips=tuple(trips),
        windows=tuple(cut),
        noise=noise,
        roots=tuple(roots),
        system=system,
        base=base,
        threshold=limit,
        found=selection.found,
        rivals=selection.rivals,
        z=selection.z,
        shape_ci95={},
        structures=(),
        companions=(),
        solution=selection.solution,
    )


def priors(
    names: Sequence[str], vehicle: Vehicle, nameplate: Vehicle
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Precision and mean of each column's prior: parameters about the file's values, sensors about none."""
    precision, prior = np.zeros(len(names)), np.zeros(len(names))
    for one in PARAMETERS:
        k = names.index(one.name)
        precision[k] = 1.0 / one.sd_of(float(getattr(nameplate, one.name))) ** 2
        prior[k] = float(getattr(nameplate, one.name)) - float(getattr(vehicle, one.name))
    for sensor in SENSOR_COLUMNS:
        precision[names.index(sensor.name)] = 1.0 / sensor.sd**2
    return precision, prior


def _equations(
    cut: Sequence[Windows],
    left: Sequence[NDArray[np.float64]],
    window_s: float,
    precision: NDArray[np.float64],
    prior: NDArray[np.float64],
) -> tuple[Noise, list[NDArray[np.float64]], Equations]:
    noise = estimated(cut, left, window_s)
    roots = [noise.root(trip) for trip in cut]
    return noise, roots, equations(cut, roots, precision, prior)


def _finished(model: Model, seed: int, on_step: Callable[[str], None]) -> Model:
    """With refined shapes, structures that no effect explains, and without effects that those take over."""
    on_step("refining shapes")
    model = _accompanied(_refined(model))
    on_step("looking for what no effect explains")
    return _with_structures(model, seed)


def _refined(model: Model) -> Model:
    """Each found term at the shape that predicts left-out trips best, and the spread of that over drawn trips."""
    shaped = [one for one in model.found if one.term.shape is not None]
    if not shaped:
        return model
    variants = {one.label: _between(one) for one in shaped}
    others = [one for one in model.found if one.term.shape is None]
    columns = [*others, *dict.fromkeys(v for each in variants.values() for v in each)]
    cut = [windows(trip, columns) for trip in model.trips]
    precision, prior = priors(cut[0].names, model.vehicle, model.nameplate)
    system = equations(cut, model.roots, precision, prior)
    chosen = {one.label: one for one in model.found}
    spread: dict[str, tuple[float, float]] = {}
    for one in shaped:
        beside = [*FREE, *(other.label for key, other in chosen.items() if key != one.label)]
        added = additions(system, beside, [v.label for v in variants[one.label]])
        shapes = np.array([v.shape for v in variants[one.label]])
        chosen[one.label] = variants[one.label][int(np.argmin(added.losses.sum(axis=0)))]
        rng = np.random.default_rng(len(spread))
        drawn = rng.multinomial(len(cut), np.full(len(cut), 1.0 / len(cut)), size=400)
        best = shapes[np.argmin(drawn @ added.losses, axis=1)]
        low, high = np.quantile(best, (0.025, 0.975))
        spread[chosen[one.label].label] = (float(low), float(high))
    found = tuple(chosen[one.label] for one in model.found)
    tried = tuple(dict.fromkeys((*found, *candidates([trip.drive for trip in model.trips]))))
    cut = [windows(trip, tried) for trip in model.trips]
    precision, prior = priors(cut[0].names, model.vehicle, model.nameplate)
    system = equations(cut, model.roots, precision, prior)
    standing = still_standing(system, FREE, found, cut, model.threshold.z)
    return _read(replace(model, windows=tuple(cut), system=system, shape_ci95=spread), standing)


def _between(one: Candidate) -> tuple[Candidate, ...]:
    """A candidate's shapes from one neighbour of its grid to the other, itself among them."""
    shape = one.term.shape
    assert shape is not None
    at = shape.grid.index(one.shape)
    low = shape.grid[at - 1] if at > 0 else shape.low
    high = shape.grid[at + 1] if at + 1 < len(shape.grid) else shape.high
    values = {one.shape, *np.linspace(low, high, SHAPES).tolist()}
    return tuple(Candidate(one.term, float(value)) for value in sorted(values))


def _read(model: Model, found: Sequence[Candidate]) -> Model:
    """The model with other terms and the structures that it has."""
    free = [*FREE, *(f"{BOX}{k}" for k in range(len(model.structures)))]
    tried = candidates([trip.drive for trip in model.trips])
    pool = tuple(dict.fromkeys((*found, *tried)))
    return replace(
        model,
        found=tuple(found),
        rivals={one.label: rivals(model.system, free, pool, found, one, model.threshold.z) for one in found},
        z={one.label: alone_z(model.system, free, found, one) for one in found},
        solution=_solution(model, found),
    )


def _solution(model: Model, found: Sequence[Candidate]) -> Solution:
    """The fit of found terms, companions, each about none by COMPANION_SHARE of the energy, and structures."""
    companions = [one for one in model.companions if all(one.term is not other.term for other in found)]
    labels = [one.label for one in companions]
    system = with_wholes(_held(model, labels), model.windows)
    boxed = [f"{BOX}{k}" for k in range(len(model.structures))]
    while True:
        solution = solve(system, [*FREE, *(one.label for one in found), *labels, *boxed])
        most = {one.label: one.term.most for one in companions}
        wrong = [label for label in labels if not 0.0 <= solution.value(label) <= most[label]]
        if not wrong:
            return solution
        labels = [label for label in labels if label not in wrong]


def with_wholes(system: Equations, trips: Sequence[Windows]) -> Equations:
    """The equations with trips' whole energies counted beside their windows, each as if known to TRIP_SD_FRAC.

    What is wanted of a fit is the energy of a trip; windows alone would trade it for steady stretches.
    """
    gram, vector = system.gram.copy(), system.vector.copy()
    for k, trip in enumerate(trips):
        size_j = TRIP_SD_FRAC * max(abs(float(trip.measured_j.sum())), 1.0)
        whole = trip.columns_j.sum(axis=0) / size_j
        gram[k] += np.outer(whole, whole)
        vector[k] += whole * float(trip.residual_j().sum()) / size_j
    return replace(system, gram=gram, vector=vector)


def _held(model: Model, labels: Sequence[str]) -> Equations:
    """The equations with a prior about 0 on some terms."""
    return replace(model.system, precision=companion_precision(model.system, model.windows, labels))


def companion_precision(system: Equations, trips: Sequence[Windows], labels: Sequence[str]) -> NDArray[np.float64]:
    """Precision of all columns with some held about 0 by COMPANION_SHARE of the energy, float64 (p,)."""
    precision = system.precision.copy()
    measured_j = measured_size_j(trips)
    for label in labels:
        size_j = sum(abs(float(trip.column(label).sum())) for trip in trips)
        precision[system.names.index(label)] = (size_j / (COMPANION_SHARE * measured_j)) ** 2
    return precision


def _accompanied(model: Model) -> Model:
    """The model with terms of heat and cold that were not found, where something that depends on temperature was.

    Each at the shape that predicts left-out trips best, and only if it adds power.
    """
    if not any(one.term.needs_ambient for one in model.found):
        return model
    open_ = [
        one
        for one in candidates([trip.drive for trip in model.trips])
        if (one.term.family is Family.THERMAL or one.term.name in ACCOMPANYING)
        and all(one.term is not other.term for other in model.found)
    ]
    system = _held(model, [one.label for one in open_])
    chosen: list[Candidate] = []
    for term in dict.fromkeys(one.term for one in open_):
        shapes = [one for one in open_ if one.term is term]
        beside = [*FREE, *(one.label for one in (*model.found, *chosen))]
        added = additions(system, beside, [one.label for one in shapes])
        best = int(np.argmin(added.losses.sum(axis=0)))
        if 0.0 < float(added.coefficients[best]) <= term.most:
            chosen.append(shapes[best])
    return _read(replace(model, companions=tuple(chosen)), model.found)


def _with_structures(model: Model, seed: int) -> Model:
    """The model with what no effect explains, one structure after the other, the strongest first.

    Axes on which found effects live themselves are left out: what departs there is their own form.
    """
    places = boxes(model.windows, _own_axes(model.found))
    while len(model.structures) < MOST_STRUCTURES:
        grown = _grown(model, places, seed + len(model.structures))
        if grown is None:
            break
        model = grown
    return model


Places = tuple[tuple[Box, ...], list[NDArray[np.float64]]]


def _grown(model: Model, places: Places, seed: int) -> Model | None:
    """The model with one structure more, or None where nothing passes.

    Structure that is left in the residuals makes their noise larger, so that it hides itself and its bounds. Noise is
    therefore estimated anew with the structure in the model, and the structure's axis looked at again. Where nothing
    passes at once, the two axes that stand out most are given the same chance.
    """
    scanned = _scanned(model, places, seed)
    if scanned is None:
        return None
    structure = strongest(scanned, model.windows, model.threshold.z)
    hopes = [structure] if structure is not None else leading(scanned, model.windows, HOPES)
    for hope in hopes:
        grown = _with_structure(model, hope)
        if grown is None:
            continue
        calmer = _renoised(model, grown)
        again = _scanned(calmer, only(places, hope.box.axis), seed)
        better = None if again is None else strongest(again, calmer.windows, calmer.threshold.z)
        if better is not None:
            return _with_structure(calmer, better)
        if structure is not None:
            return grown
    return None


def _scanned(model: Model, places: Places, seed: int) -> Scanned | None:
    names = model.solution.names
    index = model.system.index(names)
    precision = _held(model, [one.label for one in model.companions]).precision[index]
    return scan(
        model.windows,
        model.roots,
        [_powers(trip, names) for trip in model.windows],
        precision,
        precision * model.system.prior[index],
        scatter_of(model.system, model.solution),
        seed,
        places,
    )


def _renoised(model: Model, grown: Model) -> Model:
    """The model without its last structure, with the noise that is left with it."""
    left = [grown.left_w(k, left_out=True) for k in range(len(grown.windows))]
    noise = estimated(grown.windows, left, grown.noise.window_s)
    roots = tuple(noise.root(trip) for trip in model.windows)
    system = equations(model.windows, roots, model.system.precision, model.system.prior)
    return _read(replace(model, noise=noise, roots=roots, system=system), model.found)


def _own_axes(found: Sequence[Candidate]) -> frozenset[str]:
    if any(one.term.needs_ambient or one.term.family is Family.THERMAL for one in found):
        return frozenset(("ambient", "battery_temperature"))
    return frozenset()


def _powers(trip: Windows, names: Sequence[str]) -> NDArray[np.float64]:
    columns = trip.columns_j[:, [trip.names.index(name) for name in names]]
    return np.asarray(columns / trip.duration_s[:, None], np.float64)


def _with_structure(model: Model, structure: Structure) -> Model | None:
    """The structure as one more free column, without terms that only stood in for it; None where it stands in for them.

    A term that no longer stands out beside the structure goes, if the structure alone predicts left-out trips better
    than the term alone.
    """
    label = f"{BOX}{len(model.structures)}"
    cut = tuple(
        replace(
            trip,
            names=(*trip.names, label),
            columns_j=np.column_stack((trip.columns_j, inside * trip.duration_s)),
        )
        for trip, inside in zip(model.windows, structure.inside, strict=True)
    )
    precision, prior = (np.append(values, 0.0) for values in (model.system.precision, model.system.prior))
    system = equations(cut, model.roots, precision, prior)
    structures = (*model.structures, structure)
    free = [*FREE, *(f"{BOX}{k}" for k in range(len(structures)))]
    kept = still_standing(system, free, model.found, cut, model.threshold.z)
    if len(kept) < len(model.found):
        by_terms = solve(system, [*free[:-1], *(one.label for one in model.found)])
        by_structure = solve(system, [*free, *(one.label for one in kept)])
        if by_terms.losses.sum() <= by_structure.losses.sum():
            return None
    return _read(replace(model, windows=cut, system=system, structures=structures), kept)


__all__ = ["BOX", "Model", "Selection", "fit", "left_w", "moved", "priors"]
