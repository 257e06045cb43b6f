"""Compiled: the columns in which kernels book the energy of a drive by cause."""

from __future__ import annotations

PART_COUNT = 15


(
    ROLLING,
    LINEAR,
    AERO,
    GRADE,
    INERTIA,
    DRIVE_LOSS,
    RECUPERATION_LOSS,
    AUXILIARY,
    WIND,
    REGEN_LIMIT,
    LOAD_LOSS,
    RESISTANCE_LOSS,
    CABIN,
    TABLE,
    WARM_UP,
) = range(15)
