"""Compiled: the columns in which kernels book the energy of a drive by cause.

Each is named as the cause in energy.force.parts.Part, the enumeration of all of them; causes that have no column are
split off these afterwards, by energy.force.effects.
"""

from __future__ import annotations

PART_COUNT = 15


(
    ROLLING,
    LINEAR,
    AERO,
    GRADE,
    INERTIA,
    DRIVETRAIN_LOSS,
    RECUPERATION_LOSS,
    AUXILIARY,
    WIND,
    REGEN_LIMIT,
    LOAD_LOSS,
    BATTERY_RESISTANCE,
    CABIN,
    CONSUMPTION_TABLE,
    TYRE_WARM_UP,
) = range(PART_COUNT)
