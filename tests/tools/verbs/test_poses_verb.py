# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` and `compare` with --poses: what is read, written and said."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from measured_poses import PANDA, TX90L
from tools_with_targets import tool_with

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.rotations import of_quaternions
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.command_line import main

needs_poses = pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project")


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("poses")
    names = {"-o": "arm.yaml", "--urdf": "arm.urdf", "--report": "arm.html", "--json": "arm.json"}
    options = [text for option, name in names.items() for text in (option, str(folder / name))]
    assert main(["calibrate", "tx90l", "--poses", str(TX90L / "poses_calibration"), *options]) == 0
    return folder


@needs_poses
def test_a_bag_and_the_table_made_of_it_hold_the_same_poses(tx90l):
    bag = read_poses(TX90L / "poses_calibration", tx90l)
    table = read_poses(TX90L / "poses_calibration" / "poses.csv", tx90l)
    assert len(bag) == len(table) == 40
    np.testing.assert_allclose(bag.q, table.q, atol=1e-6)
    np.testing.assert_allclose(bag.target, table.target, atol=1e-5)
    np.testing.assert_allclose(bag.torque, table.torque, atol=0.05)


@needs_poses
def test_robot_file_urdf_report_and_json_are_written(calibrated):
    robot = load_robot(calibrated / "arm.yaml")
    assert robot.parameters["joint3.lz"].sigma < 1e-5
    assert "How far off" in (calibrated / "arm.html").read_text()
    assert load_robot("tx90l").tree.n == robot.tree.n and "<robot" in (calibrated / "arm.urdf").read_text()
    content = json.loads((calibrated / "arm.json").read_text())
    assert content["rank"] == 29 and len(content["undetermined"]) == 18
    assert content["parameters"]["joint3.stiffness"]["unit"] == "N m/rad"
    assert content["samples"] == 40 and content["wall_seconds"] > 0.0
    (used,) = content["recordings"]
    assert used["kind"] == "poses" and used["count"] == 40
    assert all(used["sha256"] in (calibrated / name).read_text() for name in ("arm.yaml", "arm.html"))


@needs_poses
def test_compare_says_millimetres_with_and_without_each_part(calibrated, tmp_path, capsys):
    arguments = ["compare", "tx90l", str(calibrated / "arm.yaml"), "--poses", str(TX90L / "poses_verification")]
    assert main([*arguments, "--json", str(tmp_path / "v.json")]) == 0
    assert "150 poses, distance of the predicted target" in capsys.readouterr().out
    models = json.loads((tmp_path / "v.json").read_text())["models"]
    assert models["arm"]["poses"]["p90_mm"] <= 0.055 and models["arm"]["poses"]["max_mm"] <= 0.11
    assert models["tx90l"]["poses"]["p90_mm"] > 3.0
    parts = models["arm"]["poses"]["parts"]
    assert parts["without sag"]["p90_mm"] > 0.5 < parts["without geometric errors"]["p90_mm"]


