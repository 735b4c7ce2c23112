# SPDX-License-Identifier: BSD-3-Clause
"""An engine for robots that stand most of the time, with a force that somebody hangs on a link and takes off.

The engine's friction loss is soft: a motor that it holds creeps by about a millionth of a radian per second. Here a
motor whose friction has held it, within its band, for some milliseconds stays exactly where it is until friction gives
way. Positions at rest do not depend on how the way there is integrated, so one evaluation per step in place of four is
enough, and the step is longer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.hooks import acting
from jointscope.tools.simulator.world.specification import link_body
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
STEPS = 2  # per tick
WITHIN = 1.0 - 1e-9  # of the band, in which friction holds and does not slide
HELD = 10  # ticks within the band, after which a motor sticks
SHOWN = 1000  # ticks between two looks at whether the numbers are sane


class Experimenter(Protocol):
    """Who drives a robot, hangs weights on it, and goes home some time."""

    force: Array
    """That hangs on the link now, in the axes of the world, shape (3,) [N]."""
    finished: bool
    """Whether nothing more is done."""

    def __call__(self, tick: int, past: Trajectory) -> Array:
        """The command of a tick, shape (n_joints,)."""


class StickingEngine(Engine):
    """A robot whose motors truly stick.

    Args:
        robot: the robot with its true parameters.
        effects: effects to build in.
        at: link of the URDF at whose origin the force acts.

    Raises:
        SimulationError: the link does not move.
    """

    def __init__(self, robot: Robot, effects: Sequence[SimulatedEffect], at: str):
        super().__init__(robot, effects, "dry", STEPS)
        mujoco = self._mujoco
        self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        frame = robot.tree.model.frames[robot.tree.frame_id(at)]
        if not frame.parentJoint:
            raise SimulationError(f"link {at!r} of {robot.name} does not move, so no weight can act on it")
        self._body = self.model.body(link_body(robot.tree.model.names[frame.parentJoint])).id
        self._p_link = np.array(frame.placement.translation)
        mujoco.mj_forward(self.model, self.data)
        rows = zip(self.data.efc_type, self.data.efc_id, strict=True)
        held = {
            int(dof): row for row, (kind, dof) in enumerate(rows) if kind == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        }
        self._dry = np.array([i for i, dof in enumerate(self.motor.tolist()) if dof in held], dtype=int)
        self._rows = np.array([held[dof] for dof in self.motor[self._dry].tolist()], dtype=int)
        self._dofs = self.motor[self._dry]
        self._within = np.zeros(len(self._dry), dtype=int)  # ticks since friction last gave way
        self._stuck_at = np.zeros(len(self._dry))

    def friction(self) -> tuple[Array, Array]:
        """Torque with which friction holds each motor now, and the most that it can, shape (n_joints,) each [N m]."""
        held, most = np.zeros(len(self.motor)), np.zeros(len(self.motor))
        held[self._dry] = self.data.efc_force[self._rows]
        most[self._dry] = self.data.efc_frictionloss[self._rows]
        return held, most

    def sticks(self) -> NDArray[np.bool_]:
        """Whether each motor sticks, shape (n_joints,); one without friction never does."""
        found = np.zeros(len(self.motor), dtype=bool)
        found[self._dry] = self._within >= HELD
        return found

    def experiment(
        self, who: Experimenter, link_torques: Array, motor_torques: Array, progress: Callable[[int], None]
    ) -> Trajectory:
        """Integrates from the present state until the experimenter has finished, at most as long as disturbances last.

        Args:
            who: is asked at every tick, before the force that hangs on the link is looked at.
            link_torques: disturbance on the links, shape (ticks, n_joints) [N m].
            motor_torques: disturbance on the rotors, shape (ticks, n_joints) [N m].
            progress: called now and then with the number of ticks done.

        Returns:
            The trajectory at the ticks, with one more point than there were.

        Raises:
            SimulationError: the integration diverged.
        """
        model, data, mj_step = self.model, self.data, self._mujoco.mj_step
        ticks = len(link_torques)
        q, v = np.empty((ticks + 1, model.nq)), np.empty((ticks + 1, model.nv))
        acted = np.zeros((len(q), len(self._actuator)))
        q[0], v[0], done = data.qpos, data.qvel, 0
        disturbance = self._on_coordinates(link_torques, motor_torques)
        commanding = [effect for effect in self.effects if effect.uses("command")]
        with self._hooked():
            for k in range(ticks):
                issued = who(k, Trajectory(TICK, q[: k + 1], v[: k + 1], acted[: k + 1]))
                if who.finished:
                    break
                data.ctrl[self._actuator] = issued
                data.qfrc_applied[:] = disturbance[k]
                self._hang(who.force)
                if commanding:
                    for step in range(STEPS):
                        data.ctrl[self._actuator] = acting(commanding, k * TICK + step * TICK / STEPS, issued)
                        mj_step(model, data)
                else:
                    mj_step(model, data, STEPS)
                self._stick()
                done = k + 1
                q[done], v[done], acted[done] = data.qpos, data.qvel, data.ctrl[self._actuator]
                if done % SHOWN == 0:
                    self._check_sane(done * TICK)
                    progress(done)
        self._check_sane(done * TICK)
        return Trajectory(TICK, q[: done + 1], v[: done + 1], acted[: done + 1])

    def _hang(self, force: Array) -> None:
        """A force at the origin of the link: the engine takes it at the body's centre of mass, with its moment."""
        data, body = self.data, self._body
        if not force.any():
            data.xfrc_applied[body] = 0.0
            return
        lever = data.xpos[body] + data.xmat[body].reshape(3, 3) @ self._p_link - data.xipos[body]
        data.xfrc_applied[body, :3] = force
        (x, y, z), (fx, fy, fz) = lever.tolist(), force.tolist()
        data.xfrc_applied[body, 3:] = y * fz - z * fy, z * fx - x * fz, x * fy - y * fx

    def _stick(self) -> None:
        """Keeps motors where they are that friction holds."""
        data, dofs = self.data, self._dofs
        holds = np.abs(data.efc_force[self._rows]) < WITHIN * data.efc_frictionloss[self._rows]
        self._within = np.where(holds, self._within + 1, 0)
        begins, stuck = self._within == HELD, self._within >= HELD
        self._stuck_at[begins] = data.qpos[dofs[begins]]
        data.qpos[dofs[stuck]], data.qvel[dofs[stuck]] = self._stuck_at[stuck], 0.0
