"""Energy of a drive, and a chain that runs north."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from energy.chain.chain import simulate_chain
from energy.conditions import STILL


def energy_j(vehicle, chain, conditions=STILL, **options):
    return simulate_chain(vehicle, chain, conditions=conditions, **options).energy_j


def north(chain):
    return replace(chain, heading=np.tile([0.0, 1.0], (chain.length_m.size, 1)))