@needs_poses
def test_a_calibrated_file_is_the_start_of_the_next_calibration(calibrated, tmp_path, capsys):
    again = ["calibrate", str(calibrated / "arm.yaml"), "--poses", str(TX90L / "poses_verification")]
    assert main([*again, "-o", str(tmp_path / "again.yaml")]) == 0
    assert "Yes, this calibration is good." in capsys.readouterr().out
    assert load_robot(tmp_path / "again.yaml").parameters["joint3.lz"].value == pytest.approx(0.000234, abs=1.5e-5)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["calibrate", "tx90l", "-o", "a.yaml"], "nothing to calibrate from; expected BAG"),
        (
            ["calibrate", "tx90l", "p.csv", "--poses", "p.csv", "-o", "a.yaml"],
            "p.csv is given as motion and as poses; leave it out once",
        ),
        (
            ["calibrate", "tx90l", "--poses", "p.csv", "--incremental", "-o", "a.yaml"],
            "--incremental is for",
        ),
        (
            ["calibrate", "tx90l", "--poses", "none.csv", "-o", "a.yaml"],
            "there is no none.csv; expected a table",
        ),
        (["calibrate", "doggy", "--poses", "p.csv", "-o", "a.yaml"], "doggy.yaml has no section `poses`"),
        (["info", "x.mcap", "--robot", "tx90l"], "it describes poses and frequency; give them with --poses"),
        (["calibrate", "doggy", "x.mcap", "--urdf", "a.urdf", "-o", "a.yaml"], "--urdf writes the geometry found"),
    ],
)
def test_what_does_not_go_together_is_one_line(tmp_path, monkeypatch, capsys, arguments, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.csv").write_text("pose,q1\n0,1\n")
    if "info" in arguments:
        from jointscope.tools.bags.write_bag import write_bag
        from jointscope.tools.simulator import simulate

        doggy = load_robot("doggy")
        write_bag("x.mcap", simulate(doggy, "moves", 1.0, 1).recording, doggy)
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert told in said and said.count("\n") == 1
    assert not (tmp_path / "a.yaml").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "pose,q1,q2,q3,q4,q5,q6,x,y\n0,1,1,1,1,1,1,2,2\n",
            "no column 'z'; expected x, y, z of the target",
        ),
        ("pose,q1,q2,q3,q4,q5,x,y,z\n0,1,1,1,1,1,2,2,2\n", "no column of joint6; expected joint6 or q6"),
        ("pose,q1,q2,q3,q4,q5,q6,x,y,z\n0,1,1,a,1,1,1,2,2,2\n", "line 2, column q3: expected a number, got 'a'"),
        ("pose,q1,q2,q3,q4,q5,q6,x,y,z\n0,1,1,1,1\n", "line 2 has 5 cells, the first line 10"),
        ("pose,q1,q2,q3,q4,q5,q6,x,y,z\n0,1,1,1,1,1,nan,2,2,2\n", "column q6: expected a finite number"),
        ("", "expected a line with the names of the columns"),
        (
            "pose,q1,q2,q3,q4,q5,q6,contact\n0,1,1,1,1,1,1,a\n1,1,1,1,1,1,1, \n",
            "line 3, column contact: expected the name",
        ),
        (
            "pose,q1,q2,q3,q4,q5,q6,x,y,z\n" + "".join(f"{i},{i % 2},1,1,1,1,1,2,2,2\n" for i in range(3)),
            "line 4 repeats line 2 to the last digit, 1 of 3 poses",
        ),
    ],
)
def test_a_table_that_cannot_be_read_says_where(tx90l, tmp_path, text, told):
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(RecordingError, match=told.replace("(", r"\(")):
        read_poses(path, tx90l)


@pytest.mark.parametrize(
    ("angles", "told"),
    [
        ("0.1, 0.25, 0.5, 0.125, -0.3, 0.7", "multiples of 0.001 rad, as commanded ones are"),
        (", ".join(str(np.deg2rad(a)) for a in (10, 20.5, -30, 5, 7, 8)), "multiples of 0.1 deg"),
        ("0.1000034, 0.2538172, 0.5, 0.125, -0.3, 0.7", None),
    ],
)
def test_angles_that_were_commanded_are_told(tx90l, tmp_path, angles, told):
    path = tmp_path / "poses.csv"
    path.write_text("pose,q1,q2,q3,q4,q5,q6,x,y,z\n" + "".join(f"{i},{angles},{i},2,2\n" for i in range(5)))
    texts = [notice.text for notice in read_poses(path, tx90l).notices]
    assert (len(texts) == 1 and told in texts[0]) if told else not texts


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
def test_contacts_and_places_of_a_table(tx90l):
    path = PANDA / "panda_1.csv"
    poses = read_poses(path, tx90l)  # its first six joints have the same names
    assert len(poses) == 182 and len(set(poses.contacts)) == 6
    assert set(poses.groups) == {"back-high", "front", "right"} and poses.target is None


@pytest.mark.parametrize(
    ("places", "told"),
    [
        (("left", "left", "left"), "place left has 3 contacts; expected two"),
        (("left", "right", "table"), "no place has two contacts, so `contact_distance` is not used"),
        (("left", "left", "right"), None),
    ],
)
def test_a_distance_that_no_two_contacts_have_is_told(tx90l, tmp_path, places, told):
    robot = replace(tx90l, poses=replace(tx90l.poses, contact_distance=0.05))
    rows = "".join(
        f"{i},{0.1234567 * i},1,1,1,1,1,{c},{p}\n" for i, (c, p) in enumerate(zip("abc", places, strict=True))
    )
    path = tmp_path / "poses.csv"
    path.write_text("pose,q1,q2,q3,q4,q5,q6,contact,place\n" + rows)
    if len(set(places)) == 1:
        with pytest.raises(RecordingError, match=told):
            read_poses(path, robot)
        return
    texts = [notice.text for notice in read_poses(path, robot).notices]
    assert (len(texts) == 1 and told in texts[0]) if told else not texts


