# SPDX-License-Identifier: BSD-3-Clause
"""Nothing is tuned to Doggy: an arm with gravity, torque commands, other names, units and rates, integrated here."""

import numpy as np
import pinocchio as pin
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare
from jointscope.graphs.problem.bag_problem import starts_at_rest
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream

URDF = """<robot name="arm"><link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="10" lower="-3" upper="3"/></joint>
<link name="upper"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
 <inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/>
 <axis xyz="0 1 0"/><limit effort="100" velocity="10"/></joint>
<link name="fore"><inertial><origin xyz="0 0 0.15"/><mass value="2"/>
 <inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""

YAML = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
model: {friction_sharpness: 100.0}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: deg, sigma: 1.0e-4}
  wrist: {kind: gyro, topic: /wg, type: sensor_msgs/msg/Imu, field: angular_velocity, unit: deg/s, body: fore,
          sigma: 2.0e-3, R_imu_body: {value: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
parameters:
  shoulder.inertia: {value: 0.3, unit: kg m2}
  elbow.inertia: {value: 0.3, unit: kg m2}
  shoulder.coulomb_torque: {value: 1.0, unit: N m}
  elbow.coulomb_torque: {value: 1.0, unit: N m}
  shoulder.stiffness: {value: 150.0, unit: N m/rad}
  elbow.stiffness: {value: 150.0, unit: N m/rad}
  shoulder.damping: {value: 1.0, unit: N m s/rad}
  elbow.damping: {value: 1.0, unit: N m s/rad}
noise: {link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}
"""
INERTIA, FRICTION = np.array([0.5, 0.2]), np.array([1.5, 0.6])
STIFFNESS, DAMPING = np.array([300.0, 90.0]), np.array([0.8, 0.3])
TRUTH = {
    f"{joint}.{law}": values[i]
    for law, values in (
        ("inertia", INERTIA),
        ("coulomb_torque", FRICTION),
        ("stiffness", STIFFNESS),
        ("damping", DAMPING),
    )
    for i, joint in enumerate(("shoulder", "elbow"))
}


