"""The model that a set of drives asks for: noise, selected effects with their shapes, and unexplained structure."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.causes.driven import with_vehicle
from diagnosis.causes.families import Family
from diagnosis.causes.library import candidates
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.causes.terms import Candidate
from diagnosis.fit.jackknife import additions, equations, first_least, solve
from diagnosis.fit.levels import CLEAR_Z, LOAD, levels
from diagnosis.fit.model import (
    BOX,
    CAPPED,
    Model,
    priors,
    refitted,
    residual_w,
    weighed_equations,
    with_companion_priors,
)
from diagnosis.fit.selection import Selection, measured_loss, scatter_of, select, still_standing, threshold
from diagnosis.fit.stability import Stability, stability
from diagnosis.fit.structures import with_structures
from diagnosis.fit.windows import FREE, windows_of
from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from diagnosis.fit.jackknife import Solution
    from diagnosis.fit.windows import WindowedTrip
    from energy.vehicle.vehicle import Vehicle

ROUNDS: Final = 3  # of noise and selection, which depend on each other
SHAPES: Final = 9  # tried between the neighbours of a shape of the grid


def fit(
    trips: Sequence[WindowedTrip],
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
            parameter.name: float(getattr(vehicle, parameter.name)) + step * solution.value(parameter.name)
            for parameter in PARAMETERS
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
    trips: Sequence[WindowedTrip],
    vehicle: Vehicle,
    nameplate: Vehicle,
    seed: int,
    window_s: float,
    on_step: Callable[[str], None],
) -> Model:
    tried = candidates([trip.drive for trip in trips])
    windows = [windows_of(trip, tried) for trip in trips]
    prior = priors(windows[0].names, vehicle, nameplate, trips[0].drive.battery)
    residuals_w = [trip.residual_j() / trip.duration_s for trip in windows]
    noise, roots, system = weighed_equations(windows, residuals_w, window_s, prior)
    base = solve(system, FREE)
    residuals_w = [residual_w(trip, base, base.without[k]) for k, trip in enumerate(windows)]
    noise, roots, system = weighed_equations(windows, residuals_w, window_s, prior)
    base = solve(system, FREE)
    scatter = scatter_of(system, base)
    limit = threshold(system, FREE, tried, seed, scatter)
    selection = select(system, FREE, tried, windows, limit.z)
    seen = [selection.found]
    for _ in range(ROUNDS - 1):
        on_step("selecting effects")
        solution = selection.solution
        residuals_w = [residual_w(trip, solution, solution.without[k]) for k, trip in enumerate(windows)]
        noise, roots, system = weighed_equations(windows, residuals_w, window_s, prior)
        limit = threshold(system, FREE, tried, seed, scatter_of(system, solution))
        selection = select(system, FREE, tried, windows, limit.z)
        if selection.found in seen:
            break
        seen.append(selection.found)
    if any(trip.climate_j is not None for trip in windows):  # the vehicle alone does not know it
        base = solve(equations([replace(trip, climate_j=None) for trip in windows], roots, prior), FREE)
    return Model(
        vehicle=vehicle,
        nameplate=nameplate,
        trips=tuple(trips),
        windows=tuple(windows),
        noise=noise,
        roots=tuple(roots),
        system=system,
        base=base,
        threshold=limit,
        found=selection.found,
        rivals=selection.rivals,
        z=selection.z,
        shape_ci95={},
        stability=Stability(()),
        structures=(),
        companions=(),
        solution=selection.solution,
    )


def _finished(model: Model, seed: int, on_step: Callable[[str], None]) -> Model:
    """With refined shapes, structures that no effect explains, and without effects that those take over."""
    on_step("refining shapes")
    model = _accompanied(_lasting(_refined(model), seed))
    level = levels(model)
    if level is not None and (level.kind is LOAD or level.z >= CLEAR_Z):
        return model  # some trips differ in all places at once; what they have would be located somewhere
    on_step("looking for what no effect explains")
    return with_structures(model, seed)


def _refined(model: Model) -> Model:
    """Each found term at the shape that predicts left-out trips best, and the spread of that over drawn trips."""
    shaped = [candidate for candidate in model.found if candidate.term.shape is not None]
    if not shaped:
        return model
    variants = {candidate.label: _between(candidate) for candidate in shaped}
    others = [candidate for candidate in model.found if candidate.term.shape is None]
    columns = [*others, *dict.fromkeys(v for shapes in variants.values() for v in shapes)]
    windows = [windows_of(trip, columns) for trip in model.trips]
    prior = priors(windows[0].names, model.vehicle, model.nameplate, model.trips[0].drive.battery)
    system = equations(windows, model.roots, prior)
    chosen = {candidate.label: candidate for candidate in model.found}
    spread: dict[str, tuple[float, float]] = {}
    for candidate in shaped:
        beside = [*FREE, *(other.label for key, other in chosen.items() if key != candidate.label)]
        added = additions(system, beside, [v.label for v in variants[candidate.label]])
        shapes = np.array([v.shape for v in variants[candidate.label]])
        chosen[candidate.label] = variants[candidate.label][int(first_least(added.losses.sum(axis=0)))]
        rng = np.random.default_rng(len(spread))
        drawn = rng.multinomial(len(windows), np.full(len(windows), 1.0 / len(windows)), size=400)
        best = shapes[first_least(drawn @ added.losses)]
        low, high = np.quantile(best, (0.025, 0.975))
        spread[chosen[candidate.label].label] = (float(low), float(high))
    found = tuple(chosen[candidate.label] for candidate in model.found)
    tried = tuple(dict.fromkeys((*found, *candidates([trip.drive for trip in model.trips]))))
    windows = [windows_of(trip, tried) for trip in model.trips]
    prior = priors(windows[0].names, model.vehicle, model.nameplate, model.trips[0].drive.battery)
    system = equations(windows, model.roots, prior)
    standing = still_standing(system, FREE, found, windows, model.threshold.z)
    return refitted(replace(model, windows=tuple(windows), system=system, shape_ci95=spread), standing)


def _lasting(model: Model, seed: int) -> Model:
    """The model with those of its terms that stand when other drives had been recorded, and how they did."""
    if not model.found:
        return model
    tried = tuple(dict.fromkeys((*model.found, *candidates([trip.drive for trip in model.trips]))))
    found = stability(model.system, FREE, tried, model.windows, model.nameplate, model.threshold.z, seed)
    standing = [
        candidate
        for candidate in model.found
        if found.stands(candidate.term.family) or measured_loss(model.system, candidate.label) > model.threshold.z**2
    ]
    return refitted(replace(model, stability=found), standing)


def _between(candidate: Candidate) -> tuple[Candidate, ...]:
    """A candidate's shapes from one neighbour of its grid to the other, itself among them."""
    shape = candidate.term.shape
    assert shape is not None
    at = shape.grid.index(candidate.shape)
    low = shape.grid[at - 1] if at > 0 else shape.low
    high = shape.grid[at + 1] if at + 1 < len(shape.grid) else shape.high
    values = {candidate.shape, *np.linspace(low, high, SHAPES).tolist()}
    return tuple(Candidate(candidate.term, float(value)) for value in sorted(values))


