# SPDX-License-Identifier: BSD-3-Clause
"""Adds effects one by one to a robot with free links, as long as seconds that were not fitted are explained better.

Of the training recordings every other second is fitted and the seconds between validate. The held-out recording is
scored once per step and never chooses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.discovery.verdicts import MOST
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.transmission.candidates import Candidate, candidates, columns_of, may_be_added
from jointscope.graphs.transmission.equation import Equation
from jointscope.graphs.transmission.look_alikes import look_alikes
from jointscope.graphs.transmission.position_ripple import EFFECT as RIPPLE
from jointscope.graphs.transmission.position_ripple import strongest_order, with_order
from jointscope.graphs.transmission.regression import errors, fitted, one_block, parts, spread, total, without_block
from jointscope.graphs.transmission.step_sentences import what_changed
from jointscope.graphs.transmission.transmission_model import TransmissionModel, fit
from jointscope.graphs.transmission.transmission_result import TransmissionDiscovery, TransmissionStep
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.screening import screen

Array = NDArray[np.float64]

BLOCK = 1.0  # [s] fitted and validated in turn
MATTERS = 0.05  # share of the squared error of the equations concerned that an effect must explain
SEARCHED = 0.1  # the same for a ripple whose order is the best of hundreds
SURE = 3.0  # [sigma] a size must be away from zero
QUARTERS = 4  # of the recordings, left out one by one
MOST_STEPS = 12


@in_solver_context
def discover_transmission(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None = None,
    max_steps: int = MOST_STEPS,
    progress: Progress | None = None,
) -> TransmissionDiscovery:
    """Finds the effects that motors, links and gyros show of each other.

    Args:
        robot: with link_dynamics free.
        recordings: for training.
        holdout: scored once per step.
        max_steps: effects to add at the most.
        progress: called with a text and the share done, from 0 to 1.

    Raises:
        RecordingError: a recording does not hold what the robot needs.
    """
    report = progress or (lambda text, share: None)
    report("rigid joints", 0.0)
    for recording in [*recordings, *([holdout] if holdout is not None else [])]:
        screen(recording, robot)
    model = fit(robot, recordings)
    steps = [_step(None, model, recordings, holdout, (), "Rigid joints, all sensors in time.")]
    refused: dict[str, str] = {}
    while len(steps) <= max_steps:
        report(f"looking for effect {len(steps)}", len(steps) / (max_steps + 1))
        found, refused = _best(model, recordings)
        if found is None:
            break
        chosen = (*model.chosen, found)
        alike, sentence = look_alikes(model, recordings, found)
        model = fit(robot, recordings, chosen)
        step = _step(found, model, recordings, holdout, alike, sentence)
        steps.append(replace(step, paragraph=f"{sentence} {_told(found, steps[-1], step, recordings)}"))
    stop = "no effect explains more of the seconds that were not fitted and holds on quarters that were left out whole"
    if len(steps) > max_steps:
        stop = f"{max_steps} effects were added, the largest number allowed"
    return TransmissionDiscovery(tuple(steps), tuple(recordings), holdout, stop, refused, model.sigmas(recordings))


def fit_blocks(equation: Equation) -> NDArray[np.bool_]:
    """Samples that are fitted."""
    return np.floor(equation.times / BLOCK).astype(int) % 2 == 0


def validation_blocks(equation: Equation) -> NDArray[np.bool_]:
    """Samples that judge."""
    return ~fit_blocks(equation)


def _best(model: TransmissionModel, recordings: Sequence[Recording]) -> tuple[Candidate | None, dict[str, str]]:
    """The candidate that explains most, None if none does enough; and why the others were refused."""
    equations = model.equations(recordings)
    before = _validated(equations, model.names)
    blocks = _by_block(equations, model.names)
    gains: list[tuple[float, Candidate]] = []
    refused: dict[str, str] = {}
    for candidate in _with_orders(model, equations):
        names = columns_of(model.robot, (*model.chosen, candidate))
        own = with_order(equations, candidate)
        after = _validated(own, names)
        concerned = {e.name for e in _concerned(candidate, own)}
        old, new = (sum(found[name] ** 2 for name in concerned) for found in (before, after))
        share = (old - new) / old if old > 0.0 else 0.0
        why = _why_not(candidate, own, names, share)
        why = why or _helps_rarely(blocks, _by_block(own, names), concerned)
        why = why or _fails_elsewhere(own, model.names, names, concerned)
        if why:
            refused[candidate.label] = why
        else:
            gains.append((total(before) ** 2 - total(after) ** 2, candidate))
    if not gains:
        return None, refused
    return max(gains, key=lambda pair: pair[0])[1], refused


def _concerned(candidate: Candidate, equations: Sequence[Equation]) -> list[Equation]:
    """The equations in which an effect acts."""
    return [e for e in equations if any(size in e.columns for size in candidate.sizes)]


def _with_orders(model: TransmissionModel, equations: Sequence[Equation]) -> list[Candidate]:
    """What may be added; a ripple both at one period per turn and at the order that stands out."""
    found = [c for c in candidates(model.robot) if may_be_added(c, model.chosen)]
    sizes = fitted(parts(equations, model.names, fit_blocks))
    for candidate in [c for c in found if c.effect == RIPPLE]:
        order = strongest_order(equations, model.names, sizes, candidate.owner, fit_blocks)
        if order is not None:
            found.append(Candidate(RIPPLE, candidate.owner, order))
    return found


def _why_not(candidate: Candidate, equations: Sequence[Equation], names: Sequence[str], share: float) -> str:
    """Why a candidate is refused; empty if it is not."""
    searched = candidate.effect == RIPPLE and candidate.order != 1.0
    if share < (SEARCHED if searched else MATTERS):
        return f"explains {100 * max(share, 0.0):.1f} % of what is left in the seconds that were not fitted"
    own = [list(names).index(size) for size in candidate.sizes]
    sizes = fitted(parts(equations, names))[own]
    if candidate.one_sided and np.any(sizes < 0.0):
        return f"would explain {100 * share:.0f} %, but with a size of {sizes[0]:.3g}, and only sizes above zero exist"
    if not np.any(np.abs(sizes) > SURE * spread(equations, names)[own]):
        return f"would explain {100 * share:.0f} %, but with a size that blocks of the recording do not agree about"
    return ""


def _by_block(equations: Sequence[Equation], names: Sequence[str]) -> dict[tuple[str, int, int], float]:
    """Mean squared error of each second that was not fitted [sigma^2], by equation, its place and block."""
    sizes, found = fitted(parts(equations, names, fit_blocks)), {}
    for place, equation in enumerate(equations):
        for piece in parts([equation], names, validation_blocks):
            left = (piece.error - piece.columns @ sizes).reshape(-1, equation.error.shape[1])
            number = np.floor(equation.times[validation_blocks(equation)] / BLOCK).astype(int)
            for block in np.unique(number):
                found[equation.name, place, int(block)] = float(np.mean(left[number == block] ** 2))
    return found


def _helps_rarely(
    before: dict[tuple[str, int, int], float], after: dict[tuple[str, int, int], float], concerned: set[str]
) -> str:
    """Why a candidate that helps in few blocks is refused; empty if it helps in most.

    Seconds that leave no more than the noise of the sensors, as those at rest do, cannot tell and are not asked.
    """
    helped = [after[key] < old for key, old in before.items() if key[0] in concerned and old > 1.0]
    if not helped:
        return "leaves nothing to explain: what is left in the seconds that were not fitted is the noise of the sensors"
    share = float(np.mean(helped))
    if share >= MOST:
        return ""
    return f"would explain more on the whole, but helps in {100 * share:.0f} % only of the seconds that were not fitted"


def _fails_elsewhere(
    equations: Sequence[Equation], before: Sequence[str], after: Sequence[str], concerned: set[str]
) -> str:
    """Why a candidate that helps between the seconds that were fitted is refused; empty if it helps further away, too.

    Seconds next to each other hold the same motion; what only repeats there fails on a quarter that was left out whole.
    """
    old, new = (sum(_quarter_squares(equations, names, concerned)) for names in (before, after))
    if new < old:
        return ""
    return "would help between the seconds that were fitted, but not on quarters of the recordings left out whole"


def _quarter_squares(equations: Sequence[Equation], names: Sequence[str], concerned: set[str]) -> Iterator[float]:
    """Squared error of each quarter of the recordings under the fit of the others [sigma^2]."""
    judged = [e for e in equations if e.name in concerned]
    for k in range(QUARTERS):
        sizes = fitted(parts(equations, names, without_block(k, QUARTERS)))
        for piece in parts(judged, names, one_block(k, QUARTERS)):
            yield float(np.sum((piece.error - piece.columns @ sizes) ** 2))


def _validated(equations: Sequence[Equation], names: Sequence[str]) -> dict[str, float]:
    """Errors on the seconds that were not fitted [sigma]."""
    return errors(parts(equations, names, validation_blocks), fitted(parts(equations, names, fit_blocks)))


def _told(added: Candidate, before: TransmissionStep, after: TransmissionStep, recordings: Sequence[Recording]) -> str:
    """What a step changed, on the held-out recording where there is one."""
    model = after.model
    units = {e.name: (e.sigma, e.unit) for e in _concerned(added, model.equations(recordings))}
    sigmas = model.sigmas(recordings)
    if after.heldout:
        return what_changed(added, model, sigmas, units, (before.heldout, after.heldout), "the held-out recording")
    return what_changed(added, model, sigmas, units, (before.train, after.train), "the training recordings")


def _step(
    added: Candidate | None,
    model: TransmissionModel,
    recordings: Sequence[Recording],
    holdout: Recording | None,
    alike: tuple[str, ...],
    sentence: str,
) -> TransmissionStep:
    train = model.errors(recordings)
    held = model.errors([holdout]) if holdout is not None else {}
    return TransmissionStep(added.label if added else None, model, train, held, alike, sentence)
