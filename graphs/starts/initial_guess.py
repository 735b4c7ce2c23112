# SPDX-License-Identifier: BSD-3-Clause
"""Where the solver starts: states and parameters from the measurements alone, nothing set by hand.

Motor angles follow the encoders, link rates follow the gyros (least squares through the mounting as the robot file
has it), and the deflection is the integral of the difference with a slow leak. With the motion known to a few percent
the equations of motion are linear in the parameters; both sides pass the same filter, so noise and drift stay out:

    link    M a + c + g = -K deflection - D deflection_rate
    motor   M a + c + g = k_pwm U u - k_mi v_motor - mu tanh(k v) - b a_motor

Both are used at elastic joints; rigid ones have a regression of their own, `starts.drive_starts`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import butter, lfilter, sosfiltfilt

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block
from jointscope.graphs.problem.bag_problem import BagProblem, first_command_time
from jointscope.graphs.starts.drive_starts import with_drive_starts
from jointscope.graphs.starts.encoder_motion import encoder_motion
from jointscope.graphs.starts.swinging_links import swinging_links
from jointscope.robots.dynamics.transmission import joint_angles, motor_angles
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.encoder_plays import unlagged
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

LEAK = 0.2  # [s] time after which a deflection from integrated gyro rates is forgotten
SIGNAL_OF = {  # what each law of a motor multiplies
    "k_pwm": "drive",
    "torque_constant": "drive",
    "k_mi": "minus_v_motor",
    "coulomb_torque": "minus_sign",
    "inertia": "minus_a_motor",
}
OPPOSITE = 20.0  # [sigma] a drive constant below minus this is a wrong sign
BAND = (0.5, 10.0)  # [Hz] the regression uses motion between these frequencies


def initial_states(problem: BagProblem, calibration: Calibration) -> Array:
    """States at all ticks, shape (m + 1, d); bearings do not tilt, memories are empty but for lags of encoders."""
    x = problem.robot.layout.from_joints(_joint_states(problem, calibration))
    return unlagged(problem.robot, x, calibration.by_name)


def _joint_states(problem: BagProblem, calibration: Calibration) -> Array:
    """(q_link, v_link, q_motor, v_motor) of the joints, shape (m + 1, 4n)."""
    ticks, robot = problem.timeline.ticks, problem.robot
    q_motor, v_motor = encoder_motion(problem.recording.streams[robot.motor_encoder.name], robot.motor_encoder, ticks)
    links = robot.link_encoder
    if links is not None:
        return np.hstack([*encoder_motion(problem.recording.streams[links.name], links, ticks), q_motor, v_motor])
    unseen = swinging_links(problem, calibration, q_motor, v_motor)
    if unseen is not None:
        return np.hstack([unseen, q_motor, v_motor])
    q_relaxed, v_relaxed = joint_angles(robot, q_motor), joint_angles(robot, v_motor)
    v_link = _link_rates(problem, calibration, q_relaxed, v_relaxed)
    h = np.diff(ticks, prepend=ticks[0])
    keep = float(np.exp(-np.median(h) / LEAK))
    deflection = lfilter([1.0], [1.0, -keep], (v_link - v_relaxed) * h[:, None], axis=0)
    return np.hstack([q_relaxed + deflection, v_link, q_motor, v_motor])


def initial_biases(problem: BagProblem, calibration: Calibration) -> Calibration:
    """Biases from the rest before the first command, where there is one."""
    if not problem.rests:
        return calibration
    biases: dict[str, Array] = {}
    for gyro in problem.robot.gyros:
        resting = problem.recording.streams[gyro.name].between(-np.inf, first_command_time(problem.recording))
        if len(resting) >= 10:
            biases[bias_block(gyro.name)] = resting.values.mean(axis=0)
    return calibration.with_points(biases)


def initial_dynamics(problems: Sequence[BagProblem], states: Sequence[Array], calibration: Calibration) -> Calibration:
    """Parameters by linear regression; those it cannot find keep the robot file's value.

    Raises:
        RecordingError: a joint moves against its command.
    """
    robot = problems[0].robot
    calibration = with_drive_starts(problems, calibration)
    elastic = [i for i, joint in enumerate(robot.joints) if joint in robot.layout.motors]
    if not elastic or robot.command.unit == "N m":
        return calibration
    signals = [_regression_signals(p, x) for p, x in zip(problems, states, strict=True)]
    merged = {key: np.concatenate([s[key] for s in signals]) for key in signals[0]}
    found: dict[str, list[tuple[float, float]]] = {}
    parameters = JointParameters(robot)
    for i in elastic:
        joint = robot.joints[i]
        link = np.column_stack([-merged["deflection"][:, i], -merged["deflection_rate"][:, i]])
        _regress(found, robot, parameters, joint, ("stiffness", "damping"), link, merged["load"][:, i])
        laws = (*robot.drive_laws, "coulomb_torque", "inertia")
        motor = np.column_stack([merged[SIGNAL_OF[law]][:, i] for law in laws])
        _regress(found, robot, parameters, joint, laws, motor, merged["load"][:, i])
    return _with_values(calibration, found)


def _regression_signals(problem: BagProblem, x: Array) -> dict[str, Array]:
    """All signals of the two equations, equally filtered, shape (m, n) each."""
    robot, ticks = problem.robot, problem.timeline.ticks
    h = float(np.median(problem.timeline.h))
    q_link, v_link, _, v_motor = np.split(robot.layout.by_joint(x), 4, axis=1)
    u = np.vstack([problem.timeline.u, problem.timeline.u[-1:]])
    a_link = np.gradient(v_link, ticks, axis=0)
    low = butter(2, min(BAND[1], 0.4 / h), fs=1.0 / h, output="sos")
    a_smooth = sosfiltfilt(low, a_link, axis=0)
    # inverse dynamics: what the rigid bodies ask of the springs
    load = robot.tree.torque(q_link, v_link if robot.tree.coriolis else 0.0 * v_link, a_smooth)
    load = load @ joint_angles(robot, np.eye(robot.n)).T  # T^T load, by virtual work
    v_seen = motor_angles(robot, v_link)
    v_friction = v_link if robot.choices.friction_velocity == "link" else v_motor
    signals = {
        "load": -load,
        "deflection_rate": v_seen - v_motor,
        "drive": robot.command_volts * u,
        "minus_v_motor": -v_motor,
        "minus_sign": -np.tanh(robot.friction_sharpness() * v_friction),
        "minus_a_motor": -np.gradient(v_motor, ticks, axis=0),
    }
    band = butter(2, [BAND[0], min(BAND[1], 0.4 / h)], btype="band", fs=1.0 / h, output="sos")
    filtered = {key: sosfiltfilt(band, value, axis=0) for key, value in signals.items()}
    filtered["deflection"] = sosfiltfilt(band, np.cumsum(signals["deflection_rate"] * h, axis=0), axis=0)
    filtered["load"] = -filtered["load"]
    keep = slice(None, None, max(round(0.25 / (BAND[1] * h)), 1))
    return {key: value[keep] for key, value in filtered.items()}


def _regress(
    found: dict[str, list[tuple[float, float]]],
    robot: Robot,
    parameters: JointParameters,
    joint: str,
    laws: tuple[str, ...],
    regressors: Array,
    target: Array,
) -> None:
    """Least squares with positive values; several joints may speak about one shared parameter."""
    scale = np.sqrt(np.mean(regressors**2, axis=0))
    if np.any(scale == 0.0):
        return
    if robot.drive_gain in laws:
        _check_sign(joint, regressors / scale, target)
    values, _ = nnls(regressors / scale, target)
    for law, value, size in zip(laws, values / scale, scale, strict=True):
        name = parameters.source(law, robot.joints.index(joint))
        if value > 0.0 and name and not robot.parameter(name).fixed:
            # a spring that an effect gave to the joint has a compliance
            own = 1.0 / value if name.endswith(".compliance") else value
            found.setdefault(name, []).append((float(own), float(value * size)))


def _check_sign(joint: str, regressors: Array, target: Array) -> None:
    """A motor that turns against its command is a wiring or file mistake, not a parameter."""
    values, _, rank, _ = np.linalg.lstsq(regressors, target, rcond=None)
    if rank < regressors.shape[1]:
        return
    spread = float(np.std(target - regressors @ values))
    sigma = spread * np.sqrt(np.linalg.inv(regressors.T @ regressors)[0, 0])
    if values[0] < -OPPOSITE * sigma and spread < 0.7 * float(np.std(target)):
        raise RecordingError(
            f"{joint} moves against its command ({-values[0] / sigma:.0f} sigma): the sign of the command or of the "
            "encoder is wrong; check the joint's axis in the URDF and the names and fields of the topics"
        )


def _with_values(calibration: Calibration, found: dict[str, list[tuple[float, float]]]) -> Calibration:
    """Puts regressed values in, weighted by how much torque they explain, at most a factor 20 from the start."""
    values = calibration.values
    for i, name in enumerate(calibration.names):
        if name not in found:
            continue
        value, torque = np.array(found[name]).T
        mean = float(np.sum(value * torque) / np.sum(torque))
        if values[i] / 20.0 < mean < values[i] * 20.0:
            values[i] = mean
    dynamics = np.where(calibration.positive, np.log(np.where(calibration.positive, values, 1.0)), values)
    return calibration.with_points({DYNAMICS: dynamics})


def _link_rates(problem: BagProblem, calibration: Calibration, q: Array, fallback: Array) -> Array:
    """Link velocities that fit the gyros best, shape (m, n); the motor's where no gyro sees a joint."""
    robot, ticks = problem.robot, problem.timeline.ticks
    n = robot.n
    left = np.tile(1e-4 * np.eye(n), (len(ticks), 1, 1))
    right = 1e-4 * fallback
    for gyro in robot.gyros:
        stream = problem.recording.streams[gyro.name]
        measured = _at(ticks, stream.times, stream.values)
        omega_body = (measured - calibration.biases[gyro.name]) @ calibration.rotations[gyro.name]
        jacobian = robot.tree.body_rate(gyro.body, q, np.zeros_like(q))[2]
        left += jacobian.transpose(0, 2, 1) @ jacobian
        right = right + np.einsum("kij,ki->kj", jacobian, omega_body)
    return np.asarray(np.linalg.solve(left, right[:, :, None])[:, :, 0], dtype=np.float64)


def _at(ticks: Array, times: Array, values: Array) -> Array:
    """Linear interpolation column by column; only a first guess, the factors see the samples themselves."""
    return np.column_stack([np.interp(ticks, times, column) for column in values.T])
