# SPDX-License-Identifier: BSD-3-Clause
"""A robot file from a URDF and a bag: what is guessed is right, and what cannot be guessed is said."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.screening import screen
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import add_verb
from jointscope.tools.init.robot_guess import guess_robot
from jointscope.tools.init.streams.other_joints import Typed
from jointscope.tools.init.streams.sensor_noise import guess_noise
from jointscope.tools.verdicts.judgement import judge

REAL = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real"
CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason="shared/data/real is not beside the project")
STEP = 2e-4  # [rad] of the encoders
GYRO_SIGMA = 2e-3  # [rad/s]


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


def moving(doggy, seed=4, seconds=10.0):
    """A recording of rigid joints; rates of bodies are differences of their orientations."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, seconds, 2e-3)
    speeds, phases = rng.uniform(2.0, 12.0, (3, 3)), rng.uniform(0.0, 6.0, (3, 3))

    def path(t):
        return np.column_stack([0.15 * np.sin(np.outer(t, speeds[j]) + phases[j]).sum(axis=1) for j in range(3)])

    q, h = path(times), 1e-5
    v = (path(times + h) - path(times - h)) / (2 * h)
    a = (path(times + 1e-3) - 2 * q + path(times - 1e-3)) / 1e-6
    torque = doggy.tree.torque(q, v, a) + 8.0 * v + 1.5 * np.sign(v) + 1.0 * a
    streams = {
        "command": (np.clip(torque / (1.1 * np.abs(torque).max()), -1, 1), "1"),
        "motor_encoder": (STEP * np.rint(q / STEP), "rad"),
    }
    for gyro in doggy.gyros:
        before, after = (doggy.tree.body_poses(gyro.body, path(times + s * h))[0] for s in (-1, 1))
        spin = np.einsum("kji,kjl->kil", doggy.tree.body_poses(gyro.body, q)[0], (after - before) / (2 * h))
        omega = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
        noise = GYRO_SIGMA * rng.standard_normal(omega.shape)
        streams[gyro.name] = (omega @ gyro.R_imu_body.T + gyro.bias + noise, "rad/s")
    channels = {"command": tuple(f"{j}.command" for j in doggy.joints)}
    channels |= {name: sensor.channels for name, sensor in doggy.sensors.items()}
    found = {name: Stream(name, times, values, channels[name], unit) for name, (values, unit) in streams.items()}
    return Recording("", "", 10**18, found)


def written(folder, recording, robot, **changes):
    """A bag of a recording in which some streams were multiplied."""
    streams = {
        name: replace(stream, values=stream.values * np.asarray(changes.get(name, 1.0)))
        for name, stream in recording.streams.items()
    }
    write_bag(folder / "run.mcap", replace(recording, streams=streams), robot)
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def bag(doggy, tmp_path_factory):
    return written(tmp_path_factory.mktemp("init"), moving(doggy), doggy)


def run(*arguments):
    parser = argparse.ArgumentParser()
    add_verb(parser.add_subparsers(), "init")
    args = parser.parse_args(["init", *map(str, arguments)])
    return args.run(args)


def test_the_file_can_be_used_and_every_guess_is_marked_with_its_reason(doggy, bag, tmp_path, capsys):
    assert run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml", "--json", tmp_path / "own.json") == 0
    robot = load_robot(tmp_path / "own.yaml")
    assert robot.joints == doggy.joints and robot.command.unit == "duty"
    assert read_recording(bag, robot).sample_count > 10_000
    said, content = capsys.readouterr().out, json.loads((tmp_path / "own.json").read_text())
    assert content["usable"] is True and content["problem"] is None
    marked = [line for line in (tmp_path / "own.yaml").read_text().splitlines() if "GUESS: " in line]
    assert len(marked) == len(content["guesses"]) > 8
    told = [guess for guess in content["guesses"] if not guess.startswith("parameters:")]
    plain = str.maketrans("", "", "[]'")
    assert len(told) > 7 and all(guess.translate(plain) in said.translate(plain) for guess in told)
    assert "['" not in said


def test_joints_with_a_gyro_behind_them_get_a_spring(doggy, bag, tmp_path):
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    assert robot.choices.rigid_joints == ()
    assert robot.parameters["joint2.stiffness"].value > 0.0


