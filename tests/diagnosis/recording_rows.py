"""Rows of recording files: a drive that gains and loses speed again and again."""

from __future__ import annotations

import numpy as np

I3_HEADER = (
    "Time [s];Velocity [km/h];Elevation [m];Regenerative Braking Signal ;Battery Voltage [V];Battery Current [A];"
    "Battery Temperature [°C];SoC [%];Heating Power CAN [kW];AirCon Power [kW];Ambient Temperature [°C];"
    "Temperature Vent right [°C] ;Temperature Vent right [°C]"
)
SAMPLES = 600


def i3_rows(count=SAMPLES, step_s=0.1):
    """A drive that gains and loses speed again and again; power follows, the heater is on, and the SoC falls."""
    rows = []
    for k in range(count):
        phase = 2.0 * np.pi * k / 100.0
        speed_kmh = 40.0 - 40.0 * np.cos(phase)
        current_a = -(5.0 + 60.0 * np.sin(phase) + 0.01 * (k % 7))
        rows.append(
            [
                f"{step_s * k:g}",
                f"{speed_kmh:.2f}",
                f"{500 + k / 100:.2f}",
                "0",
                "380",
                f"{current_a:.2f}",
                "12",
                f"{80.0 - 0.02 * k:.2f}",
                "1.5",
                "0",
                "-2.5",
                "9",
                "8",
            ]
        )
    return rows


def plain_rows(count=SAMPLES, step_s=1.0):
    rows = []
    for k in range(count):
        phase = 2.0 * np.pi * k / 100.0
        power_w = 2000.0 + 20_000.0 * np.sin(phase) + k % 7
        rows.append([f"{step_s * k:g}", f"{40.0 - 40.0 * np.cos(phase):.4f}", f"{power_w:.3f}"])
    return rows


def with_column(rows, name, values):
    """Header and rows of a plain file with one more column."""
    return f"time_s,speed_kmh,power_w,{name}", [[*row, value] for row, value in zip(rows, values, strict=True)]
