# SPDX-License-Identifier: BSD-3-Clause
"""Responses of robots that `simulate --kind frequency` shakes, against pinocchio's equations of motion, linearised.

The engine, its controller, the bag and the estimate on one side; mass matrix and slope of the weight on the other.
"""

from __future__ import annotations

import json

import numpy as np
import pinocchio as pin
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.error_parameters import error_names
from jointscope.tools.bags.read_signals import excitation_of, read_signals
from jointscope.tools.command_line import main

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

SHORT = ["--kind", "frequency", "--realisations", "1", "--f0", "1", "--highest", "30", "--seed", "3", "--white-encoder"]
QUIET = ["--friction", "smooth", "--count", "1", "--f0", "0.25", "--highest", "20"]
ARM = {"shoulder": None, "elbow": "shoulder"}


def shaken(folder, robot, *more):
    """Matrix of the first bag, where its motors were in the mean, and the true values."""
    assert main(["simulate", str(robot), "-o", str(folder), *SHORT, *more]) == 0
    bag = folder / "frequency_1.mcap"
    signals, drive = read_signals(bag)
    matrix = MeasuredResponse.of(signals, excitation_of(bag, signals, drive)).matrix
    truth = json.loads(folder.with_name(f"{folder.name}.truth.json").read_text())
    return matrix, signals.outputs.values.mean(axis=0), truth["parameters"]


def model_of(robot):
    """Pinocchio's model of the joints that move."""
    model = pin.buildModelFromUrdf(str(robot.tree.urdf))
    model.gravity.linear = robot.tree.gravity
    locked = [model.getJointId(name) for name in model.names[1:] if name not in robot.joints]
    model = pin.buildReducedModel(model, locked, pin.neutral(model))
    assert tuple(model.names)[1:] == robot.joints
    return model


def mass_and_slope(model, q):
    """Mass matrix and how the weight changes with the angles, at rest."""
    data = model.createData()
    M = np.triu(pin.crba(model, data, q))
    slope = pin.computeGeneralizedGravityDerivatives(model, data, q)
    return M + np.triu(M, 1).T, slope


def assert_as_linearised(matrix, G, nearly, above=0.0):
    """Within sigmas at all entries, and to a share where the response is large, at lines above a frequency [Hz]."""
    used = matrix.frequencies > above
    z = np.abs(matrix.G - G) / matrix.sigmas(matrix.total)
    assert np.all(np.sqrt(np.mean(z**2, axis=0)) < 1.5)
    assert np.all(np.sqrt(np.mean(z**2, axis=(1, 2))) < 2.0)
    large = np.abs(G) > 0.2 * np.abs(G).max(axis=(1, 2), keepdims=True)
    assert np.all(np.abs(matrix.G / G - 1.0)[used][large[used]] < nearly)


def test_an_elastic_robot_that_is_driven_by_voltages(tmp_path):
    next_to_none = [part for i in (1, 2, 3) for part in ("--set", f"joint{i}.coulomb_torque=1e-6")]
    matrix, q, true = shaken(tmp_path / "doggy", "doggy", *next_to_none)
    robot = load_robot("doggy")
    M, slope = mass_and_slope(model_of(robot), q)
    K, D = (np.diag([true[f"{joint}.{part}"] for joint in robot.joints]) for part in ("stiffness", "damping"))
    G = np.empty_like(matrix.G)
    for k, f in enumerate(matrix.frequencies):
        s, one = 2j * np.pi * f, np.eye(3)
        spring, rotor = K + D * s, one * (true["motor.inertia"] * s**2 + true["motor.k_mi"] * s)
        Z = np.block([[M * s**2 + slope + spring, -spring], [-spring, rotor + spring]])
        G[k] = np.linalg.solve(Z, np.vstack([0.0 * one, one * true["motor.k_pwm"] * 32.0]))[3:]
    assert matrix.inputs == matrix.outputs == robot.joints
    assert_as_linearised(matrix, G, 0.05)


