"""The linear model of the residuals of trips, its priors and its solution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from diagnosis.causes.library import candidates
from diagnosis.causes.nuisance import PARAMETERS, SENSOR_COLUMNS
from diagnosis.causes.terms import Candidate
from diagnosis.fit.jackknife import equations, no_prior, solve
from diagnosis.fit.noise import estimated
from diagnosis.fit.selection import alone_z, rivals
from diagnosis.fit.windows import FREE, measured_size_j

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from diagnosis.causes.battery import BatteryLoss
    from diagnosis.fit.jackknife import Equations, Prior, Solution
    from diagnosis.fit.noise import Noise
    from diagnosis.fit.scan import Structure
    from diagnosis.fit.selection import Threshold
    from diagnosis.fit.stability import Stability
    from diagnosis.fit.windows import WindowedTrip, Windows
    from energy.vehicle.vehicle import Vehicle


TRIP_SD_FRAC: Final = 0.02  # of a trip's energy, that its whole may be off
LEAST_SHARE_SD: Final = 0.1  # of the battery's loss that is in the power, as voltage times current tells it
CAPPED: Final = ("rolling_temp_per_k",)  # companions that all tyres have: where drives ask for too much, the most
BATTERY_LOSS: Final = "battery_loss_share"
COMPANION_SHARE: Final = 0.03  # of the energy: how much a term that does not stand out may well hold
BOX: Final = "structure"


@dataclass(frozen=True, slots=True)
class Model:
    """A fitted model: everything that predictions and findings are read from.

    vehicle: about which energies are linear; nameplate: of the file. base: parameters and sensors alone, with the noise
    that they leave. stability: of what was found over draws of drives and of the file's numbers. companions: terms that
    are not claimed but fitted about none, since a car that heats its cabin will cool it too. solution: with what was
    found, companions and structures, in that order behind the free columns.
    """

    vehicle: Vehicle
    nameplate: Vehicle
    trips: tuple[WindowedTrip, ...]
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
    stability: Stability
    structures: tuple[Structure, ...]
    companions: tuple[Candidate, ...]
    solution: Solution

    def residual_w(self, k: int, *, left_out: bool = False) -> NDArray[np.float64]:
        """What the model leaves of the power of a fitted trip's windows; left_out: by the fit of the others."""
        beta = self.solution.without[k] if left_out else self.solution.coefficients
        return residual_w(self.windows[k], self.solution, beta)


