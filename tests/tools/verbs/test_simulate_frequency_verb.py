# SPDX-License-Identifier: BSD-3-Clause
"""`simulate --kind frequency`: the bags, the excitation they tell of and the truth, and what is refused."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import yaml

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.bags.read_signals import read_signals
from jointscope.tools.command_line import main

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

POSE = [0.1, 0.72, 0.62, 1.2, 1.0, 0.3]
KIND = ["simulate", "tx90l", "--kind", "frequency"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shaken") / "arm"
    options = ["--realisations", "1", "--highest", "30", "--seed", "5", "--friction", "smooth"]
    arguments = [*KIND, "-o", str(folder), *options, "--pose", ",".join(map(str, POSE))]
    assert main([*arguments, "--json", str(folder.parent / "said.json")]) == 0
    return folder


@pytest.mark.slow
def test_commands_of_the_bag_are_the_multisines_of_the_description(written):
    told = yaml.safe_load((written / "excitation.yaml").read_text())
    lines, phases, amplitude = (np.array(told[name]) for name in ("lines", "phases", "amplitude"))
    commands, _ = read_signals(written / "frequency_1.mcap", "/motor_command:effort")
    x = commands.inputs
    for e in told["experiments"]:
        rows = (x.times > e["start"] - 5e-4) & (x.times < e["start"] + e["periods"] / told["f0"] - 5e-4)
        t, turn = x.times[rows] - e["start"], 2.0 * np.pi * np.arange(3) * e["experiment"] / 3.0
        waves = np.cos(2.0 * np.pi * told["f0"] * t[:, None, None] * lines + phases[e["realisation"]] + turn[:, None])
        expected = e["sign"] * amplitude * waves.sum(axis=2)
        np.testing.assert_allclose(x.values[rows], expected, atol=1e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_the_arm_is_shaken_about_its_pose_and_the_truth_stands_beside_it(written, capsys, tmp_path):
    signals, excitation = read_shaken(written / "frequency_1.mcap", load_robot("tx90l"))
    np.testing.assert_allclose(signals.outputs.values.mean(axis=0), POSE, atol=5e-3)
    assert excitation.lines[-1] * excitation.f0 == 29.75 and excitation.carrier == 0.75
    truth = json.loads((written.parent / "arm.truth.json").read_text())
    said = json.loads((written.parent / "said.json").read_text())
    assert said["bags"] == [str(written / "frequency_1.mcap")] and said["truth"] == truth
    assert truth["poses"] == {"frequency_1": POSE} and truth["friction"] == "smooth" and truth["seed"] == 5
    found = tmp_path / "found.json"
    capsys.readouterr()
    assert main(["frequency", str(written / "frequency_1.mcap"), "--json", str(found)]) == 0
    assert "60 lines" in capsys.readouterr().out and found.is_file()


def test_a_file_in_place_of_a_folder_and_poses_that_are_none_are_refused(tmp_path, capsys):
    out = str(tmp_path / "arm")
    for arguments, text in (
        (["-o", f"{out}.mcap"], "a bag of each pose goes into a folder"),
        (["-o", out, "--pose", "0.1,none"], "--pose 0.1,none: expected angles"),
        (["-o", out, "--pose", "0.1,0.2"], "a pose of tx90l has 6 angles"),
        (["-o", out, "--realisations", "0"], "expected 1 or more"),
        (["-o", out, "--highest", "490"], "lines up to 490 Hz need samples at 1089 Hz"),
    ):
        assert main([*KIND, *arguments]) == 1
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and text in error
    assert not list(tmp_path.iterdir())


def robot_like(folder, ready, *changes):
    """A copy of a ready robot with other texts in its URDF and robot file."""
    robot = load_robot(ready)
    for path in (robot.path, robot.tree.urdf):
        text = path.read_text()
        for old, new in changes:
            text = re.sub(old, new, text)
        (folder / path.name).write_text(text)
    return folder / robot.path.name


def test_a_robot_that_cannot_be_shaken_is_refused_with_what_to_do(tmp_path, capsys):
    for name in ("weak", "weak_volts", "stiff"):
        (tmp_path / name).mkdir()
    weak = robot_like(tmp_path / "weak", "panda", ('effort="87.0"', 'effort="8.0"'))
    low = ("motor.supply_voltage: [0-9.]+", "motor.supply_voltage: 0.01")
    weak_volts = robot_like(tmp_path / "weak_volts", "biorob", low)
    stiff = robot_like(tmp_path / "stiff", "panda", (r"  panda_joint[0-9].stiffness: .*\n", ""))
    for robot, more, text in (
        ("doggy", ["--share", "1.5"], "share 1.5 of the drives: expected more than 0 and less than 1"),
        ("doggy", ["--f0", "0.7"], "f0 0.7 Hz: expected a period of a whole number of samples of 1 ms"),
        ("doggy", ["--f0", "200"], "lines up to 100 Hz: the lowest is at f0, 200 Hz"),
        ("doggy", ["--pose", "0,1"], "a pose of doggy has 3 angles"),
        ("kr300", [], "link_dynamics: free"),
        (weak, [], "cannot hold the weight in a pose; name another --pose"),
        (weak_volts, ["--pose", "0,1.5,0,0"], "N m to hold the pose [0.0, 1.5, 0.0, 0.0]; name another --pose"),
        (stiff, [], "has neither `command` and `sensors` nor a drive with a stiffness; add"),
    ):
        assert main(["simulate", str(robot), "--kind", "frequency", "-o", str(tmp_path / "arm"), *more]) == 1
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and text in error
    assert not (tmp_path / "arm").exists()


def test_a_file_says_what_goes_in_and_out_and_that_commands_are_held(tmp_path, capsys):
    folder = tmp_path / "doggy"
    options = ["--f0", "2", "--highest", "40", "--realisations", "1", "--periods", "3", "--seed", "3"]
    assert main(["simulate", "doggy", "--kind", "frequency", "-o", str(folder), *options]) == 0
    values = f"jointscope calibrate doggy {folder / 'frequency_1.mcap'} -o doggy_calibrated.yaml\n"
    assert values in capsys.readouterr().out  # with all that the verb needs
    told = yaml.safe_load((folder / "excitation.yaml").read_text())
    assert told["inputs"] == "/motor_command:effort:joint1,joint2,joint3" and told["held"] is True
    assert told["outputs"] == "/joint_states:position:joint1,joint2,joint3"
    assert told["lines"] == list(range(1, 21, 2)) and len(told["experiments"]) == 6
    assert all(e["periods"] == 5 and e["transient"] == 2 for e in told["experiments"])
    signals, _ = read_signals(folder / "frequency_1.mcap")
    assert signals.inputs.held and not signals.outputs.held and signals.inputs.names == ("joint1", "joint2", "joint3")
    own, _ = read_signals(folder / "frequency_1.mcap", "/motor_command:effort:joint2")
    assert own.inputs.held and own.inputs.names == ("joint2",)  # named by the user: the same field
    other, _ = read_signals(folder / "frequency_1.mcap", "/joint_states:position:joint2")
    assert not other.inputs.held
    (folder / "excitation.yaml").write_text("held: perhaps")
    capsys.readouterr()
    assert main(["frequency", str(folder / "frequency_1.mcap")]) == 1
    assert "excitation.yaml: held: expected true or false" in capsys.readouterr().err