def test_a_rigid_arm_whose_file_init_wrote(tmp_path, capsys):
    urdf = write_urdf(tmp_path / "arm.urdf", ARM)
    motion = ArmMotion(urdf, tuple(ARM))
    topics = {"/joint_states": motion.states(), "/motor_command": motion.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "arm.mcap", motion.times, topics)
    assert main(["init", str(urdf), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 0
    robot = load_robot(tmp_path / "arm.yaml")
    no_friction = [part for joint in ARM for part in ("--set", f"{joint}.coulomb_torque=0")]
    matrix, q, true = shaken(tmp_path / "mine", tmp_path / "arm.yaml", *no_friction)
    said = capsys.readouterr().out
    assert f"jointscope frequency {tmp_path / 'mine' / 'frequency_1.mcap'}" in said and "section `frequency`" in said
    assert f"jointscope calibrate {tmp_path / 'arm.yaml'}" in said
    M, slope = mass_and_slope(model_of(robot), q)
    rotors = np.diag([true[f"{joint}.inertia"] for joint in ARM])
    s = 2j * np.pi * matrix.frequencies[:, None, None]
    assert_as_linearised(matrix, np.linalg.inv((M + rotors) * s**2 + slope), 0.03)


def with_bearings(model, joints):
    """The same chain, with two more hinges behind some joints, which turn with the arm."""
    made, last = pin.Model(), {0: 0}
    made.gravity = model.gravity
    x, y, z = np.eye(3)
    for j in range(1, model.njoints):
        axes = [z, y, x] if model.names[j] in joints else [z]
        at, place = last[model.parents[j]], model.jointPlacements[j]
        for axis, name in zip(axes, ("", ".y", ".x"), strict=False):
            hinge = pin.JointModelRevoluteUnaligned(axis)
            at, place = made.addJoint(at, hinge, place, model.names[j] + name), pin.SE3.Identity()
        made.appendBodyToJoint(at, model.inertias[j], pin.SE3.Identity())
        last[j] = at
    return made


@pytest.mark.slow
def test_an_arm_of_poses_alone_gets_drives_and_is_shaken_with_its_bearings(tmp_path, capsys):
    robot = load_robot("panda")
    straight = [part for name in error_names(robot.joints) for part in ("--set", f"{name}=0")]
    matrix, motors, true = shaken(tmp_path / "panda", "panda", *QUIET, *straight)
    assert "--set panda_joint1.inertia=" in capsys.readouterr().out
    soft = [joint for joint in robot.joints if f"{joint}.bearing.stiffness_x" in true]
    model = with_bearings(model_of(robot), soft)
    places = [model.joints[model.getJointId(joint)].idx_q for joint in robot.joints]
    P = np.eye(model.nv)[:, places]
    tilts = np.diag([0.0 if "." not in n else true[f"{n[:-2]}.bearing.stiffness_{n[-1]}"] for n in model.names[1:]])
    losses = np.diag([0.0 if "." not in n else true[f"{n[:-2]}.bearing.damping_{n[-1]}"] for n in model.names[1:]])
    parts = ("stiffness", "damping", "inertia")
    K, D, J = (np.diag([true[f"{joint}.{part}"] for joint in robot.joints]) for part in parts)
    q = P @ motors
    for _ in range(5):  # at rest under its weight
        weight = pin.computeGeneralizedGravity(model, model.createData(), q)
        q = P @ motors - np.linalg.solve(tilts + P @ K @ P.T, weight)
    M, slope = mass_and_slope(model, q)
    G = np.empty_like(matrix.G)
    for k, f in enumerate(matrix.frequencies):
        s = 2j * np.pi * f
        drive = K + D * s
        arm = M * s**2 + slope + tilts + losses * s + P @ drive @ P.T
        Z = np.block([[arm, -P @ drive], [-drive @ P.T, J * s**2 + drive]])
        G[k] = np.linalg.inv(Z)[model.nv :, model.nv :]
    # below, the controller leaves less torque of the wrist than its measurement is off
    assert_as_linearised(matrix, G, 0.05, above=2.0)
