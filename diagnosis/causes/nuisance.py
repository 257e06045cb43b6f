"""What is never called physics: the vehicle's own parameters, and what sensors do to a recording.

Both are always free in a fit. What lies in the span of the parameters is a parameter error; what lies in the span of
the sensor columns is the recording's own doing. Without the latter every selector finds physics in clean drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.causes.families import Family
from energy.replay.replay import replay
from energy.units import GRAVITY_MPS2
from energy.vehicle.vehicle import CHECKED_SPEED_MPS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive
    from energy.replay.replay import DrivenProfile
    from energy.vehicle.vehicle import Vehicle

KINK_ACCEL_MPS2: Final = 0.2  # spread of a recorded acceleration about the driven one
NOISE_MPS: Final = 0.1
CURVATURE_W: Final = 20_000.0
LEAST_SD_FRAC: Final = 0.3  # of the usual standard deviation: no file knows a car in use better than that
NOISE_SEED: Final = 20170926


@dataclass(frozen=True, slots=True)
class Parameter:
    """A field of the vehicle: its name, unit and family, the step of its derivative, and how far off it may well be.

    sd: of the file's value about the true one where the file has none of its own, absolute, or as a share of it where
    relative. low, high: what a car of such a file can have, likewise from the file's value on. least, most: what any
    vehicle can have.
    """

    name: str
    unit: str
    family: Family
    step: float
    sd: float
    low: float
    high: float
    relative: bool = True
    least: float = -math.inf
    most: float = math.inf
    aliases: tuple[str, ...] = ()

    def sd_of(self, nameplate: Vehicle) -> float:
        """Standard deviation of the file's value in its unit: its own, but at least LEAST_SD_FRAC of the usual."""
        value = abs(float(getattr(nameplate, self.name)))
        usual = max(self.sd * value, 1e-6) if self.relative else self.sd
        own = nameplate.sd.get(self.name)
        return usual if own is None else max(float(own), LEAST_SD_FRAC * usual)

    def bounds(self, nameplate: Vehicle) -> tuple[float, float]:
        """What a car that such a file describes can have, in the parameter's unit."""
        value = float(getattr(nameplate, self.name))
        size = abs(value) if self.relative else 1.0
        low, high = max(value + self.low * size, self.least), min(value + self.high * size, self.most)
        low, high = min(low, value), max(high, value)
        return low, max(high, low + self.step)

    def column_j(self, drive: ReplayedDrive) -> NDArray[np.float64]:
        """Energy of one unit more, by the central difference of the replay, float64 (n,) [J]."""
        value = float(getattr(drive.vehicle, self.name))
        low, high = max(value - self.step, self.least), min(value + self.step, self.most)
        changes: tuple[dict[str, Any], ...] = ({self.name: high}, {self.name: low})
        above, below = (replay(replace(drive.vehicle, **changed), drive.profile).step_energy_j for changed in changes)
        return np.asarray((above - below) / (high - low), np.float64)


PARAMETERS: Final[tuple[Parameter, ...]] = (
    Parameter(
        "mass_kg",
        "kg",
        Family.MASS,
        5.0,
        0.07,
        -0.25,
        0.3,
        aliases=("a factor on the recorded acceleration and grade", "a factor on the recorded speed"),
    ),
    Parameter(
        "road_load_a_n",
        "N",
        Family.ROLLING,
        1.0,
        0.15,
        -0.5,
        0.8,
        least=0.0,
        aliases=("a constant bias of the grade", "a drivetrain loss that grows with way"),
    ),
    Parameter(
        "road_load_b_n_per_mps",
        "N/(m/s)",
        Family.AERODYNAMIC,
        0.05,
        1.0,
        -3.0,
        5.0,
        relative=False,
        aliases=("spin loss of the motor", "a factor on the recorded speed"),
    ),
    Parameter(
        "road_load_c_n_per_mps2",
        "N/(m/s)²",
        Family.AERODYNAMIC,
        0.005,
        0.12,
        -0.4,
        0.6,
        aliases=("a factor on the recorded speed",),
    ),
    Parameter(
        "drive_eff",
        "1",
        Family.DRIVETRAIN,
        0.002,
        0.05,
        -0.3,
        0.25,
        least=0.5,
        most=0.99,
        aliases=("a factor on the recorded power",),
    ),
    Parameter(
        "recuperation_eff",
        "1",
        Family.RECUPERATION,
        0.005,
        0.2,
        -0.7,
        0.5,
        least=0.05,
        most=0.98,
        aliases=("friction braking",),
    ),
    Parameter(
        "aux_power_w",
        "W",
        Family.AUXILIARY,
        5.0,
        300.0,
        -1500.0,
        1500.0,
        relative=False,
        least=0.0,
        aliases=("a constant offset of the recorded current",),
    ),
)