def residual_w(trip: Windows, solution: Solution, beta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residual power of a trip's windows after coefficients of a solution, float64 (n,) [W].

    A recorded climate is taken as it was recorded.
    """
    columns = trip.fitted_columns_j()[:, [trip.names.index(name) for name in solution.names]]
    return np.asarray((trip.residual_j() - columns @ beta) / trip.duration_s, np.float64)


def model_w(trip: Windows, solution: Solution, beta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of a trip's windows by coefficients of a solution, float64 (n,) [W]; a recorded climate has no part."""
    columns = trip.columns_j[:, [trip.names.index(name) for name in solution.names]]
    return np.asarray((trip.simulated_j + columns @ beta) / trip.duration_s, np.float64)


def priors(names: Sequence[str], vehicle: Vehicle, nameplate: Vehicle, battery: BatteryLoss | None = None) -> Prior:
    """What is known of each column: parameters about the file's values and as a car can have them, sensors about none.

    Coefficients of parameters are what is added to those of the vehicle. battery: what voltage tells of its loss, and
    with the current how much of that is in the power.
    """
    prior = no_prior(len(names))
    if battery is not None and battery.share is not None and battery.share_sd is not None and BATTERY_LOSS in names:
        k = names.index(BATTERY_LOSS)
        prior.precision[k] = 1.0 / max(battery.share_sd, LEAST_SHARE_SD) ** 2
        prior.mean[k] = battery.share
    for parameter in PARAMETERS:
        k = names.index(parameter.name)
        own, file = (float(getattr(car, parameter.name)) for car in (vehicle, nameplate))
        prior.precision[k] = 1.0 / parameter.sd_of(nameplate) ** 2
        prior.mean[k] = file - own
        low, high = parameter.bounds(nameplate)
        prior.low[k], prior.high[k] = low - own, high - own
    for sensor in SENSOR_COLUMNS:
        prior.precision[names.index(sensor.name)] = 1.0 / sensor.sd**2
    return prior


def weighed_equations(
    windows: Sequence[Windows],
    residuals_w: Sequence[NDArray[np.float64]],
    window_s: float,
    prior: Prior,
) -> tuple[Noise, list[NDArray[np.float64]], Equations]:
    """The noise of residual powers [W], the root of each trip's covariance, and the equations that these weigh."""
    noise = estimated(windows, residuals_w, window_s)
    roots = [noise.root(trip) for trip in windows]
    return noise, roots, equations(windows, roots, prior)


def refitted(model: Model, found: Sequence[Candidate]) -> Model:
    """The model solved again with these found terms, its companions and its structures."""
    free = [*FREE, *(f"{BOX}{k}" for k in range(len(model.structures)))]
    tried = candidates([trip.drive for trip in model.trips])
    pool = tuple(dict.fromkeys((*found, *tried)))
    return replace(
        model,
        found=tuple(found),
        rivals={
            candidate.label: rivals(model.system, free, pool, found, candidate, model.threshold.z)
            for candidate in found
        },
        z={candidate.label: alone_z(model.system, free, found, candidate) for candidate in found},
        solution=_solution(model, found),
    )


def _solution(model: Model, found: Sequence[Candidate]) -> Solution:
    """The fit of found terms, companions, each about none by COMPANION_SHARE of the energy, and structures."""
    companions = [
        candidate for candidate in model.companions if all(candidate.term is not other.term for other in found)
    ]
    labels = [candidate.label for candidate in companions]
    most = {candidate.label: candidate.term.most for candidate in companions}
    capped = {label: value for label, value in most.items() if label in CAPPED}
    system = with_wholes(_capped(with_companion_priors(model, labels), capped), model.windows)
    boxed = [f"{BOX}{k}" for k in range(len(model.structures))]
    while True:
        solution = solve(system, [*FREE, *(candidate.label for candidate in found), *labels, *boxed])
        wrong = [
            label
            for label in labels
            if solution.value(label) < 0.0 or (label not in CAPPED and solution.value(label) > most[label])
        ]
        if not wrong:
            return solution
        labels = [label for label in labels if label not in wrong]


def _capped(system: Equations, most: Mapping[str, float]) -> Equations:
    """The equations with some columns held to what no such thing exceeds."""
    high = system.prior.high.copy()
    for label, value in most.items():
        high[system.names.index(label)] = value
    return replace(system, prior=replace(system.prior, high=high))


def with_wholes(system: Equations, trips: Sequence[Windows]) -> Equations:
    """The equations with trips' whole energies counted beside their windows, each as if known to TRIP_SD_FRAC.

    What is wanted of a fit is the energy of a trip; windows alone would trade it for steady stretches.
    """
    gram, vector = system.gram.copy(), system.vector.copy()
    for k, trip in enumerate(trips):
        size_j = TRIP_SD_FRAC * max(abs(float(trip.measured_j.sum())), 1.0)
        whole = trip.fitted_columns_j().sum(axis=0) / size_j
        gram[k] += np.outer(whole, whole)
        vector[k] += whole * float(trip.residual_j().sum()) / size_j
        if trip.climate_j is not None:
            climate = trip.climate_columns_j().sum(axis=0) / size_j
            gram[k] += np.outer(climate, climate)
            vector[k] += climate * float(trip.climate_j.sum()) / size_j
    return replace(system, gram=gram, vector=vector)


def with_companion_priors(model: Model, labels: Sequence[str]) -> Equations:
    """The equations with a prior about 0 on the terms of these labels, as companions have it."""
    return with_companions(model.system, model.windows, labels)


def with_companions(system: Equations, trips: Sequence[Windows], labels: Sequence[str]) -> Equations:
    """The equations with some columns held about 0 by COMPANION_SHARE of the energy."""
    precision = system.prior.precision.copy()
    measured_j = measured_size_j(trips)
    for label in labels:
        size_j = sum(abs(float(trip.column(label).sum())) for trip in trips)
        precision[system.names.index(label)] = (size_j / (COMPANION_SHARE * measured_j)) ** 2
    return replace(system, prior=replace(system.prior, precision=precision))
