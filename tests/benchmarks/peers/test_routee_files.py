"""A graph in the files of RouteE Compass, and the names of a newer glibc."""

from __future__ import annotations

import gzip

import pytest

from benchmarks.peers import routee
from benchmarks.peers.environments import PeerUnavailableError
from benchmarks.peers.routee_files import EDGES, GEOMETRIES, GRADES, HEADINGS, SPEEDS, VERTICES, write_compass_files


@pytest.fixture(scope="module")
def written(corner, tmp_path_factory):
    folder = tmp_path_factory.mktemp("compass") / "data"
    write_compass_files(corner, folder)
    return lambda name: gzip.decompress((folder / name).read_bytes()).decode().splitlines()


def test_nodes_and_links_keep_their_numbers_places_and_lengths(written) -> None:
    assert written(VERTICES) == [
        "vertex_id,x,y",
        "0,0.0000000,0.0000000",
        "1,0.0100000,0.0100000",
        "2,0.0000000,0.0200000",
    ]
    assert written(EDGES) == [
        "edge_id,src_vertex_id,dst_vertex_id,distance",
        "0,0,1,2000.000",
        "1,0,2,2000.000",
        "2,1,0,2000.000",
        "3,2,0,2000.000",
    ]


def test_speeds_are_in_kilometres_an_hour_and_grades_are_rise_over_length(written) -> None:
    assert written(SPEEDS) == ["90.0"] * 4  # 25 m/s
    assert written(GRADES) == ["0.0000", "0.0100", "0.0000", "-0.0100"]  # 20 m on 2000 m


def test_headings_are_those_of_the_first_and_the_last_piece(written) -> None:
    # east then north; north; back south then west; south
    assert written(HEADINGS) == ["arrival_heading,departure_heading", "90,0", "0,0", "180,270", "180,180"]


def test_lines_run_in_driving_direction_by_longitude_and_latitude(written) -> None:
    lines = written(GEOMETRIES)
    assert lines[1] == "LINESTRING (0.0000000 0.0000000, 0.0000000 0.0200000)"
    assert lines[3] == "LINESTRING (0.0000000 0.0200000, 0.0000000 0.0000000)"
    assert len(lines) == 4


def test_every_newer_name_calls_the_older_one_of_its_own_type() -> None:
    functions = routee.newer_names_source().splitlines()[1:]
    assert functions == [
        "long __isoc23_strtol(const char *text, char **end, int radix) { return strtol(text, end, radix); }",
        "unsigned long __isoc23_strtoul(const char *text, char **end, int radix) { return strtoul(text, end, radix); }",
        "long long __isoc23_strtoll(const char *text, char **end, int radix) { return strtoll(text, end, radix); }",
        "unsigned long long __isoc23_strtoull"
        "(const char *text, char **end, int radix) { return strtoull(text, end, radix); }",
    ]


def test_an_older_glibc_without_a_compiler_is_named_in_one_line(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(PeerUnavailableError) as raised:
        routee.compiled(routee.newer_names_source(), tmp_path)
    assert str(raised.value) == (
        "RouteE Compass left out: needs glibc >= 2.38, or a C compiler to stand in for its newer names"
    )
