"""Processes of Dask: every call comes back, each has one thread for linear algebra, and one that dies is named."""

from __future__ import annotations

import os
from operator import floordiv
from typing import TYPE_CHECKING

import pytest

from proof.errors import ProofError
from proof.scheduling import workers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from proof.scheduling import ProofWorkers


@pytest.fixture(scope="module")
def spread() -> Iterator[ProofWorkers]:
    with workers(1) as found:
        yield found


def test_every_call_comes_back_with_its_place(spread: ProofWorkers) -> None:
    assert sorted(spread.each(pow, [(2, 3), (3, 2), (2, 3)])) == [(0, 8), (1, 9), (2, 8)]
    assert list(spread.each(pow, [])) == []


def test_a_process_has_one_thread_for_linear_algebra(spread: ProofWorkers) -> None:
    assert list(spread.each(os.getenv, [("OPENBLAS_NUM_THREADS",)])) == [(0, "1")]


def test_what_a_call_raises_is_raised(spread: ProofWorkers) -> None:
    with pytest.raises(ZeroDivisionError):
        list(spread.each(floordiv, [(1, 1), (1, 0)]))


def test_a_process_that_dies_is_named_and_another_takes_its_place(spread: ProofWorkers) -> None:
    with pytest.raises(ProofError, match="a worker died"):
        list(spread.each(os._exit, [(1,)]))
    assert list(spread.each(floordiv, [(6, 3)])) == [(0, 2)]
