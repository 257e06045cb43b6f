"""Encoded polylines: the published example, and back again for any line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from openrouteservice import convert

from app.http.faces.polylines import decoded, encoded

# from Google's documentation of the format: (38.5, -120.2), (40.7, -120.95), (43.252, -126.453)
PUBLISHED = np.array([[-120.2, 38.5], [-120.95, 40.7], [-126.453, 43.252]])
PUBLISHED_TEXT = "_p~iF~ps|U_ulLnnqC_mqNvxq`@"


def test_published_line_is_encoded_and_decoded_as_published() -> None:
    assert encoded(PUBLISHED, 5) == PUBLISHED_TEXT
    assert np.array_equal(decoded(PUBLISHED_TEXT, 5), PUBLISHED)


@given(
    st.lists(st.tuples(st.integers(-180_000_000, 180_000_000), st.integers(-90_000_000, 90_000_000)), min_size=1),
    st.sampled_from([5, 6]),
)
def test_any_line_comes_back_to_its_last_decimal(line: list[tuple[int, int]], decimals: int) -> None:
    places = np.array(line) / 1e6
    assert decoded(encoded(places, decimals), decimals) == pytest.approx(
        places.round(decimals), abs=0.6 * 10**-decimals
    )


def test_line_with_heights_is_read_by_openrouteservices_decoder() -> None:
    text = encoded(PUBLISHED, 5, np.array([12.3, -3.0, 8848.9]))
    places = convert.decode_polyline(text, True)["coordinates"]
    assert places == [[-120.2, 38.5, 12.3], [-120.95, 40.7, -3.0], [-126.453, 43.252, 8848.9]]


@pytest.mark.parametrize("text", ["", "_", "_p~iF", "p p", "ü?", "~" * 60, "\x7f?"])
def test_what_is_no_encoded_line_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        decoded(text, 5)
