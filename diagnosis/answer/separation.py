"""What a reader is told of an effect: a sentence, and the drive that would tell it from another."""

from __future__ import annotations

from typing import Final

from diagnosis.causes.families import Family

SENTENCES: Final = {
    "cabin_heating": "Heating the cabin in the cold",
    "air_conditioning": "Cooling the cabin in the heat",
    "battery_heating": "Heating a cold battery",
    "battery_cooling": "Cooling a warm battery",
    "rolling_temperature": "Tyres that roll harder in the cold",
    "tyre_warm_up": "Tyres that roll harder until they are warm",
    "wet_road": "Water on the road",
    "cornering": "Tyres that drag in bends",
    "air_density": "Denser air in the cold and at low altitude",
    "wind": "Head and tail wind",
    "side_wind": "Side wind",
    "steady_wind": "A steady wind that was not recorded",
    "payload": "The recorded payload",
    "power_loss": "Losses that grow with power",
    "load_loss": "Losses of the drive that grow with load",
    "battery_resistance": "Resistance of the battery, as its voltage tells it,",
    "cold_battery": "Resistance of a cold battery",
    "recuperation_cap": "A cap on what recuperation gives back",
    "recuperation_low_speed": "Recuperation that ends at low speed",
    "friction_blending": "Friction brakes that take part in hard braking",
    "recuperation_cold": "Recuperation that is weaker in the cold",
    "recuperation_full": "Recuperation that is weaker with a full battery",
    "roof_load": "More drag on some trips, as by a roof box",
    "trip_payload": "More mass on some trips",
    "trip_rolling": "More rolling resistance on some trips, as by tyres or road",
    "trip_power": "A constant draw on some trips, as by something that was left on",
    "trip_grade": "Climbs on some trips, of which no height was recorded",
}

# what tells two families apart, by the pair
SEPARATING: Final = {
    frozenset((Family.THERMAL, Family.ROLLING)): (
        "ten minutes at standstill, ready to drive, in the same weather, and a restart after a short pause: the cabin"
        " draws then, tyres do not"
    ),
    frozenset((Family.THERMAL, Family.AERODYNAMIC)): (
        "standstill of ten minutes in the same weather, and one steady drive each at 50 and at 120 km/h: heat does not"
        " grow with speed, drag does"
    ),
    frozenset((Family.THERMAL, Family.DRIVETRAIN)): (
        "ten minutes at standstill in the same weather: losses of the drive need load, climate does not"
    ),
    frozenset((Family.THERMAL, Family.RECUPERATION)): (
        "ten minutes at standstill in the same weather, and a long steady drive without braking"
    ),
    frozenset((Family.THERMAL, Family.BATTERY)): (
        "ten minutes at standstill in the same weather: resistance needs current, climate does not"
    ),
    frozenset((Family.ROLLING, Family.AERODYNAMIC)): (
        "steady drives of ten minutes each at 40, 80 and 120 km/h at one temperature: rolling resistance does not grow"
        " with speed, drag does"
    ),
    frozenset(
        (Family.ROLLING, Family.MASS)
    ): "a hilly drive there and back: mass is given back downhill, rolling is not",
    frozenset((Family.ROLLING, Family.RECUPERATION)): (
        "a long steady drive without braking at the same temperature: recuperation has no part in it"
    ),
    frozenset((Family.ROLLING, Family.DRIVETRAIN)): (
        "a long climb at low speed and a steady drive on the flat: load loss grows with force, rolling does not"
    ),
    frozenset(
        (Family.ROLLING, Family.WIND)
    ): "the same road there and back on one day: wind turns its sign, rolling does not",
    frozenset((Family.AERODYNAMIC, Family.WIND)): (
        "the same road there and back on one day at one speed: wind turns its sign, air density does not"
    ),
    frozenset((Family.AERODYNAMIC, Family.DRIVETRAIN)): (
        "a steep climb at low speed and a fast drive on the flat: load loss grows with force, drag with speed"
    ),
    frozenset((Family.AERODYNAMIC, Family.MASS)): "a hilly drive at low speed, where drag has little part",
    frozenset((Family.DRIVETRAIN, Family.BATTERY)): (
        "the same power once at low speed uphill and once at high speed on the flat: the battery sees power, the motor"
        " sees force"
    ),
    frozenset((Family.DRIVETRAIN, Family.RECUPERATION)): "a long climb, in which nothing is given back",
    frozenset((Family.BATTERY, Family.RECUPERATION)): "a long climb, in which nothing is given back",
    frozenset((Family.MASS, Family.DRIVETRAIN)): "gentle drives over hills, in which force stays small",
}


def sentence(effect: str) -> str:
    """What an effect is, in words that begin a sentence."""
    return SENTENCES.get(effect, effect.replace("_", " ").capitalize())


def separating(family: Family, other: Family) -> str:
    """The recording that would tell two families apart."""
    known = SEPARATING.get(frozenset((family, other)))
    if known is not None:
        return known
    return f"drives in which the cause of {family.value} effects changes while that of {other.value} effects does not"