def test_simulate_discover_and_diagnose_on_poses(tmp_path, monkeypatch, capsys):
    pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
    monkeypatch.chdir(tmp_path)
    hidden = ["--seed", "20", "--effect", "joint_elasticity@joint5"]
    assert main(["simulate", "tx90l", "--kind", "poses", "-o", "train.csv", *hidden]) == 0
    assert main(["simulate", "tx90l", "-o", "test.csv", "--session", "others", "--count", "60", *hidden]) == 0
    assert json.loads((tmp_path / "train.truth.json").read_text())["effects"][0]["effect"] == "joint_elasticity"
    capsys.readouterr()
    search = ["--poses", "train.csv", "--holdout-poses", "test.csv", "-o", "found.yaml", "--json", "f.json"]
    assert main(["discover", "tx90l", *search, "--report", "f.html"]) == 0
    assert "joint_elasticity@joint5" in capsys.readouterr().out
    content = json.loads((tmp_path / "f.json").read_text())
    assert [step["added"] for step in content["steps"]] == [None, "joint_elasticity@joint5"]
    assert content["steps"][1]["heldout_error"] < content["steps"][0]["heldout_error"]
    assert content["adequate"] is True and "What was missing" in (tmp_path / "f.html").read_text()
    assert load_robot("found.yaml").parameters["joint5.stiffness"].value == pytest.approx(25000.0, rel=0.3)
    capsys.readouterr()
    assert main(["diagnose", "tx90l", "--poses", "train.csv", "--holdout-poses", "test.csv", "--json", "d.json"]) == 0
    assert "held out: 90 % [mm]" in capsys.readouterr().out
    diagnosed = json.loads((tmp_path / "d.json").read_text())
    assert diagnosed["poses"] == pytest.approx(content["steps"][0]["poses"])
    assert diagnosed["heldout_error"] == diagnosed["by_kind"]["poses"] > 1.2
    first = diagnosed["candidates"][0]
    assert (first["effect"], first["owner"], first["verdict"]) == ("joint_elasticity", "joint5", "missing")


