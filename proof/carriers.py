"""Real recordings as carriers of made-up effects: a sample a second, climate columns dropped on reading."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.reading import read_recordings
from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.errors import ProofError
from proof.worlds.carriers import Carrier, CarrierVehicle

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording

Carried = tuple[Carrier, ...]

HIDDEN: Final = ("*heat*", "*air*con*", "*coolant*", "*cabin*", "*vent*", "*exchanger*")
AIR_KG_PER_M3: Final = 1.2


def carriers_of(folder: Path) -> Carried:
    """The drives of a folder that have height and temperature and no gap; raises ProofError where there is none."""
    recordings, _ = read_recordings([folder], HIDDEN)
    found = tuple(_carrier(recording) for recording in recordings if _whole(recording))
    if not found:
        raise ProofError(f"--recordings is {str(folder)!r}, allowed: a folder of drives with height and temperature")
    return found


def carrier_vehicle(file: Path) -> CarrierVehicle:
    """The vehicle of the drives as its file has it, named as in every world.

    Raises ProofError where it is not given by its physics.
    """
    vehicle = load_vehicle(file)
    if not isinstance(vehicle, Vehicle):
        raise ProofError(
            f"vehicle is {str(file)!r}, a consumption table, allowed: a vehicle that is given by its physics"
        )
    return CarrierVehicle(
        mass_kg=vehicle.mass_kg,
        drag_area_m2=2.0 * vehicle.road_load_c_n_per_mps2 / AIR_KG_PER_M3,
        capacity_kwh=vehicle.usable_capacity_wh / 1000.0,
        vehicle_toml=re.sub(r"(?m)^id = .*$", 'id = "vehicle"', file.read_text(encoding="utf-8"), count=1),
    )


def _whole(recording: Recording) -> bool:
    return recording.elevation_m is not None and recording.ambient_k is not None and not recording.gaps


def _carrier(recording: Recording) -> Carrier:
    assert recording.elevation_m is not None, "only whole recordings are asked"
    assert recording.ambient_k is not None, "only whole recordings are asked"
    end_s = np.floor(recording.time_s[-1] - recording.time_s[0] - 0.5)
    time_s = np.arange(1.0, end_s)
    since_s = recording.time_s - recording.time_s[0]
    step_j = 0.5 * (recording.power_w[1:] + recording.power_w[:-1]) * np.diff(since_s)
    drawn_j = np.concatenate(([0.0], np.cumsum(step_j)))
    ahead_j, behind_j = (np.interp(time_s + shift, since_s, drawn_j) for shift in (0.5, -0.5))
    channels = {
        "time_s": time_s - time_s[0],
        "speed_kmh": KMH_PER_MPS * np.interp(time_s, since_s, recording.speed_mps),
        "power_w": ahead_j - behind_j,
        "elevation_m": _known(time_s, since_s, recording.elevation_m),
        "ambient_c": _known(time_s, since_s, recording.ambient_k) - ZERO_CELSIUS_K,
    }
    if recording.battery_k is not None and not np.isnan(recording.battery_k).all():
        channels["battery_c"] = _known(time_s, since_s, recording.battery_k) - ZERO_CELSIUS_K
    if recording.soc_frac is not None and not np.isnan(recording.soc_frac).all():
        channels["soc_frac"] = _known(time_s, since_s, recording.soc_frac)
    return Carrier(recording.id, channels)


def _known(
    time_s: NDArray[np.float64], since_s: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    there = ~np.isnan(values)
    return np.asarray(np.interp(time_s, since_s[there], values[there]), np.float64)
