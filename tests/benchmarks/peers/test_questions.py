"""Engines asked line by line, in a process of their own."""

from __future__ import annotations

import sys

import pytest

from benchmarks.peers.environments import PeerUnavailableError
from benchmarks.peers.questions import EngineAnswer, Question, answer_of, line_of, question_of
from benchmarks.peers.valhalla_worker import decoded
from benchmarks.peers.worker import working

NOISY = """
from benchmarks.peers.questions import EngineAnswer, serve
def load():
    print("loading")
    def ask(question):
        print("asked")
        if question.budget < 0.0:
            raise ValueError("budget below 0")
        return EngineAnswer(seconds=question.budget, ends=(question.start, question.start))
    return ask
serve(load)
"""


@pytest.mark.parametrize(
    "question", [Question((41.2, -8.6), (41.0, -8.5)), Question((41.2, -8.6), None, 15.0), Question((0.0, 0.0))]
)
def test_question_survives_its_line(question) -> None:
    assert question_of(line_of(question)) == question


@pytest.mark.parametrize(
    "answer",
    [
        EngineAnswer(0.1, 0.05, 100, 25_000.0, 3.5, ((41.2, -8.6), (41.0, -8.5))),
        EngineAnswer(0.1, size_bytes=7, reached=12, shape=[[[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]]]),
        EngineAnswer(refused="no way"),
    ],
)
def test_answer_survives_its_line(answer) -> None:
    assert answer_of(line_of(answer)) == answer


def test_worker_answers_and_refuses_whatever_its_libraries_print(tmp_path) -> None:
    log = tmp_path / "log"
    with working("Engine", [sys.executable, "-c", NOISY], log) as worker:
        assert worker.ask(Question((1.0, 2.0), None, 0.5)) == EngineAnswer(seconds=0.5, ends=((1.0, 2.0), (1.0, 2.0)))
        assert worker.ask(Question((1.0, 2.0), None, -1.0)).refused == "ValueError: budget below 0"
        assert worker.ask(Question((1.0, 2.0), None, 0.25)).seconds == 0.25
    assert "loading" in log.read_text()


@pytest.mark.parametrize("script", ["import nothing_of_this_name", "print('ready'); import nothing_of_this_name"])
def test_worker_that_ends_says_why(script, tmp_path) -> None:
    with (
        pytest.raises(PeerUnavailableError, match=r"^Engine left out: ModuleNotFoundError: No module named"),
        working("Engine", [sys.executable, "-c", script], tmp_path / "log") as worker,
    ):
        worker.ask(Question((1.0, 2.0)))


def test_polyline_of_the_format_s_description_is_read_with_six_decimals() -> None:
    # the example of the format has five decimals: (38.5, -120.2), (40.7, -120.95), (43.252, -126.453)
    found = decoded("_p~iF~ps|U_ulLnnqC_mqNvxq`@")
    assert [place[0] for place in found] == pytest.approx([3.85, 4.07, 4.3252])
    assert [place[1] for place in found] == pytest.approx([-12.02, -12.095, -12.6453])
