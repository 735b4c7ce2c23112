# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate --frequency`: what is written, and what is refused in one line."""

from __future__ import annotations

import json

import pytest
from shaken_arm import TX90L, made_up_bag

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main

OPTION = "--frequency"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return made_up_bag(tmp_path_factory.mktemp("shaken") / "shaken")


def refused(arguments, capsys):
    assert main(["calibrate", *map(str, arguments)]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_a_robot_that_does_not_say_what_is_shaken_is_told_where_to_look(bag, tmp_path, capsys):
    out = tmp_path / "o.yaml"
    assert "doggy.yaml has no section `frequency`" in refused(["doggy", OPTION, bag, "-o", out], capsys)
    assert not out.exists()


def test_other_kinds_and_options_of_motion_are_refused(bag, tmp_path, capsys):
    out = ["-o", tmp_path / "o.yaml"]
    assert "given as motion and as frequency responses" in refused(["tx90l", bag, OPTION, bag, *out], capsys)
    both = ["tx90l", OPTION, bag, "--poses", bag, *out]
    assert "leave it out with --poses" in refused([*both, "--incremental"], capsys)
    moving = refused(["tx90l", tmp_path / "moves.mcap", OPTION, bag, "--incremental", *out], capsys)
    assert "goes along motion alone, and --frequency has none; leave --incremental out" in moving
    assert "--rrd shows motion" in refused([*both, "--rrd", tmp_path / "o.rrd"], capsys)
    assert "leave it out with --frequency" in refused(["tx90l", OPTION, bag, "--incremental", *out], capsys)
    assert "use --report" in refused(["tx90l", OPTION, bag, "--rrd", tmp_path / "o.rrd", *out], capsys)
    assert "--frequency BAG" in refused(["tx90l", *out], capsys)


def test_motion_of_a_robot_of_poses_and_frequencies_names_both_options(bag, tmp_path, capsys):
    error = refused(["tx90l", bag, "-o", tmp_path / "o.yaml"], capsys)
    assert "it describes poses and frequency; give them with --poses or --frequency" in error


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("joints: [joint1, joint2, joint3]  #", "joints: [joint1, joint9]  #", "joints: 'joint9' is no joint"),
        ("joint2.coulomb_torque:", "joint2.other:", "unknown parameter 'joint2.other'"),
        ("value: 3.6, unit: kg m2", "value: 3.6, unit: kg", "expected 'kg m2', got 'kg'"),
    ],
)
def test_mistakes_in_the_robot_file_are_said_with_their_place(old, new, text, tmp_path):
    path = tmp_path / "arm.yaml"
    source = load_robot("tx90l").path.read_text()
    assert old in source
    path.write_text(source.replace(old, new).replace("urdf: tx90l.urdf", "urdf: ready:tx90l/tx90l.urdf"))
    with pytest.raises(RobotError, match=text):
        load_robot(path)


def test_a_motor_that_lacks_its_damper_is_named(tmp_path):
    path = tmp_path / "arm.yaml"
    lines = load_robot("tx90l").path.read_text().splitlines()
    kept = [line for line in lines if not line.strip().startswith("joint2.damping")]
    path.write_text("\n".join(kept).replace("urdf: tx90l.urdf", "urdf: ready:tx90l/tx90l.urdf"))
    with pytest.raises(RobotError, match=r"'joint2.damping' is missing, which `frequency` needs"):
        load_robot(path)


@pytest.mark.slow
@pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project")
def test_robot_file_report_and_json_are_written(tmp_path, capsys):
    names = {"-o": "arm.yaml", "--report": "arm.html", "--json": "arm.json"}
    options = [text for option, name in names.items() for text in (option, str(tmp_path / name))]
    bags = [str(TX90L / "frequency" / f"frequency_{p}") for p in ("P1", "P3")]
    assert main(["calibrate", "tx90l", OPTION, *bags, *options]) == 0
    assert "not identifiable from these poses: joint2.bearing.damping_x" in capsys.readouterr().out
    robot = load_robot(tmp_path / "arm.yaml")
    assert 0.0 < robot.parameters["joint1.stiffness"].sigma < 1000.0
    content = json.loads((tmp_path / "arm.json").read_text())
    assert content["verdict"]["text"] in (tmp_path / "arm.html").read_text()
    assert all(check["name"] and check["verdict"] and check["why"] for check in content["checks"])
    assert content["undetermined"] == [{"joint2.bearing.damping_x": 1.0}]
    assert set(content["frequency"]["entries"]) == {f"{i},{j}" for i in (1, 2, 3) for j in (1, 2, 3)}
    page = (tmp_path / "arm.html").read_text()
    assert "joint2 to joint1 [rad/s^2/(N m)]" in page and "What is left in" in page


@pytest.mark.slow
@pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project")
def test_poses_and_responses_in_one_estimate_write_what_both_kinds_write(tmp_path, capsys):
    names = {"-o": "arm.yaml", "--urdf": "arm.urdf", "--report": "arm.html", "--json": "arm.json"}
    options = [text for option, name in names.items() for text in (option, str(tmp_path / name))]
    bags = [str(TX90L / "frequency" / f"frequency_{p}") for p in ("P1", "P3")]
    poses = ["--poses", str(TX90L / "poses_calibration")]
    assert main(["calibrate", "tx90l", OPTION, *bags, *poses, *options]) == 0
    assert "poses and frequency responses agree" in capsys.readouterr().out
    content = json.loads((tmp_path / "arm.json").read_text())
    assert {"poses", "poses_before", "repeatability", "frequency", "frequency_before"} <= content.keys()
    assert content["agreement"]["p_value"] > 0.01
    page = (tmp_path / "arm.html").read_text()
    assert "Do the kinds agree?" in page and "joint2 to joint1 [rad/s^2/(N m)]" in page and "How far off" in page
    assert load_robot(tmp_path / "arm.yaml").parameters["joint1.stiffness"].sigma < 1000.0
    assert (tmp_path / "arm.urdf").is_file()
