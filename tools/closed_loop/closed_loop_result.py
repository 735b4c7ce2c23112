# SPDX-License-Identifier: BSD-3-Clause
"""What closed loops with several controllers and state sources did, side by side, and its JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.closed_loop.planning.estimator_account import EstimatorAccount
from jointscope.tools.closed_loop.planning.plan import Plan
from jointscope.tools.closed_loop.planning.tracking import Tracking
from jointscope.tools.simulator.effects_of_file import not_simulated

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LoopRun:
    """One controller with one source.

    Attributes:
        controller: of `CONTROLLERS`.
        source: "true", "estimator" or "encoders".
        states: true (q_link, v_link, q_motor, v_motor) at the ticks, shape (m, 4 n_joints).
        estimates: the same as the controller knew them.
        commands: shape (m, n_joints), SI unit of the command.
        head: where the head was, shape (m, 3) [m].
        tracking: its errors.
        recording: what a bag of the run holds.
        estimator: what it says of itself; None for the other sources.
    """

    controller: str
    source: str
    states: Array
    estimates: Array
    commands: Array
    head: Array
    tracking: Tracking
    recording: Recording
    estimator: EstimatorAccount | None

    @property
    def label(self) -> str:
        """Controller and source in words."""
        return f"{CONTROLLERS[self.controller]}, {SOURCES[self.source]}"


@dataclass(frozen=True)
class ClosedLoopResult:
    """All runs of one plan.

    Attributes:
        robot: of the truth.
        model: what controllers and estimator know.
        plan: what the links should do.
        head: where the head should be, shape (m, 3) [m].
        full: the full command of each joint, shape (n_joints,).
        runs: in the order of the table.
        truth: what was true, as `simulate` tells it.
        lag: of the estimator [s].
        cutoff: of the low-pass behind the differences [Hz].
        mismatch: relative standard deviation of the model's parameters about the true ones; 0 for a given model.
        model_told: where the model comes from, in words.
        unstable: a sentence for each controller whose gains make the model's loop unstable.
    """

    robot: Robot
    model: Robot
    plan: Plan
    head: Array
    full: Array
    runs: tuple[LoopRun, ...]
    truth: dict[str, Any]
    lag: float
    cutoff: float
    mismatch: float
    model_told: str
    unstable: tuple[str, ...] = ()

    def run(self, controller: str, source: str) -> LoopRun | None:
        """The run of a controller with a source, if there was one."""
        return next((r for r in self.runs if (r.controller, r.source) == (controller, source)), None)

    @property
    def hits_balls(self) -> bool:
        """Whether the controllers are those of a head that hits a ball; others follow a plan as a whole."""
        return any(run.controller in ("p", "state_feedback") for run in self.runs)

    @property
    def recorded(self) -> LoopRun:
        """The run that a bag is made of: state feedback with the estimator where there was one, else the last."""
        return self.run("state_feedback", "estimator") or self.runs[-1]

    def to_json(self) -> dict[str, Any]:
        """Plain numbers and texts: errors per run, the plan's hits, and what was true."""
        hits = [{"time": h.time, "q": h.q.tolist(), "v": h.v.tolist()} for h in self.plan.hits]
        return {
            "robot": self.robot.name,
            "model": self.model_told,
            "lag": self.lag,
            "cutoff": self.cutoff,
            "mismatch": self.mismatch,
            "hits": hits,
            "unstable": list(self.unstable),
            "runs": [_as_json(run) for run in self.runs],
            **not_simulated(self.robot, self.truth),
            "truth": self.truth,
        }


CONTROLLERS = {
    "p": "P",
    "state_feedback": "state feedback",
    "pd_link": "PD in q",
    "pd_link_gravity": "PD in q, gravity",
    "pd_both": "PD in q and motor, gravity",
    "pd_both_friction": "PD in q and motor, gravity, friction",
    "pd_motor_friction": "PD in motor, gravity, friction",
    "inverse_dynamics": "inverse dynamics, friction",
}
SOURCES = {"true": "true state", "estimator": "estimator", "encoders": "encoders"}
"""How controllers and sources are called on the screen."""


def _as_json(run: LoopRun) -> dict[str, Any]:
    t = run.tracking
    return {
        "controller": run.controller,
        "source": run.source,
        "link_position_rms": t.link_position_rms,
        "link_velocity_rms": t.link_velocity_rms,
        "link_position_rms_by_joint": t.link_position.tolist(),
        "link_velocity_rms_by_joint": t.link_velocity.tolist(),
        "motor_position_rms_by_joint": t.motor_position.tolist(),
        "e_rms": t.e_rms,
        "head_position_rms": t.head_position,
        "head_velocity_rms": t.head_velocity,
        "hit_position_rms": t.hit_position,
        "hit_velocity_rms": t.hit_velocity,
        "overshoot": t.overshoot,
        "settling": t.settling,
        "effort": t.effort,
        "chatter": t.chatter,
        "saturated": t.saturated,
        "estimation_rms": t.estimation,
        "hits": [asdict(hit) for hit in t.hits],
        "estimator": None if run.estimator is None else asdict(run.estimator),
    }