@pytest.mark.slow
def test_a_calibration_from_a_guessed_file_finds_the_truth(doggy, doggy_data, tmp_path):
    """Of a robot made elsewhere, knowing its URDF, its supply and that its weight is compensated."""
    run(doggy.tree.urdf, doggy_data / "clean" / "train", "-o", tmp_path / "own.yaml")
    text = (tmp_path / "own.yaml").read_text()
    text = text.replace("supply_voltage: 24.0", "supply_voltage: 32.0").replace("[0.0, 0.0, -9.81]", "[0.0, 0.0, 0.0]")
    (tmp_path / "own.yaml").write_text(text)
    robot = load_robot(tmp_path / "own.yaml")
    found = calibrate(robot, [read_recording(doggy_data / "clean" / "train", robot)]).robot.parameters
    true = json.loads((doggy_data / "clean" / "truth.json").read_text())["train"]["params"]
    for j, joint in enumerate(doggy.joints):
        for law, name in (("stiffness", "ks"), ("damping", "ds"), ("coulomb_torque", "mu")):
            assert found[f"{joint}.{law}"].value == pytest.approx(true[name][j], rel=0.01)
        for law, name in (("k_pwm", "kpwm"), ("k_mi", "kmi"), ("inertia", "b")):
            assert found[f"{joint}.{law}"].value == pytest.approx(true[name], rel=0.01)


def case(name, tmp_path, *options):
    """A robot file of one of the small inputs, what `init` wrote as JSON, and the truth."""
    bag, urdf = CASES / f"{name}.mcap", CASES / f"{name}.urdf"
    if not bag.is_file():
        pytest.skip(f"shared/cases/{name}.mcap is not beside the project")
    assert run(urdf, bag, "-o", tmp_path / "own.yaml", "--json", tmp_path / "own.json", *options) == 0
    truth = json.loads((CASES / f"{name}.truth.json").read_text())
    return load_robot(tmp_path / "own.yaml"), json.loads((tmp_path / "own.json").read_text())["drives"], truth


@needs_cases
@pytest.mark.parametrize(("name", "unit"), [("arm_viscous", "N m"), ("arm_amps", "A"), ("arm_coarse", "duty")])
def test_drives_of_an_arm_are_found_with_unit_and_viscous_friction(tmp_path, name, unit):
    robot, drives, truth = case(name, tmp_path)
    assert robot.command.unit == unit and robot.command.scale == (1.0, 1.0, 1.0)
    for j, joint in enumerate(truth["joints"]):
        right = {"gain": "k", "inertia": "inertia", "dry": "coulomb", "viscous": "viscous"}
        for mine, theirs in right.items():
            found, value = drives[joint][mine], truth[theirs][j]
            assert abs(found["value"] - value) < max(0.01 * value, 3.5 * found["sigma"]), (joint, mine)
            assert found["sigma"] < 0.25 * value
        assert drives[joint]["explained"] > 0.99 and drives[joint]["lost"] == []
        assert robot.drive_parameter(joint, "inertia").value == pytest.approx(truth["inertia"][j], rel=0.05)
        if unit == "duty":
            per_duty = robot.drive_parameter(joint, "k_pwm").value * robot.command_volts
            assert per_duty == pytest.approx(truth["k"][j], rel=0.02) and not robot.effects
        else:
            assert robot.has_effect("motor_viscous", joint)
            viscous = robot.parameters[f"{joint}.motor_viscous.coefficient"]
            assert viscous.value == pytest.approx(truth["viscous"][j], rel=0.01) and viscous.null == 0.0


@needs_cases
def test_the_table_of_drives_is_printed_with_sigmas_and_units(tmp_path, capsys):
    case("arm_amps", tmp_path)
    lines = capsys.readouterr().out.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("drives by regression"))
    assert "k [N m/A]" in lines[head + 1]
    assert "inertia [kg m2]" in lines[head + 1] and "viscous friction [N m s/rad]" in lines[head + 1]
    assert [line.split()[0] for line in lines[head + 2 : head + 5]] == ["shoulder", "elbow", "wrist"]
    assert all(line.count("+-") == 4 and line.endswith("%") for line in lines[head + 2 : head + 5])


@needs_cases
def test_a_calibration_of_an_arm_begins_and_ends_right(tmp_path):
    robot, _, truth = case("arm_amps", tmp_path)
    bag = CASES / "arm_amps.mcap"
    found = calibrate(robot, [read_recording(bag, robot)]).robot.parameters
    for j, joint in enumerate(truth["joints"]):
        assert found[f"{joint}.torque_constant"].value == pytest.approx(truth["k"][j], rel=2e-3)
        assert found[f"{joint}.motor_viscous.coefficient"].value == pytest.approx(truth["viscous"][j], rel=5e-3)
        assert found[f"{joint}.coulomb_torque"].value == pytest.approx(truth["coulomb"][j], rel=5e-3)


