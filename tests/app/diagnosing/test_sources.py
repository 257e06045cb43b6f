"""Names of uploaded recordings."""

from __future__ import annotations

import pytest

from app.diagnosing.sources import uploaded_name
from app.errors.diagnosing import SourceError

pytestmark = pytest.mark.nojit


@pytest.mark.parametrize("filename", [".csv", "..csv", "...csv.gz", ".", "..", "", "a\0.csv", "\ud800.csv", "x" * 201])
def test_name_that_makes_no_address_of_a_trip_is_refused(filename: str) -> None:
    with pytest.raises(SourceError, match="the name of a file"):
        uploaded_name(filename, "recordings[0]")


@pytest.mark.parametrize(
    ("filename", "name"),
    [("a b+c.csv", "a b+c.csv"), ("C:\\trips\\é.csv", "é.csv"), ("../../etc/x.csv", "x.csv"), ("....csv", "....csv")],
)
def test_name_of_an_upload_is_kept_without_its_folders(filename: str, name: str) -> None:
    assert uploaded_name(filename, "recordings[0]") == name
