"""The families of causes, in the field's words."""

from __future__ import annotations

from enum import StrEnum


class Family(StrEnum):
    """What kind of cause a finding belongs to."""

    THERMAL = "thermal"
    ROLLING = "rolling"
    AERODYNAMIC = "aerodynamic"
    WIND = "wind"
    MASS = "mass"
    GRADE = "grade"
    DRIVETRAIN = "drivetrain"
    RECUPERATION = "recuperation"
    BATTERY = "battery"
    AUXILIARY = "auxiliary"
    PROFILE = "profile"
    UNEXPLAINED = "unexplained"
