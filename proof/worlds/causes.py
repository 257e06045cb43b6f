"""The effects that a world can hide: family, standard size, largest that is still believable, and what shows them."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from proof.worlds.loop import LoopTerrain

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True)
class Cause:
    """One effect of the generator.

    strength: the field of dynamics.Strengths that switches it on. most: largest strength that a car or a day could
    have. sizes: energy shares that it can reach within that. channels: those without which nobody could find it.
    regime: fields of trips.Regime under which it acts; regime_by_size: further ones for a size.
    """

    name: str
    family: str
    strength: str
    most: float
    sizes: tuple[float, ...] = (0.02, 0.05, 0.12)
    channels: tuple[str, ...] = ()
    regime: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    regime_by_size: Mapping[float, Mapping[str, Any]] = field(default_factory=lambda: MappingProxyType({}))

    def regime_for(self, share: float) -> dict[str, Any]:
        """Fields of trips.Regime under which it can take this share of the energy."""
        return {**self.regime, **self.regime_by_size.get(share, {})}


_COLD: Final = MappingProxyType({"air_c": (-12.0, 24.0)})
_HOT: Final = MappingProxyType({"air_c": (8.0, 39.0)})
_FAST: Final = MappingProxyType({"mix": (0.15, 0.35, 0.5)})
# Air can't be made thinner than it is: its size is set by where and when the drives are.
_THIN_AIR: Final = MappingProxyType(
    {"mix": (0.1, 0.3, 0.6), "air_c": (-15.0, 38.0), "terrain": LoopTerrain(200.0, 150.0)}
)
_MOUNTAINS: Final = MappingProxyType({"terrain": LoopTerrain(650.0, 1000.0, 0.02)})
_LONG_LOADED: Final = MappingProxyType({"payload_share": 0.9})
_SLOW_AND_COLD: Final = MappingProxyType({"mix": (0.4, 0.6, 0.0), "air_c": (-22.0, 8.0)})
_DOWN_TOWN: Final = MappingProxyType({"mix": (0.7, 0.3, 0.0)})
_HILLS: Final = MappingProxyType({"mix": (0.5, 0.5, 0.0), "terrain": LoopTerrain(300.0, 200.0, 0.032)})
_COLD_HILLS: Final = MappingProxyType({**_HILLS, "air_c": (-15.0, 25.0)})
_ROOF: Final = MappingProxyType({"mix": (0.1, 0.3, 0.6), "roof_share": 0.4})
_LOADED: Final = MappingProxyType({**_HILLS, "payload_share": 0.6})

CAUSES: Final = {
    cause.name: cause
    for cause in (
        Cause("cabin_heating", "thermal", "cabin_heating", 2.5, regime=_COLD),
        Cause("air_conditioning", "thermal", "air_conditioning", 3.0, regime=_HOT),
        Cause("battery_conditioning", "thermal", "battery_conditioning", 3.0, channels=("battery_c",), regime=_COLD),
        Cause(
            "tyre_temperature", "rolling", "tyre_temperature", 2.5, regime=_COLD, regime_by_size={0.12: _SLOW_AND_COLD}
        ),
        Cause("wet_road", "rolling", "wet_road", 3.5, channels=("wet",)),
        Cause(
            "air_density",
            "aerodynamic",
            "air_density",
            1.3,
            (0.02, 0.05),
            regime=_THIN_AIR,
            regime_by_size={0.05: _MOUNTAINS},
        ),
        Cause("roof_box", "aerodynamic", "roof_box", 3.5, regime=_ROOF),
        Cause(
            "wind_known", "wind", "wind", 2.5, channels=("heading_deg", "wind_speed_mps", "wind_from_deg"), regime=_FAST
        ),
        Cause("wind_unknown", "wind", "wind", 2.5, channels=("heading_deg",), regime=_FAST),
        Cause(
            "payload_known",
            "mass",
            "payload",
            2.8,
            channels=("payload_kg",),
            regime=_LOADED,
            regime_by_size={0.12: _LONG_LOADED},
        ),
        Cause("payload_unknown", "mass", "payload", 2.8, regime=_LOADED, regime_by_size={0.12: _LONG_LOADED}),
        Cause("copper_loss", "drivetrain", "copper_loss", 8.0, regime=_HILLS),
        Cause("regen_cap", "recuperation", "regen_cap", 4.0, regime=_HILLS),
        Cause("regen_cold", "recuperation", "regen_cold", 2.0, channels=("battery_c",), regime=_COLD_HILLS),
        Cause("regen_cutoff", "recuperation", "regen_cutoff", 8.0, (0.02, 0.05), regime=_DOWN_TOWN),
        Cause(
            "resistance_known",
            "battery",
            "battery_resistance",
            4.0,
            (0.02, 0.05),
            channels=("voltage_v", "current_a"),
            regime=_HILLS,
        ),
        Cause("resistance_unknown", "battery", "battery_resistance", 4.0, (0.02, 0.05), regime=_HILLS),
    )
}