@needs_cases
def test_commands_that_are_too_weak_for_the_masses_are_currents(tmp_path):
    """One axis along gravity shows ratios only; those are said to be ratios, and the priors are wide."""
    run(CASES / "measured_effort.urdf", CASES / "measured_effort.mcap", "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    text = (tmp_path / "own.yaml").read_text()
    assert robot.command.unit == "A" and "N m would be too little for the masses of shoulder" in text
    assert "ratios of drive values only" in text
    constant = robot.parameters["shoulder.torque_constant"]
    assert constant.prior_sigma == pytest.approx(5.0 * constant.value, rel=0.01)
    # the truth has the same ratio of constant to friction
    assert constant.value / robot.parameters["shoulder.coulomb_torque"].value == pytest.approx(2.0 / 0.5, rel=0.01)


def test_gyros_are_put_on_their_links_and_turned_as_they_are_mounted(doggy, bag):
    guess = guess_robot(Typed(doggy.tree.urdf, bag))
    assert [(gyro.name, gyro.mount.body) for gyro in guess.gyros] == [("imu1", "link1"), ("imu2", "link3")]
    first, second = (gyro.mount for gyro in guess.gyros)
    assert first.open_axis and not second.open_axis
    np.testing.assert_allclose(second.R_imu_body, doggy.gyros[1].R_imu_body, atol=1e-9)
    # what the axis of joint 1 becomes is seen, the turn about it is not
    np.testing.assert_allclose(first.R_imu_body[:, 2], doggy.gyros[0].R_imu_body[:, 2], atol=1e-9)


def test_noise_is_found_from_steps_and_from_roughness(doggy, bag):
    guess = guess_robot(Typed(doggy.tree.urdf, bag))
    assert guess.encoder_noise[0].sigma == pytest.approx(STEP / np.sqrt(12.0), rel=1e-3)
    assert guess.gyros[0].noise.sigma == pytest.approx(GYRO_SIGMA, rel=0.15)


def test_irregular_sampling_of_a_fast_motion_is_no_noise():
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(0.002, 0.018, 3000))
    smooth = np.sin(6.0 * times)[:, None]
    found = guess_noise(times, smooth + 1e-3 * rng.standard_normal(smooth.shape), "rad")
    assert found.sigma == pytest.approx(1e-3, rel=0.2)


@pytest.mark.slow
def test_a_joint_that_counts_backwards_gets_a_sign(doggy, tmp_path):
    bag = written(tmp_path, moving(doggy), doggy, motor_encoder=[1.0, -1.0, 1.0])
    # axes at right angles: the mirrored robot turns its gyroscopes alike, only its command tells which joint it is
    found = guess_robot(Typed(doggy.tree.urdf, bag)).encoder_signs
    assert found.signs == (1.0, -1.0, 1.0)
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    seen = read_recording(bag, robot).streams["motor_encoder"].values
    raw = read_recording(bag, doggy).streams["motor_encoder"].values
    np.testing.assert_allclose(seen, raw * found.signs)
    assert not any(gyro.left_handed for gyro in robot.gyros)


@pytest.mark.slow
def test_a_counter_that_begins_anew_is_continued(doggy, tmp_path):
    recording = moving(doggy)
    encoder = recording.streams["motor_encoder"]
    wrapped = replace(encoder, values=encoder.values % (2.0 * np.pi))
    streams = {**recording.streams, "motor_encoder": wrapped}
    bag = written(tmp_path, replace(recording, streams=streams), doggy)
    with pytest.raises(RecordingError, match=r"begins anew; set `wraps` of sensors\.motor_encoder"):
        screen(read_recording(bag, doggy), doggy)
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    assert robot.motor_encoder.source.wraps == pytest.approx(2.0 * np.pi)
    seen = read_recording(bag, robot).streams["motor_encoder"].values
    np.testing.assert_allclose(np.diff(seen, axis=0), np.diff(encoder.values, axis=0), atol=1e-6)
    # block by block, as a replay reads it
    blocks = list(ArrivalReader(bag, robot, block=777))
    online = np.concatenate([block.values[block.names.index("motor_encoder")] for block in blocks])
    np.testing.assert_allclose(online, seen, atol=1e-9)


def test_a_motor_that_turns_against_its_command_gets_a_sign(doggy, tmp_path):
    bag = written(tmp_path, moving(doggy), doggy, command=[1.0, 1.0, -1.0])
    assert [drive.sign for drive in guess_robot(Typed(doggy.tree.urdf, bag)).drives] == [1.0, 1.0, -1.0]
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    assert load_robot(tmp_path / "own.yaml").command.scale == (1.0, 1.0, -1.0)


