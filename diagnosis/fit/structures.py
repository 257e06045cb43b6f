"""Structure that no candidate explains, taken in one after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from diagnosis.causes.families import Family
from diagnosis.causes.terms import Candidate
from diagnosis.fit.axes import Axis
from diagnosis.fit.jackknife import equations, pinned, solve
from diagnosis.fit.model import BOX, Model, refitted, with_companion_priors
from diagnosis.fit.noise import estimated
from diagnosis.fit.scan import ENDS, Box, around, boxes, joined, leading, only, placed, scan, strongest
from diagnosis.fit.selection import scatter_of, still_standing
from diagnosis.fit.windows import FREE, TOTALS_S

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.fit.scan import Scanned, Structure
    from diagnosis.fit.windows import Windows


MOST_STRUCTURES: Final = 3
HOPES: Final = 2
BETTER: Final = 1.3
ZOOMS: Final = (0.5, 0.1)  # of a box's length, by which its ends are looked for around where they are


def with_structures(model: Model, seed: int) -> Model:
    """The model with what no effect explains, one structure after the other, the strongest first.

    Axes on which found effects live themselves are left out: what departs there is their own form.
    """
    if model.noise.window_s > TOTALS_S:
        return model  # whole drives lie nowhere
    places = boxes(model.windows, _own_axes(model.found), model.trips)
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
    for hope in (_placed(model, hope, seed) for hope in hopes):
        grown = _with_structure(model, hope)
        if grown is None:
            continue
        calmer = _renoised(model, grown)
        again = _scanned(calmer, _on_its_axis(model, places, hope), seed)
        better = None if again is None else strongest(again, calmer.windows, calmer.threshold.z)
        if better is not None:
            return _with_structure(calmer, _placed(calmer, better, seed))
        if structure is not None:
            return grown
    return None


def _on_its_axis(model: Model, places: Places, structure: Structure) -> Places:
    """The boxes of a structure's axis, and some that are nearly its own."""
    alike = only(places, structure.box.axis)
    if structure.box.axis is Axis.PLACE:
        return alike
    reach = ZOOMS[-1] * (structure.box.high - structure.box.low)
    return joined(alike, around(structure.box, reach, model.windows, model.trips))


def _placed(model: Model, structure: Structure, seed: int) -> Structure:
    """A structure with its ends looked for more closely, both at once."""
    if structure.box.axis is Axis.PLACE:
        return structure
    for share in ZOOMS:
        reach = share * (structure.box.high - structure.box.low)
        near = _scanned(model, around(structure.box, reach, model.windows, model.trips), seed)
        if near is None:
            return structure
        structure = placed(near, structure, model.windows, 2.0 * reach / (ENDS - 1), seed)
    return structure


def _scanned(model: Model, places: Places, seed: int) -> Scanned | None:
    names = model.solution.names
    index = model.system.index(names)
    system = pinned(with_companion_priors(model, [candidate.label for candidate in model.companions]), names)
    precision = system.prior.precision[index]
    return scan(
        model.windows,
        model.roots,
        [_powers(trip, names) for trip in model.windows],
        precision,
        precision * system.prior.mean[index],
        scatter_of(model.system, model.solution),
        seed,
        places,
    )


def _renoised(model: Model, grown: Model) -> Model:
    """The model without its last structure, with the noise of the residuals beside it."""
    residuals_w = [grown.residual_w(k, left_out=True) for k in range(len(grown.windows))]
    noise = estimated(grown.windows, residuals_w, grown.noise.window_s)
    roots = tuple(noise.root(trip) for trip in model.windows)
    system = equations(model.windows, roots, model.system.prior)
    return refitted(replace(model, noise=noise, roots=roots, system=system), model.found)


def _own_axes(found: Sequence[Candidate]) -> frozenset[Axis]:
    if any(candidate.term.needs_ambient or candidate.term.family is Family.THERMAL for candidate in found):
        return frozenset((Axis.AMBIENT, Axis.BATTERY_TEMPERATURE))
    return frozenset()


def _powers(trip: Windows, names: Sequence[str]) -> NDArray[np.float64]:
    columns = trip.fitted_columns_j()[:, [trip.names.index(name) for name in names]]
    return np.asarray(columns / trip.duration_s[:, None], np.float64)


def _with_structure(model: Model, structure: Structure) -> Model | None:
    """The structure as one more free column, without terms that only stood in for it; None where it stands in for them.

    A term that no longer stands out beside the structure goes, if the structure alone gains more on left-out trips than
    the term alone by BETTER: a little more may be the form of the term.
    """
    label = f"{BOX}{len(model.structures)}"
    windows = tuple(
        trip.with_column(label, inside * trip.duration_s)
        for trip, inside in zip(model.windows, structure.inside, strict=True)
    )
    system = equations(windows, model.roots, model.system.prior.with_free())
    structures = (*model.structures, structure)
    free = [*FREE, *(f"{BOX}{k}" for k in range(len(structures)))]
    kept = still_standing(system, free, model.found, windows, model.threshold.z)
    if len(kept) < len(model.found):
        by_terms = solve(system, [*free[:-1], *(candidate.label for candidate in model.found)])
        by_structure = solve(system, [*free, *(candidate.label for candidate in kept)])
        by_none = solve(system, [*free[:-1], *(candidate.label for candidate in kept)])
        gains = [float(by_none.losses.sum() - one.losses.sum()) for one in (by_terms, by_structure)]
        if gains[1] <= BETTER * gains[0]:
            return None
    return refitted(replace(model, windows=windows, system=system, structures=structures), kept)