def _accompanied(model: Model) -> Model:
    """The model with terms of heat and cold that were not found, where something that depends on temperature was.

    Each at the shape that predicts left-out trips best, and only if it adds power.
    """
    if all(trip.drive.ambient_k is None for trip in model.trips):
        return model
    open_ = [
        candidate
        for candidate in candidates([trip.drive for trip in model.trips])
        if (candidate.term.family is Family.THERMAL or candidate.term.name in CAPPED)
        and all(candidate.term is not other.term for other in model.found)
    ]
    system = with_companion_priors(model, [candidate.label for candidate in open_])
    chosen: list[Candidate] = []
    for term in dict.fromkeys(candidate.term for candidate in open_):
        shapes = [candidate for candidate in open_ if candidate.term is term]
        beside = [*FREE, *(candidate.label for candidate in (*model.found, *chosen))]
        added = additions(system, beside, [candidate.label for candidate in shapes])
        best = int(first_least(added.losses.sum(axis=0)))
        if float(added.coefficients[best]) > 0.0 and (term.name in CAPPED or added.coefficients[best] <= term.most):
            chosen.append(shapes[best])
    return refitted(replace(model, companions=tuple(chosen)), model.found)


__all__ = ["BOX", "Model", "Selection", "fit", "moved", "priors", "residual_w"]
