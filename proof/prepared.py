"""Drives made ready for a rule that is compared with the tool: windows, columns, noise and equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.causes.battery import battery_loss
from diagnosis.causes.driven import driven
from diagnosis.causes.library import LIBRARY, candidates
from diagnosis.fit.jackknife import equations, no_prior, solve
from diagnosis.fit.model import priors, residual_w
from diagnosis.fit.noise import estimated
from diagnosis.fit.windows import FREE, WINDOW_S, trip_of, windows_of
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.terms import Candidate, Term
    from diagnosis.fit.jackknife import Equations, Prior, Solution
    from diagnosis.fit.windows import WindowedTrip, Windows
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class Prepared:
    """Fitted and held-out trips with the columns of `tried`, and the equations of the fitted ones."""

    tried: tuple[Candidate, ...]
    fitted: tuple[Windows, ...]
    kept: tuple[Windows, ...]
    system: Equations


def prepared(
    recordings: Sequence[Recording],
    vehicle: Vehicle,
    held_out: Collection[str],
    library: Sequence[Term] = LIBRARY,
) -> Prepared:
    """Recordings made ready about the vehicle as its file has it; the noise is what its own parameters leave."""
    battery = battery_loss([recording for recording in recordings if recording.id not in held_out])
    trips = [trip_of(recording, driven(recording, vehicle, battery)) for recording in recordings]
    return windowed_and_weighed(trips, held_out, vehicle, vehicle, library)


def windowed_and_weighed(
    trips: Sequence[WindowedTrip],
    held_out: Collection[str],
    vehicle: Vehicle,
    nameplate: Vehicle,
    library: Sequence[Term],
) -> Prepared:
    """Trips driven by a vehicle made ready; the prior is about the nameplate."""
    fitted = [trip for trip in trips if trip.recording.id not in held_out]
    tried = candidates([trip.drive for trip in fitted], library)
    in_windows = tuple(windows_of(trip, tried) for trip in fitted)
    prior = priors(in_windows[0].names, vehicle, nameplate, trips[0].drive.battery)
    residuals_w = [trip.residual_j() / trip.duration_s for trip in in_windows]
    system = weighed(in_windows, residuals_w, prior)
    base = solve(system, FREE)
    system = weighed(in_windows, [residual_w(trip, base, base.without[k]) for k, trip in enumerate(in_windows)], prior)
    kept = tuple(windows_of(trip, tried) for trip in trips if trip.recording.id in held_out)
    return Prepared(tried, in_windows, kept, system)


def weighed(
    in_windows: Sequence[Windows],
    residuals_w: Sequence[NDArray[np.float64]],
    prior: Prior,
) -> Equations:
    """The equations of trips, whitened by the noise of residual powers [W]."""
    noise = estimated(in_windows, residuals_w, WINDOW_S)
    return equations(in_windows, [noise.root(trip) for trip in in_windows], prior)


def without_noise(ready: Prepared) -> Equations:
    """The equations with every window as good as any other, and no prior."""
    roots = [np.eye(trip.begin_s.size) for trip in ready.fitted]
    return equations(ready.fitted, roots, no_prior(len(ready.system.names)))


def predicted_kwh(trips: Sequence[Windows], solution: Solution) -> tuple[float, ...]:
    """Energy of trips by coefficients that were fitted to others [kWh]."""
    found = []
    for trip in trips:
        columns = trip.columns_j[:, [trip.names.index(name) for name in solution.names]]
        found.append(float((trip.simulated_j + columns @ solution.coefficients).sum()) / JOULE_PER_KWH)
    return tuple(found)
