# SPDX-License-Identifier: BSD-3-Clause
"""Motors whose current is known: torque by a constant that is calibrated, and no back-EMF."""

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot

TRUE, GUESS = 12.0, 7.0  # [N m/A] on the link side


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("current")


def robot_with(folder, constant, name="current.yaml", unit="A"):
    """The ready robot with currents as commands."""
    ready = load_robot("doggy")
    kept = []
    for line in ready.path.read_text(encoding="utf-8").splitlines():
        if line.strip().startswith(("motor.k_pwm", "motor.supply_voltage")):
            continue
        if line.strip().startswith("motor.k_mi"):
            line = f"  motor.torque_constant: {{value: {constant}, unit: N m/A, prior_sigma: {constant}}}"
        kept.append(line.replace("unit: duty ", f"unit: {unit} ").replace("urdf: doggy.urdf", "urdf: current.urdf"))
    urdf = ready.tree.urdf.read_text(encoding="utf-8").replace('effort="0"', 'effort="60"')
    (folder / "current.urdf").write_text(urdf, encoding="utf-8")
    (folder / name).write_text("\n".join(kept), encoding="utf-8")
    return load_robot(folder / name)


def test_torque_is_current_times_constant_and_speed_costs_none(folder):
    robot = robot_with(folder, TRUE)
    model = ElasticJoints(robot)
    p = np.array([robot.parameters[name].value for name in model.names])
    x = np.zeros((1, robot.layout.size))
    x[:, robot.layout.velocities] = 0.7
    a = [model.accelerations(x, np.full((1, 3), amperes), p)[0, 3:] for amperes in (0.0, 2.0)]
    np.testing.assert_allclose(a[1] - a[0], 2.0 * TRUE / robot.parameters["motor.inertia"].value)
    # link and motor at one speed: only the friction brakes
    friction = [robot.parameters[f"{joint}.coulomb_torque"].value for joint in robot.joints]
    np.testing.assert_allclose(a[0] * robot.parameters["motor.inertia"].value, -np.array(friction), rtol=1e-6)


def test_derivatives_are_those_of_differences(folder):
    robot = robot_with(folder, TRUE)
    model = ElasticJoints(robot)
    rng = np.random.default_rng(3)
    x, u = rng.normal(size=(4, robot.layout.size)), rng.normal(size=(4, 3))
    p = np.array([robot.parameters[name].value for name in model.names])
    k = model.names.index("motor.torque_constant")
    h = np.zeros(len(p))
    h[k] = 1e-4
    slope = (model.accelerations(x, u, p + h) - model.accelerations(x, u, p - h)) / 2e-4
    np.testing.assert_allclose(model.with_derivatives(x, u, p).by_parameter[:, :, k], slope, rtol=1e-6, atol=1e-8)


@pytest.mark.slow
def test_the_constant_is_calibrated_from_a_simulated_recording(folder):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    recording = simulate(robot_with(folder, TRUE), "calibration", 8.0, seed=3, friction="smooth").recording
    assert recording.command.unit == "A"
    found = calibrate(robot_with(folder, GUESS, "guess.yaml"), [recording]).robot.parameters["motor.torque_constant"]
    assert found.value == pytest.approx(TRUE, rel=0.03)
    assert abs(found.value - TRUE) < 4.0 * found.sigma


def test_a_current_without_its_constant_is_refused(folder):
    robot_with(folder, TRUE)
    text = (folder / "current.yaml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if "torque_constant" not in line]
    (folder / "without.yaml").write_text("\n".join(kept), encoding="utf-8")
    with pytest.raises(RobotError, match=r"'motor.torque_constant' is missing, or 'joint1.torque_constant'"):
        load_robot(folder / "without.yaml")