@pytest.mark.parametrize("kind", ["poses", "frequency", "rests"])
def test_a_copy_of_a_recording_is_not_held_out(tmp_path, monkeypatch, capsys, kind):
    monkeypatch.chdir(tmp_path)
    for name in ("a.mcap", "copy.mcap"):
        (tmp_path / name).write_bytes(b"the same")
    assert main(["diagnose", "tx90l", f"--{kind}", "a.mcap", f"--holdout-{kind}", "copy.mcap"]) == 1
    told = f"--holdout-{kind}: copy.mcap is the same recording as a.mcap; give every recording once"
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["discover", "tx90l", "-o", "a.yaml"], "nothing to calibrate from"),
        (["diagnose", "tx90l", "--poses", "p.csv", "--holdout-frequency", "b.mcap"], "goes with --frequency"),
        (
            ["diagnose", "tx90l", "--frequency", "b.mcap", "--holdout-frequency", "b.mcap"],
            "b.mcap is given with --frequency and held out",
        ),
        (
            ["discover", "tx90l", "--poses", "p.csv", "--holdout-poses", "p.csv", "-o", "a.yaml"],
            "p.csv is given with --poses and held out; leave it out once",
        ),
        (["discover", "doggy", "a.mcap", "--frequency", "b.mcap", "-o", "a.yaml"], "doggy.yaml has no section `freq"),
        (
            ["discover", "doggy", "a.mcap", "--poses", "b.csv", "-o", "a.yaml", "--rrd", "a.rrd"],
            "--rrd shows motion alone; leave it out where several kinds are searched",
        ),
        (
            ["discover", "doggy", "a.mcap", "--poses", "b.csv", "-o", "a.yaml", "--restart"],
            "--restart: a search over several kinds keeps no steps on disk; leave it out",
        ),
        (["diagnose", "tx90l", "--poses", "p.csv", "--holdout", "b.mcap"], "--holdout is for recordings of motion"),
        (
            ["discover", "doggy", "a.mcap", "--holdout-poses", "p.csv", "-o", "a.yaml"],
            "--holdout-poses goes with --poses",
        ),
        (["simulate", "tx90l", "-o", "a.mcap"], "poses are written as a table; expected a name that ends with .csv"),
        (["simulate", "doggy", "--kind", "poses", "-o", "a.csv"], "doggy.yaml has no section `poses`"),
        (["simulate", "tx90l", "--kind", "motion", "-o", "a.mcap"], "tx90l.yaml has no `command` and no `sensors`"),
        (["add", "tx90l", "cogging@joint1", "-o", "a.yaml"], "tx90l.yaml has no `command` and no `sensors`"),
        (["closed-loop", "tx90l"], "tx90l.yaml has no `command` and no `sensors`"),
    ],
)
def test_verbs_that_cannot_say_so_in_one_line(tmp_path, monkeypatch, capsys, arguments, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.csv").write_text("pose,q1\n0,1\n")
    assert main(arguments) == 1
    said = capsys.readouterr().err
    assert told in said and said.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["p.csv"]


def test_several_targets_with_orientations_from_the_first_command_to_the_last(tmp_path, capsys):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    tool_with(tmp_path)
    arm = str(tmp_path / "tool.yaml")
    for name, count in (("fit", "30"), ("others", "40")):
        options = ["--kind", "poses", "--orientation", "--seed", "3", "--count", count, "--session", name]
        assert main(["simulate", arm, "-o", str(tmp_path / f"{name}.csv"), *options]) == 0
    found = {key: str(tmp_path / f"found.{key}") for key in ("yaml", "json", "html", "urdf")}
    outputs = ["-o", found["yaml"], "--json", found["json"], "--report", found["html"], "--urdf", found["urdf"]]
    assert main(["calibrate", arm, "--poses", str(tmp_path / "fit.csv"), *outputs]) == 0
    said = capsys.readouterr().out
    assert "Yes, this calibration is good." in said and "largest [mrad]" in said
    assert "90 orientations are those of a tracker that tells them to 0.1" in said
    content = json.loads((tmp_path / "found.json").read_text())
    assert list(content["targets"]) == ["reflector", "left", "right"]
    assert content["orientation_sigma"] == pytest.approx(1e-4, rel=0.2) and content["poses"][0]["rms_mrad"] < 0.25
    assert "turn left over [urad]" in (tmp_path / "found.html").read_text()
    truth = json.loads((tmp_path / "fit.truth.json").read_text())["orientations_xyzw"]
    for target in load_robot(found["yaml"]).poses.targets:
        x, y, z, w = truth[target.name]
        R = of_quaternions(np.array([[x, y, z, w]]))[0]
        assert np.linalg.norm(R - target.turn) < 1e-2
    limits = ("p90_mrad: 0.35, because: welding", "max_mrad: 0.1, because: no arm is")
    text = "".join(f"  - {{poses: all, {limit}}}\n" for limit in limits)
    (tmp_path / "limits.yaml").write_text(f"limits:\n{text}")
    compared = ["compare", found["yaml"], "--poses", str(tmp_path / "others.csv")]
    assert main([*compared, "--accept", str(tmp_path / "limits.yaml")]) == 3
    assert "Not accepted: 1 of 2 limits" in (said := capsys.readouterr().out) and "0.35" in said and " mrad" in said
    assert main([*compared[:1], arm, *compared[1:], "--json", found["json"]]) == 0
    models = json.loads((tmp_path / "found.json").read_text())["models"]
    assert models["found"]["poses"]["p90_mrad"] < 0.35 < 1.0 < models["tool"]["poses"]["p90_mrad"]
    assert set(models["found"]["poses"]["targets"]) == {"reflector", "left", "right"}
    assert models["found"]["poses"]["parts"]["without geometric errors"]["p90_mm"] < 5.0  # `right` stays where it is
    assert (
        main(["calibrate", found["yaml"], "--poses", str(tmp_path / "others.csv"), "-o", str(tmp_path / "a.yaml")]) == 0
    )
    assert "Yes, this calibration is good." in capsys.readouterr().out


@pytest.mark.parametrize(
    ("targets", "more", "told"),
    [
        ("joint1: {}", "", "'joint1' is the name of the first target, of a joint, tool, tracker or has a dot"),
        ("left: {link: link9}", "", "poses.targets.left.link: no link 'link9'"),
        ("left: {link: base_link}", "", "base_link does not move with the arm; expected a link that joint1"),
        ("left: {att: [0, 0, 0]}", "", "unknown key 'att'"),
        ("left: {at: [0, 0]}", "", "at: expected 3 finite numbers"),
        (
            "left: {orientation: [1, 1, 0, 0]}",
            "",
            "expected a quaternion [x, y, z, w] of norm one, got one of norm 1.414",
        ),
        ("", "  orientation_sigma: 0\n", "orientation_sigma"),
    ],
)
def test_targets_that_cannot_be_are_told(tmp_path, targets, more, told):
    with pytest.raises(RobotError) as err:
        tool_with(tmp_path, targets, more)
    assert told in str(err.value) and "\n" not in str(err.value)
