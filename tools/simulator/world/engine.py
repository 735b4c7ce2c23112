# SPDX-License-Identifier: BSD-3-Clause
"""Runs MuJoCo at a fine step below a controller that ticks every millisecond.

The engine integrates with Runge-Kutta of fourth order. What it does not know of its own (smooth Coulomb law, torques
of some effects) enters through its passive-force callback, at each of the four stages: the order is kept.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.world.effect import Address, SimulatedEffect
from jointscope.tools.simulator.world.hooks import acting
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.rotor_friction import RotorFriction
from jointscope.tools.simulator.world.specification import (
    build_specification,
    deflection_shares,
    drive,
    link_body,
    rotor_joint,
    transmission,
)
from jointscope.tools.simulator.world.trajectory import Trajectory

Array = NDArray[np.float64]
Controller = Callable[[int, Trajectory], Array]

TICK = 1e-3  # [s]
STEPS_PER_TICK = 5
FRICTIONS = ("dry", "smooth")
SETTLING = 3.0  # [s] at most
AT_REST = 1e-6  # [rad/s]

_callback_lock = threading.Lock()  # MuJoCo has one set of callbacks per process


class Engine:
    """A compiled model of a robot with its effects.

    Args:
        robot: the robot with its true parameters.
        effects: effects to build in.
        friction: "dry" (the engine's friction loss) or "smooth" (mu tanh(sharpness v), sharpness of the robot file).
        steps_per_tick: integration steps per millisecond.

    Attributes:
        model, data: of MuJoCo.
        address: where the robot's coordinates are.
        link, motor: indices of the links' and the rotors' coordinates, in the order of the joints; the rotor of a rigid
            joint is its link.
    """

    def __init__(
        self,
        robot: Robot,
        effects: Sequence[SimulatedEffect] = (),
        friction: str = "dry",
        steps_per_tick: int = STEPS_PER_TICK,
    ):
        if friction not in FRICTIONS:
            raise SimulationError(f"unknown friction {friction!r}; expected {' or '.join(FRICTIONS)}")
        self._mujoco = load_mujoco()
        self._steps = steps_per_tick
        self.effects = tuple(effects)
        self._T = transmission(robot)
        for effect in self.effects:
            effect.couple(self._T)
        shares = deflection_shares(robot, self._T)
        spec = build_specification(robot, friction, TICK / steps_per_tick, shares)
        for effect in self.effects:
            effect.friction, effect.shares = friction, shares
            effect.edit(spec)
        try:
            self.model = spec.compile()
        except ValueError as err:
            raise SimulationError(f"MuJoCo cannot build robot {robot.name!r}: {str(err).splitlines()[0]}") from err
        self.data = self._mujoco.MjData(self.model)
        self._seen = self._mujoco.MjData(self.model)  # for looking at other states than the present one
        self.address = self._find_address(robot)
        self.link = np.array([self.address.link[joint] for joint in robot.joints])
        self.motor = np.array([self.address.motor[joint] for joint in robot.joints])
        self._followers = [(self.model.joint(n).qposadr[0], f) for n, f in robot.tree.followers.items()]
        self._actuator = np.array([self.address.actuator[joint] for joint in robot.joints])
        for effect in self.effects:
            effect.bind(self.model, self.data, self.address)
        # friction of a loaded gear comes after what loads it
        ordered = sorted(self.effects, key=lambda effect: isinstance(effect, RotorFriction))
        self._torques: list[Callable[[], None]] = [e.torque for e in ordered if e.uses("torque")]
        if friction == "smooth":
            self._torques.append(self._smooth_friction(robot))

    @property
    def drive_gains(self) -> Array:
        """Torque that each motor makes of a unit of its command at rest, shape (n_joints,) [N m]."""
        return np.array(self.model.actuator_gainprm[self._actuator, 0])

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all coordinates in the engine's order."""
        return tuple(self.model.joint(i).name for i in range(self.model.njnt))

    def place(self, position: Array) -> None:
        """Puts links at a position, shape (n_joints,) [rad], and rotors where springs are relaxed, at rest."""
        self._mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.link], self.data.qpos[self.motor] = position, np.linalg.solve(self._T, position)
        for place, follower in self._followers:
            self.data.qpos[place] = follower.position(self.data.joint(follower.leader).qpos[0])

    def settle(self) -> None:
        """Lets the robot come to rest under its own load, without commands, and calls that time zero."""
        with self._hooked():
            for _ in range(round(SETTLING / TICK)):
                self._mujoco.mj_step(self.model, self.data, self._steps)
                if np.abs(self.data.qvel).max() < AT_REST:
                    break
        self._check_sane(0.0)
        self.data.time = 0.0

    def accelerations(self, q: Array, v: Array, command: Array) -> Array:
        """Accelerations of all coordinates in the engine's order at one state, shape (nq,) [rad/s^2]."""
        self.data.qpos[:], self.data.qvel[:], self.data.ctrl[self._actuator] = q, v, command
        with self._hooked():
            self._mujoco.mj_forward(self.model, self.data)
        return self.data.qacc.copy()

    def run(
        self, controller: Controller, link_torques: Array, motor_torques: Array, progress: Callable[[int], None]
    ) -> Trajectory:
        """Integrates from the present state.

        Args:
            controller: maps the number of the tick and the trajectory until now, whose last point is the present state,
                to the command, shape (n_joints,), held until the next tick; what it knows of it is its own affair.
            link_torques: disturbance on the links, shape (ticks, n_joints) [N m].
            motor_torques: disturbance on the rotors, shape (ticks, n_joints) [N m].
            progress: called now and then with the number of ticks done.

        Returns:
            The trajectory on the fine grid, ticks * steps + 1 points.

        Raises:
            SimulationError: the integration diverged.
        """
        model, data, mj_step, steps = self.model, self.data, self._mujoco.mj_step, self._steps
        qpos, qvel, ctrl, applied = data.qpos, data.qvel, data.ctrl, data.qfrc_applied
        ticks, h = len(link_torques), TICK / steps
        q, v = np.empty((ticks * steps + 1, model.nq)), np.empty((ticks * steps + 1, model.nv))
        acted = np.zeros((len(q), len(self._actuator)))
        q[0], v[0], row = qpos, qvel, 0
        disturbance = self._on_coordinates(link_torques, motor_torques)
        commanding = [effect for effect in self.effects if effect.uses("command")]
        with self._hooked():
            for k in range(ticks):
                issued = controller(k, Trajectory(h, q[: row + 1], v[: row + 1], acted[: row + 1]))
                ctrl[self._actuator] = issued
                applied[:] = disturbance[k]
                for _ in range(steps):
                    if commanding:
                        ctrl[self._actuator] = acting(commanding, row * h, issued)
                    mj_step(model, data)
                    row += 1
                    q[row], v[row], acted[row] = qpos, qvel, ctrl[self._actuator]
                if k % 1000 == 999:
                    self._check_sane((k + 1) * TICK)
                    progress(k + 1)
        self._check_sane(ticks * TICK)
        progress(ticks)
        return Trajectory(h, q, v, acted)

    def _on_coordinates(self, link: Array, motor: Array) -> Array:
        """Torques on all coordinates, shape (ticks, nv); both sides of a rigid joint act on one."""
        torques = np.zeros((len(link), self.model.nv))
        torques[:, self.link] = link
        torques[:, self.motor] += motor
        return torques

    def body_rates(self, site: str, q: Array, v: Array) -> Array:
        """Angular velocity of a site in its own axes, shape (m, 3) [rad/s], as the engine computes it.

        Args:
            site: name of the gyro whose site it is.
            q: positions of all coordinates, shape (m, nq) [rad].
            v: velocities of all coordinates, shape (m, nq) [rad/s].
        """
        mujoco, model, data = self._mujoco, self.model, self._seen
        site_id, kind = model.site(site).id, mujoco.mjtObj.mjOBJ_SITE
        qpos, qvel, six, omega = data.qpos, data.qvel, np.zeros(6), np.empty((len(q), 3))
        for k in range(len(q)):
            qpos[:], qvel[:] = q[k], v[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            mujoco.mj_objectVelocity(model, data, kind, site_id, six, 1)
            omega[k] = six[:3]
        return omega

    def specific_forces(self, site: str, gravity: Array, q: Array, v: Array, a: Array) -> Array:
        """What an accelerometer at a site feels, in its axes, shape (m, 3) [m/s^2]: the engine's own sensor.

        Args:
            site: name of the accelerometer whose site it is.
            gravity: that it feels, shape (3,) [m/s^2]; the joints may be relieved of theirs.
            q: positions of all coordinates, shape (m, nq) [rad].
            v: velocities, shape (m, nq) [rad/s].
            a: accelerations, shape (m, nq) [rad/s^2].
        """
        mujoco, model, data = self._mujoco, self.model, self._seen
        place = model.sensor(site).adr[0]
        forces, before = np.empty((len(q), 3)), model.opt.gravity.copy()
        for k in range(len(q)):
            data.qpos[:], data.qvel[:] = q[k], v[k]
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            data.qacc[:] = a[k]
            model.opt.gravity[:] = gravity
            mujoco.mj_rnePostConstraint(model, data)  # not a second time by itself
            mujoco.mj_sensorAcc(model, data)
            model.opt.gravity[:] = before
            forces[k] = data.sensordata[place : place + 3]
        return forces

    def points(self, joint: str, p_link: Array, q: Array) -> Array:
        """Where a point of the body that a joint moves is in the world, shape (m, 3) [m].

        Args:
            joint: name of the joint.
            p_link: the point in the joint's frame, shape (3,) [m].
            q: positions of all coordinates, shape (m, nq) [rad].
        """
        data, body = self._seen, self.model.body(link_body(joint)).id
        p_world = np.empty((len(q), 3))
        for k in range(len(q)):
            data.qpos[:] = q[k]
            self._mujoco.mj_kinematics(self.model, data)
            p_world[k] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ p_link
        return p_world

    def _find_address(self, robot: Robot) -> Address:
        def dof(name: str) -> int:
            return int(self.model.joint(name).dofadr[0])

        return Address(
            link={joint: dof(joint) for joint in robot.joints},
            motor={joint: dof(rotor_joint(robot, joint)) for joint in robot.joints},
            actuator={joint: self.model.actuator(drive(joint)).id for joint in robot.joints},
        )

    def _smooth_friction(self, robot: Robot) -> Callable[[], None]:
        """Torque -mu tanh(sharpness v) on each rotor; scalar code, because it runs four times per fine step."""
        tanh = math.tanh
        passive, qvel = self.data.qfrc_passive, self.data.qvel
        rotors = [
            (self.address.motor[joint], robot.parameter(f"{joint}.coulomb_torque").value, robot.sharpness_of(joint))
            for joint in robot.joints
        ]

        def torque() -> None:
            for dof, mu, sharpness in rotors:
                passive[dof] -= mu * tanh(sharpness * qvel[dof])

        return torque

    @contextmanager
    def _hooked(self) -> Iterator[None]:
        """Hangs the torques into the engine while it runs, and keeps it from writing a log file on divergence."""
        torques = self._torques

        def add_torques(_model: object, _data: object) -> None:
            for torque in torques:
                torque()

        with _callback_lock:
            self._mujoco.set_mju_user_warning(lambda _message: None)  # _check_sane tells the user
            if torques:
                self._mujoco.set_mjcb_passive(add_torques)
            try:
                yield
            finally:
                self._mujoco.set_mjcb_passive(None)
                self._mujoco.set_mju_user_warning(None)

    def _check_sane(self, time: float) -> None:
        # The engine resets itself to the start and goes on when a number becomes too large; its warnings tell.
        if any(warning.number for warning in self.data.warning) or not np.all(np.isfinite(self.data.qpos)):
            raise SimulationError(
                f"the simulation diverged before {time:g} s; check stiffness, inertia and the effects' parameters"
            )
