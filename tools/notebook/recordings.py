# SPDX-License-Identifier: BSD-3-Clause
"""Functions that read recordings, make them, and feed them to the estimator."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointscope.graphs.fixed_lag.replay.replay import SMOOTHED_EVERY
from jointscope.graphs.fixed_lag.replay.replay import replay as replay_messages
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_motion import read_motion
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.notebook.given import AnyRecording, AnyRobot, recording_of, robot_of
from jointscope.tools.notebook.results import Replayed, Simulated
from jointscope.tools.notebook.robot_as_recorded import robot_as_recorded
from jointscope.tools.simulator.simulation import simulate as simulate_motion


def read(bag: str | Path, robot: AnyRobot, *, leave_out: Sequence[tuple[float, float]] = ()) -> Recording:
    """Reads what a robot needs from a bag, in SI units, each stream at its own times.

    Args:
        bag: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, fields, units and joint names.
        leave_out: first and last second of each stretch in which something acted that does not belong to the robot.

    Raises:
        RecordingError: the bag cannot be read, or does not hold what the robot needs.
    """
    recording = read_motion(bag, robot_of(robot))
    return recording.leaving_out(leave_out) if leave_out else recording


def replay(
    robot: AnyRobot,
    recording: AnyRecording,
    lag: float = 0.1,
    *,
    adapt: Mapping[str, float] | None = None,
    lagged_every: int = SMOOTHED_EVERY,
) -> Replayed:
    """Feeds a recording to the estimator of the control loop; a bag in the order in which it was received.

    Args:
        robot: calibrated.
        recording: a bag, or a recording that was read.
        lag: of the smoothed state [s].
        adapt: parameters that may walk: full name and density [unit/sqrt(s)].
        lagged_every: the state at the lag is read at every so-manieth tick.

    Raises:
        RecordingError: the recording cannot be a measurement of this robot.
    """
    model = robot_of(robot)
    options: dict[str, Any] = {"adapt": adapt, "smoothed_every": lagged_every}
    if not isinstance(recording, str | Path):
        return Replayed.of(replay_messages(model, recording_of(recording, model), lag, **options))
    model, _ = robot_as_recorded(model, Path(recording))
    arrivals = ArrivalReader(Path(recording), model)
    found = replay_messages(model, arrivals, lag, **options)
    return Replayed.of(replace(found, source=arrivals.source(found.recording_seconds, model.name)))


def simulate(
    robot: AnyRobot,
    bag: str | Path | None = None,
    *,
    motion: str = "calibration",
    seconds: float | None = None,
    seed: int = 0,
    effects: str | Iterable[str] = (),
    **conditions: Any,
) -> Simulated:
    """A recording from an engine that is independent of the estimator's own model.

    Args:
        robot: the truth, where it has no published values.
        bag: where to write the recording; nowhere if not given.
        motion: "calibration", or "moves" to judge by.
        seconds: duration [s]; 65 for the motion "calibration" and 30 for "moves" if not given.
        seed: of robot, motion and noise; the same seed is the same robot.
        effects: ID@OWNER[:param=value,...] that the robot has; one, or several.
        conditions: everything else that `jointscope.tools.simulator.simulation.simulate` takes, as friction="smooth".

    Raises:
        SimulationError: MuJoCo is missing, or an option is impossible.
    """
    model = robot_of(robot)
    hidden = [effects] if isinstance(effects, str) else effects
    found = simulate_motion(model, motion, seconds, seed, effects=hidden, **conditions)
    if bag is not None:
        write_bag(Path(bag), found.recording, model)
    return Simulated.of(found)