def test_a_gyro_in_degrees_is_seen(doggy, tmp_path):
    bag = written(tmp_path, moving(doggy), doggy, imu2=180.0 / np.pi)
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    assert [gyro.source.unit for gyro in robot.gyros] == ["rad/s", "deg/s"]
    assert robot.gyros[1].sigma == pytest.approx(GYRO_SIGMA, rel=0.15)


def test_other_joint_names_in_the_messages_are_taken_in_order(doggy, tmp_path):
    names = ("a", "b", "c")
    sensors = {"motor_encoder": replace(doggy.motor_encoder, source=replace(doggy.motor_encoder.source, names=names))}
    renamed = replace(doggy.with_sensors(sensors), command=replace(doggy.command, names=names))
    bag = written(tmp_path, moving(doggy), renamed)
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    assert load_robot(tmp_path / "own.yaml").motor_encoder.source.names == names


def test_a_bag_without_a_drive_is_refused_with_what_to_record(doggy, tmp_path):
    bag = written(tmp_path, moving(doggy), doggy, command=0.0)
    with pytest.raises(RecordingError, match="nothing in the bag drives the motors"):
        run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml")
    assert not (tmp_path / "own.yaml").exists()


def test_links_without_masses_need_encoders_on_the_links(doggy, bag, tmp_path):
    text = doggy.tree.urdf.read_text()
    while "<inertial>" in text:
        start, end = text.index("<inertial>"), text.index("</inertial>") + len("</inertial>")
        text = text[:start] + text[end:]
    (tmp_path / "light.urdf").write_text(text)
    with pytest.raises(RobotError, match="no inertias for all moving links, and the bag no encoders"):
        run(tmp_path / "light.urdf", bag, "-o", tmp_path / "own.yaml")


def test_an_unknown_joint_is_named(doggy, bag, tmp_path):
    with pytest.raises(RecordingError, match="no moving joint 'elbow'"):
        run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml", "--joints", "joint1,elbow")


@pytest.mark.slow
@needs_real
def test_a_series_elastic_arm_is_recognised(tmp_path):
    arm = load_robot("hebi_5r")
    run(arm.tree.urdf, REAL / "hebi_arms_mit" / "arm5_capstone_robot_data", "-o", tmp_path / "arm.yaml")
    robot = load_robot(tmp_path / "arm.yaml")
    assert robot.free_links and not robot.motor_encoder.zero_known
    assert robot.link_encoder.source.topic == "/link_states" and robot.torque_sensor is not None
    carriers = {gyro.name: robot.tree.joints_below(gyro.body) for gyro in robot.gyros}
    assert carriers == {gyro.name: arm.tree.joints_below(gyro.body) for gyro in arm.gyros}


@needs_real
def test_axes_without_a_second_encoder_are_left_out(tmp_path):
    run(load_robot("kr300").tree.urdf, REAL / "kr300" / "traj_A", "-o", tmp_path / "own.yaml")
    robot = load_robot(tmp_path / "own.yaml")
    assert robot.joints == ("joint_a1", "joint_a2", "joint_a3")
    assert robot.command.topic == "/joint_states" and robot.command.unit == "N m"


def test_a_unit_that_is_said_is_taken(doggy, bag, tmp_path):
    run(doggy.tree.urdf, bag, "-o", tmp_path / "own.yaml", "--unit", "V")
    assert load_robot(tmp_path / "own.yaml").command.unit == "V"
    assert "as you said" in (tmp_path / "own.yaml").read_text()


@needs_cases
@pytest.mark.slow
def test_a_chain_of_24_joints_of_which_two_move_is_right_in_three_commands(tmp_path):
    robot, _, truth = case("arm_many_joints", tmp_path)
    assert robot.joints == ("j1", "j2") and len(robot.tree.locked) == 22
    bag = CASES / "arm_many_joints.mcap"
    result = calibrate(robot, [read_recording(bag, robot)])
    table = {p.name: p for p in result.parameters}
    for law, theirs in (
        ("inertia", "inertia"),
        ("coulomb_torque", "coulomb"),
        ("motor_viscous.coefficient", "viscous"),
    ):
        for joint, value in zip(robot.joints, truth[theirs], strict=True):
            found = table[f"{joint}.{law}"]
            assert abs(found.value - value) < 3.5 * found.sigma, (joint, law)
            assert found.sigma < 0.1 * value
    assert judge(result).level in ("good", "warn")
