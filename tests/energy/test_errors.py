"""What the energy package's errors say."""

from __future__ import annotations

from energy.errors import VehicleNotFoundError

KNOWN = ("kia-ev6", *(f"other-{k}" for k in range(20)), "renault-zoe-r90", "renault-zoe-ze50")


def test_error_of_an_unknown_vehicle_names_all_where_they_are_few() -> None:
    error = VehicleNotFoundError("delorean", ("a-car", "b-car"))
    assert str(error) == "vehicle 'delorean' is unknown, known: a-car, b-car"
    assert error.allowed == "one of a-car, b-car"


def test_error_of_an_unknown_vehicle_names_those_most_like_it_first() -> None:
    error = VehicleNotFoundError("renault-zoe-ze5", KNOWN)
    assert error.allowed.startswith("one of renault-zoe-ze50, renault-zoe-r90, ")
    assert error.known == KNOWN


def test_error_of_an_unknown_vehicle_that_is_like_none_says_how_many_there_are() -> None:
    named = VehicleNotFoundError("!", KNOWN).allowed
    assert named.startswith("one of kia-ev6, other-0, ")
    assert named.endswith(", other-8 and 13 more")
