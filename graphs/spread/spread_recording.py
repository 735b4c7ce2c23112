# SPDX-License-Identifier: BSD-3-Clause
"""One recording on a worker, as seen from the process that solves: it asks, and writes down what must not be lost."""

from __future__ import annotations

from typing import Any

from jointscope.graphs.solving.normal_equations import parts_of
from jointscope.graphs.solving.stretch import Place
from jointscope.graphs.spread.distant_stretch import DistantStretch
from jointscope.graphs.spread.kept_recording import (
    Beginning,
    Key,
    Linearisation,
    Question,
    States,
    Visit,
    ask,
    forget,
    told_and_asked,
)
from jointscope.graphs.workers.crew import MOST_LOSSES, Crew, Pending, WorkerLost
from jointscope.robots.errors import ClusterError


class SpreadRecording:
    """A recording in one slot of a crew.

    Args:
        crew: the workers.
        slot: whose worker keeps it.
        key: names it.
        beginning: the recording and where it begins.

    Attributes:
        stretches: as the graph sees them.
    """

    def __init__(self, crew: Crew, slot: int, key: Key, beginning: Beginning):
        self._crew, self._slot, self._key, self._beginning = crew, slot, key, beginning
        self._log: list[Linearisation] = []
        self._asked: tuple[Pending, Question] | None = None
        self._told = False
        d, calibration, blocks = beginning.x.shape[1], beginning.calibration, beginning.blocks
        parts = parts_of(beginning.problem, beginning.length)
        self.stretches = tuple(DistantStretch((a, b), d, calibration, blocks) for a, b, _ in parts)

    def ask(self, question: Question) -> None:
        """Asks; the worker begins."""
        if self._told:
            pending = self._crew.submit(self._slot, ask, self._key, self._serial, question)
        else:
            pending = self._ask_with_everything(question)
        self._asked = pending, question

    def heard(self) -> None:
        """Waits for the answer and notes it."""
        assert self._asked is not None
        _, question = self._asked
        for stretch, answer in zip(self.stretches, self._answer(), strict=True):
            if isinstance(question, States):
                stretch.states, stretch.calibration = answer, question.place.calibration
            else:
                stretch.cost, stretch.costs = answer[:2]
            if isinstance(question, Linearisation):
                stretch.rim = answer[2:]
        if isinstance(question, Linearisation):
            if self._log and _same(self._log[-1].place, question.place):
                self._log.pop()  # only the last damping says how inner states follow from a place
            self._log.append(question)

    def visit(self, place: Place) -> None:
        """Asks for the cost at a place."""
        self.ask(Visit(place))

    def linearise(self, place: Place, damping: float, bends: Any) -> None:
        """Asks for what is left at a place; damping and bends as of `RecordingStretch.damp`."""
        self.ask(Linearisation(self._serial + 1, place, damping, bends))

    def forget(self) -> None:
        """The worker drops what it keeps."""
        try:
            self._crew.submit(self._slot, forget, self._key).result()
        except WorkerLost:
            pass

    @property
    def _serial(self) -> int:
        return self._log[-1].serial if self._log else 0

    def _ask_with_everything(self, question: Question) -> Pending:
        self._told = True
        return self._crew.submit(self._slot, told_and_asked, self._key, self._beginning, tuple(self._log), question)

    def _answer(self) -> Any:
        """The answer, of another worker where one died."""
        assert self._asked is not None
        pending, question = self._asked
        for _ in range(MOST_LOSSES):
            try:
                answer = pending.result()
                if answer is not None:
                    return answer
            except WorkerLost:
                pass
            pending = self._ask_with_everything(question)
        raise ClusterError(
            f"{self._crew.name}: {MOST_LOSSES} workers in a row died over {self._beginning.problem.recording.path}; "
            "most often their memory is too small: give them more, or fewer recordings"
        )


def _same(one: Place, other: Place) -> bool:
    """Whether two places are one, to the last digit."""
    pairs = zip(one.ends, other.ends, strict=True)
    return all((a == c).all() and (b == d).all() for (a, b), (c, d) in pairs) and one.calibration.is_at(
        other.calibration
    )