def _integrate(urdf, seconds, command_rate=400.0, fine=10):
    """States on a fine grid and commands of a PD controller, by Runge-Kutta on pinocchio's aba."""
    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()

    def rate(x, u):
        q, v, theta, omega = np.split(x, 4)
        tau = STIFFNESS * (q - theta) + DAMPING * (v - omega)
        a_motor = (tau + u - FRICTION * np.tanh(100.0 * omega)) / INERTIA
        return np.concatenate([v, pin.aba(model, data, q, v, -tau), omega, a_motor])

    h = 1.0 / command_rate / fine
    x, states, commands = np.zeros(8), [], []
    for k in range(int(seconds * command_rate)):
        t = k / command_rate
        target = np.array(
            [0.4 * np.sin(2.5 * t) + 0.2 * np.sin(10.7 * t), 0.5 * np.sin(3.8 * t) + 0.2 * np.sin(18 * t)]
        )
        u = np.clip(120 * (target * min(t, 1.0) - x[4:6]) - 6 * x[6:8], -60, 60)
        commands.append(u)
        for _ in range(fine):
            states.append(x)
            k1 = rate(x, u)
            k2 = rate(x + h / 2 * k1, u)
            k3 = rate(x + h / 2 * k2, u)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(x + h * k3, u))
    return np.array(states), np.array(commands), h


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The robot at its start values, and six seconds of motion with streams of three unrelated rates."""
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.urdf").write_text(URDF)
    (folder / "arm.yaml").write_text(YAML)
    robot = load_robot(folder / "arm.yaml")
    x, u, h = _integrate(folder / "arm.urdf", 6.0)
    t, rng = np.arange(len(x)) * h, np.random.default_rng(0)
    at_encoder, at_gyro = np.arange(3, len(t), 9), np.arange(5, len(t), 23)
    # a planar arm: the forearm turns about y with the sum of both rates
    omega = np.zeros((len(at_gyro), 3))
    omega[:, 1] = x[at_gyro, 2] + x[at_gyro, 3]
    angles = x[at_encoder, 4:6] + 1e-4 * rng.normal(size=(len(at_encoder), 2))
    rates = omega + 0.02 + 2e-3 * rng.normal(size=omega.shape)
    streams = {
        "command": Stream("command", t[::10], u, ("shoulder.command", "elbow.command"), "N m"),
        "enc": Stream("enc", t[at_encoder], angles, robot.sensors["enc"].channels, "rad"),
        "wrist": Stream("wrist", t[at_gyro], rates, robot.sensors["wrist"].channels, "rad/s"),
    }
    return robot, Recording("arm", "", 0, streams)


@pytest.mark.slow
def test_an_arm_with_gravity_torque_commands_and_odd_rates_is_calibrated(arm):
    robot, recording = arm
    result = calibrate(robot, [recording])
    for p in result.parameters[:8]:
        assert p.value == pytest.approx(TRUTH[p.name], rel=0.02), p.name
        assert abs(p.value - TRUTH[p.name]) < 4.0 * p.sigma, p.name
    # it turns about one axis only: the angle about it cannot be seen
    assert next(p for p in result.parameters if p.name == "wrist.R_imu_body.y").note.startswith("not observable")
    model = compare({"arm": result.robot}, recording).models[0]
    assert model.error == pytest.approx(model.floor, rel=0.1)


@pytest.mark.slow
def test_error_is_the_mean_square_of_all_channels_in_sigmas(arm):
    robot, recording = arm
    model = compare({"start": robot}, recording).models[0]
    squares = [(c.horizons["0.1"] / c.noise_sigma) ** 2 for c in model.channels.values()]
    assert model.error == pytest.approx(np.sqrt(np.mean(squares)))
    ahead = model.sensors["enc"]
    residual = (ahead.measured - ahead.ahead)[:, 0]
    expected = np.sqrt(np.nanmean(residual**2))
    assert model.channels["shoulder.motor_position"].horizons["0.1"] == pytest.approx(expected)


@pytest.mark.slow
def test_a_slice_that_starts_in_motion_is_not_taken_for_rest(arm):
    robot, recording = arm
    part = recording.between(3.0, 6.0)
    assert not starts_at_rest(robot, part)
    result = calibrate(robot, [part])
    for p in result.parameters[:8]:
        assert abs(p.value - TRUTH[p.name]) < 4.0 * p.sigma, p.name


def test_a_slice_carries_the_command_that_acts_at_its_start(arm):
    _, recording = arm
    part = recording.between(3.0011, 4.0)
    acting = recording.command.values[np.searchsorted(recording.command.times, 3.0011) - 1]
    assert part.command.times[0] == 3.0011
    np.testing.assert_array_equal(part.command.values[0], acting)


def test_the_same_recording_twice_is_refused(arm):
    robot, recording = arm
    named = [Recording(path, "ab", 0, recording.streams) for path in ("a.mcap", "b.mcap")]
    with pytest.raises(RecordingError, match=r"b\.mcap is the same recording as a\.mcap; give every recording once"):
        calibrate(robot, named)


def test_a_gyro_that_stops_is_named_with_its_time(arm):
    robot, recording = arm
    gyro = recording.streams["wrist"]
    frozen = np.where(gyro.times[:, None] > 2.0, gyro.values[gyro.times <= 2.0][-1], gyro.values)
    streams = recording.streams | {"wrist": Stream("wrist", gyro.times, frozen, gyro.channels, gyro.unit)}
    with pytest.raises(
        RecordingError, match=r"wrist repeats one sample from 1\.99\d to 5\.99\d s: the sensor has stopped"
    ):
        calibrate(robot, [Recording("frozen", "", 0, streams)])


def test_a_command_with_the_wrong_sign_is_said(simulated, doggy):
    command = simulated.recording.command
    flipped = Stream("command", command.times, command.values * [1.0, -1.0, 1.0], command.channels, command.unit)
    streams = simulated.recording.streams | {"command": flipped}
    with pytest.raises(RecordingError, match=r"joint2 moves against its command \(\d+ sigma\)"):
        calibrate(doggy, [Recording("flipped", "", 0, streams)])


@pytest.mark.slow
def test_all_dynamics_fixed_leaves_mounting_and_biases(simulated, doggy):
    from dataclasses import replace

    truth = simulated.truth["parameters"]
    fixed = {n: replace(p, value=truth[n], fixed=True) for n, p in doggy.parameters.items()}
    result = calibrate(replace(doggy, parameters=fixed), [simulated.recording])
    np.testing.assert_allclose(result.robot.sensors["imu2"].bias, truth["imu2.bias"], atol=3e-4)
