# SPDX-License-Identifier: BSD-3-Clause
"""A recording of a robot that a controller brings to rest in one posture after the other, with known weights on a link.

Motors stick, weights pull at the link while they hang there, and links swing until they are calm: MuJoCo integrates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.simulator.loop.bench import EVERY, Bench, RestTruth, longest
from jointscope.tools.simulator.loop.postures import Holding, drawn_postures
from jointscope.tools.simulator.occasion import Conditions, Occasion
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.sticking_engine import StickingEngine
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
RESTS, FEWEST_POSTURES = 30, 8  # that are made if nobody says how many
RATE = 200.0  # [Hz] of sensors, if nobody says another
SHORTEST_HOLD, LONGEST_HOLD = 0.6, 60.0  # [s]


@dataclass(frozen=True)
class Resting:
    """How a robot is brought to rest.

    Attributes:
        count: number of postures; None: as many as make 30 rests, at least 8.
        masses: that hang on the link in each posture, in turn [kg].
        at: link of the URDF at whose origin they hang; None: the farthest behind the last joint.
        hold: how long each rest is left alone [s].
    """

    count: int | None = None
    masses: Sequence[float] = (0.0,)
    at: str | None = None
    hold: float = 1.5


@dataclass(frozen=True)
class SimulatedRests:
    """Rests and what was really going on.

    Attributes:
        recording: what the bag will hold.
        loads: that hung on the robot; None where nothing ever did.
        truth: parameters by full name, effects, settings and each rest; fit for JSON.
    """

    recording: Recording
    loads: LoadHistory | None
    truth: dict[str, Any]


class _RestingOccasion(Occasion):
    """An occasion whose robot truly sticks."""

    def __init__(self, robot: Robot, at: str, seconds: float, seed: int, conditions: Conditions, session: str):
        self._at = at
        super().__init__(robot, session, seconds, seed, conditions)

    def _engine(self, effects: Sequence[SimulatedEffect], conditions: Conditions) -> Engine:
        self.sticking = StickingEngine(self.truth, effects, self._at)
        return self.sticking

    def experiment(self, bench: Bench, holding: Holding, progress: Callable[[float], None]) -> Trajectory:
        """What an experimenter does with the robot, from where the first posture is come from."""
        engine, start, ticks = self.sticking, bench.start, len(self.times)
        engine.place(start)
        own = ~np.isin(engine.motor, engine.link)  # rotors of elastic joints
        engine.data.qpos[engine.motor[own]] = holding.motors(start)[own]
        trajectory = engine.experiment(bench, *self.disturbances(), lambda done: progress(done / ticks))
        self.ended(len(trajectory.q) - 1)
        return trajectory


def simulate_rests(
    robot: Robot,
    seed: int = 0,
    conditions: Conditions | None = None,
    resting: Resting | None = None,
    session: str = "rests",
    progress: Callable[[float], None] | None = None,
) -> SimulatedRests:
    """Simulates a robot at rest.

    Args:
        robot: with commands and sensors.
        seed: of the robot; the same seed is the same robot in every kind of recording.
        conditions: what is true of robot and sensors.
        resting: how it is brought to rest.
        session: another one has other postures.
        progress: called with the share done.

    Raises:
        SimulationError: MuJoCo is missing, numbers that cannot be, or weights that the drives cannot hold.
        RobotError: a robot without equations of motion.
        EffectError: an unknown effect.
    """
    robot.need_link_dynamics()
    conditions, resting = conditions or Conditions(), resting or Resting()
    told = progress or (lambda share: None)
    at = _link(robot, resting.at)
    count = _checked(robot, resting, conditions)
    holding = Holding(true_robot(robot, conditions.parameters))
    forces = [mass * robot.tree.gravity for mass in resting.masses]
    postures = drawn_postures(holding, count, forces, at, random_stream(seed, session, "postures"))
    most = longest(holding, postures, resting.masses, resting.hold)
    occasion = _RestingOccasion(robot, at, most, seed, conditions, f"rests {session}")
    engine, rng = occasion.sticking, occasion.random("giving way")
    bench = Bench(engine, occasion.encoder(), holding, postures, resting.masses, robot.tree.gravity, resting.hold, rng)
    trajectory = occasion.experiment(bench, holding, told)
    recording = occasion.recording(trajectory, np.array(bench.commands), EVERY)
    truth = occasion.told() | {"session": session, "weights": list(resting.masses), "at": at, "hold": resting.hold}
    del truth["motion"]
    truth["rests"] = [_told(rest, engine, trajectory) for rest in bench.rests]
    times, hung = zip(*bench.loads, strict=True)
    loads = LoadHistory(np.array(times), np.array(hung), (at,) * len(times)) if any(resting.masses) else None
    return SimulatedRests(recording, loads, truth)


def _told(rest: RestTruth, engine: Engine, trajectory: Trajectory) -> dict[str, Any]:
    """A rest, fit for JSON: where motors and links were in the mean [rad], and what friction held at its end."""
    q = trajectory.q[round(rest.begin / TICK) : round(rest.end / TICK)].mean(axis=0)
    return {
        "begin": rest.begin,
        "end": rest.end,
        "mass": rest.mass,
        "motors": q[engine.motor].tolist(),
        "links": q[engine.link].tolist(),
        "friction": rest.held.tolist(),
        "most_friction": rest.most.tolist(),
    }


def _link(robot: Robot, at: str | None) -> str:
    """The link on which weights hang: the one that is named, or the farthest behind the last joint.

    Raises:
        SimulationError: there is no such link.
    """
    tree = robot.tree
    if at is not None:
        if at not in tree.bodies:
            raise SimulationError(f"--at {at}: no such link in {tree.urdf.name}{did_you_mean(at, tree.bodies)}")
        return at
    last = tree.model.getJointId(robot.joints[-1])
    frames = {name: tree.model.frames[tree.frame_id(name)] for name in tree.bodies}
    behind = {name: frame for name, frame in frames.items() if frame.parentJoint == last}
    return max(behind, key=lambda name: float(np.linalg.norm(behind[name].placement.translation)))


def _checked(robot: Robot, resting: Resting, conditions: Conditions) -> int:
    """The number of postures.

    Raises:
        SimulationError: a number that cannot be, or friction that does not hold.
    """
    if conditions.friction != "dry":
        raise SimulationError(f"friction {conditions.friction}: motors would slide for ever; expected dry at rest")
    if not resting.masses or not all(np.isfinite(mass) and mass >= 0.0 for mass in resting.masses):
        raise SimulationError(f"weights: expected masses of 0 kg or more, got {', '.join(map(str, resting.masses))}")
    if len(set(resting.masses)) < len(resting.masses):
        raise SimulationError(f"weights: expected each once, got {', '.join(f'{m:g}' for m in resting.masses)}")
    if any(resting.masses) and not robot.tree.gravity.any():
        raise SimulationError(f"{robot.name} has no gravity, so weights pull at nothing; leave out --weights")
    if not SHORTEST_HOLD <= resting.hold <= LONGEST_HOLD:
        raise SimulationError(f"hold: expected {SHORTEST_HOLD:g} to {LONGEST_HOLD:g} s, got {resting.hold:g}")
    if resting.count is not None and resting.count < 1:
        raise SimulationError(f"number of postures: expected 1 or more, got {resting.count}")
    return resting.count or max(FEWEST_POSTURES, -(-RESTS // len(resting.masses)))
