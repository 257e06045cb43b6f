"""Least sums over a graph of states."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import csr_array

from routing.pareto.all_ways import least_to

pytestmark = pytest.mark.nojit


def test_arcs_of_no_weight_are_arcs_and_the_lighter_of_parallel_ones_counts():
    # 0 to 1 with 5 and with 2, 1 to 2 with 0; no arc from 3
    arcs = csr_array(
        (np.array([5.0, 2.0, 0.0]), np.array([1, 1, 2], np.int32), np.array([0, 2, 3, 3, 3])), shape=(4, 4)
    )
    assert least_to(arcs, np.array([2])).tolist() == [2.0, 0.0, 0.0, math.inf]
    assert least_to(arcs, np.array([2]), most=1.0).tolist() == [math.inf, 0.0, 0.0, math.inf]


def test_the_nearest_goal_counts_also_where_one_is_named_twice():
    # 0 to 1 with 3, 1 to 2 with 4
    arcs = csr_array((np.array([3.0, 4.0]), np.array([1, 2], np.int32), np.array([0, 1, 2, 2])), shape=(3, 3))
    assert least_to(arcs, np.array([2, 1, 2])).tolist() == [3.0, 0.0, 0.0]
