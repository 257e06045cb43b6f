"""Recordings on graphs with copies of links and with ferries: both are no roads that anybody drives on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.matching.map_matcher import MapMatcher
from routing.graph.ferries import Ferries
from routing.graph.link_bans import LinkBan, carried
from tests.diagnosis.map_drives import link_between, steady, whole

WAY = [3, 4, 5, 6, 10, 9]


@pytest.mark.nojit
def test_a_drive_is_matched_to_links_and_not_to_their_copies_even_where_it_breaks_the_ban(town):
    chain = tuple(link_between(town, a, b) for a, b in ((4, 5), (5, 6), (6, 10)))
    banned, left = carried(town, [LinkBan((chain,), only=False)])
    assert left == 0
    assert banned.copies is not None
    drive = steady(town, whole(town, WAY))
    ours, theirs = MapMatcher(banned).match(drive.recording), MapMatcher(town).match(drive.recording)
    assert np.array_equal(ours.link, drive.link)
    assert np.array_equal(ours.link, theirs.link)
    assert np.array_equal(ours.position_m, theirs.position_m)
    assert ours.gaps == ()


@pytest.mark.nojit
def test_no_sample_is_matched_to_a_ferry(town):
    aboard = [link_between(town, 5, 6), link_between(town, 6, 5)]
    sound = replace(town, ferries=Ferries(np.array(sorted(aboard), np.int64), np.array([600.0, 600.0])))
    drive = steady(town, whole(town, WAY))
    match = MapMatcher(sound).match(drive.recording)
    assert not np.isin(match.link, aboard).any()
    ashore = ~np.isin(drive.link, aboard)
    assert np.mean(match.link[ashore] == drive.link[ashore]) > 0.9