@dataclass(frozen=True, slots=True)
class SensorColumn:
    """Something that sensors do: the energy that a unit of it seems to add, float64 (n,) [J], and how much is usual."""

    name: str
    column_j: Callable[[ReplayedDrive, DrivenProfile], NDArray[np.float64]]
    sd: float


def _acceleration_gain(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    del rougher
    force = drive.vehicle.mass_kg * drive.vehicle.rotating_mass_coef * drive.accel_mps2
    return drive.work_j(force)


def _lag(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    del rougher
    if drive.power_w.size < 2:
        return np.zeros_like(drive.power_w)
    return np.asarray(np.gradient(drive.power_w), np.float64)


def _kink(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """Noise of the acceleration costs where drive turns to recuperation, since the two lose differently."""
    del rougher
    spread_n = drive.vehicle.mass_kg * drive.vehicle.rotating_mass_coef * KINK_ACCEL_MPS2
    near = np.exp(-0.5 * (drive.force_n / spread_n) ** 2)
    step = 1.0 / drive.vehicle.drive_eff - drive.vehicle.recuperation_eff
    return np.asarray(step * spread_n * near * drive.speed_mps * drive.duration_s, np.float64)


def _replayed(drive: ReplayedDrive, profile: DrivenProfile) -> NDArray[np.float64]:
    more = replay(drive.vehicle, profile).step_energy_j
    return np.asarray(more - drive.power_w * drive.duration_s, np.float64)


def _noise(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """The recording pushed once more through the noise of a speed sensor (SIMEX)."""
    del rougher
    speed = drive.profile.speed_mps
    shaken = speed + np.random.default_rng(NOISE_SEED).normal(0.0, NOISE_MPS, speed.size)
    return _replayed(
        drive, replace(drive.profile, speed_mps=np.where(speed > 0.0, np.clip(shaken, 0.0, CHECKED_SPEED_MPS), 0.0))
    )


def _smoothing(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """The recording smoothed once more over three samples."""
    del rougher
    speed = drive.profile.speed_mps
    mean = np.convolve(np.pad(speed, 1, mode="edge"), np.full(3, 1.0 / 3.0), mode="valid")
    return _replayed(drive, replace(drive.profile, speed_mps=np.where(speed > 0.0, mean, 0.0)))


def _load_curvature(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """Efficiency of a real drive falls and rises with power about its mean: in units of 1 % at CURVATURE_W."""
    del rougher
    power_w = np.maximum(drive.force_n * drive.speed_mps, 0.0)
    return np.asarray(0.01 * power_w**2 / CURVATURE_W * drive.duration_s, np.float64)


def _recuperation_curvature(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """Likewise of recuperation."""
    del rougher
    power_w = np.minimum(drive.force_n * drive.speed_mps, 0.0)
    return np.asarray(0.01 * power_w**2 / CURVATURE_W * drive.duration_s, np.float64)


def _rougher(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    """The height smoothed over a longer way."""
    return _replayed(drive, rougher)


def _grade_gain(drive: ReplayedDrive, rougher: DrivenProfile) -> NDArray[np.float64]:
    del rougher
    return drive.work_j(drive.vehicle.mass_kg * GRAVITY_MPS2 * drive.grade_frac)


SENSOR_COLUMNS: Final[tuple[SensorColumn, ...]] = (
    SensorColumn("acceleration_gain", _acceleration_gain, 0.06),
    SensorColumn("current_lag_s", _lag, 0.5),
    SensorColumn("kink_noise", _kink, 1.0),
    SensorColumn("speed_noise", _noise, 3.0),
    SensorColumn("speed_smoothing", _smoothing, 1.0),
    SensorColumn("height_smoothing", _rougher, 1.0),
    SensorColumn("grade_gain", _grade_gain, 0.15),
    SensorColumn("load_curvature", _load_curvature, 10.0),
    SensorColumn("recuperation_curvature", _recuperation_curvature, 20.0),
)

__all__ = ["PARAMETERS", "SENSOR_COLUMNS", "Parameter", "SensorColumn"]
