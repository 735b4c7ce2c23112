# SPDX-License-Identifier: BSD-3-Clause
"""Axes that point the other way than the URDF's, and joints with each other's names: torques tell, and init says so."""

from __future__ import annotations

import json

import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main

JOINTS = ("shoulder", "elbow", "wrist")
TRUTH = {"inertia": 0.05, "dry": 0.3, "viscous": 0.4}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    urdf = write_urdf(folder / "arm.urdf", {"shoulder": None, "elbow": "shoulder", "wrist": "elbow"})
    # arms with all centres of mass on one axis move as their mirror images do
    urdf.write_text(urdf.read_text().replace('origin xyz="0 0 -0.15"', 'origin xyz="0.05 0.03 -0.15"'))
    return urdf, ArmMotion(urdf, JOINTS, seconds=8.0)


def begun(urdf, bag, out, *options):
    """What `init` writes to JSON."""
    assert main(["init", str(urdf), str(bag), "-o", str(out), "--json", str(out.with_suffix(".json")), *options]) == 0
    return json.loads(out.with_suffix(".json").read_text())


def recorded(arm, path, positions=JOINTS, commands=JOINTS):
    """A bag in which joints go by other names."""
    topics = {
        "/joint_states": arm[1].states(JOINTS, dict(zip(JOINTS, positions, strict=True))),
        "/motor_command": arm[1].commands(JOINTS, dict(zip(JOINTS, commands, strict=True))),
    }
    return write_arm_bag(path, arm[1].times, topics)


def assert_true(drives):
    for joint in JOINTS:
        for law, value in TRUTH.items():
            assert drives[joint][law]["value"] == pytest.approx(value, rel=0.03), (joint, law)


@pytest.mark.parametrize("turned", [("elbow",), ("elbow", "wrist")])
def test_an_axis_that_points_the_other_way_is_found_and_turned(arm, tmp_path, turned):
    text = arm[0].read_text()
    for joint in turned:
        before, name, rest = text.partition(f'<joint name="{joint}"')
        axis = rest.split('<axis xyz="')[1].split('"')[0]
        other = " ".join(f"{-float(part):g}" for part in axis.split())
        text = before + name + rest.replace(f'xyz="{axis}"/>', f'xyz="{other}"/>', 1)
    (tmp_path / "other.urdf").write_text(text)
    found = begun(tmp_path / "other.urdf", recorded(arm, tmp_path / "moves.mcap"), tmp_path / "own.yaml")
    signs = load_robot(tmp_path / "own.yaml").motor_encoder.source.scale
    expected = tuple(-1.0 if joint in turned else 1.0 for joint in JOINTS)
    # a mirrored arm moves alike: all signs the other way round are as right
    assert signs in (expected, tuple(-sign for sign in expected))
    assert_true(found["drives"])
    assert "only so do the masses of the URDF explain the commands" in (tmp_path / "own.yaml").read_text()


def test_joints_with_each_others_names_are_named_with_the_command_that_mends_it(arm, tmp_path, capsys):
    exchanged = ("elbow", "shoulder", "wrist")
    bag = recorded(arm, tmp_path / "moves.mcap", exchanged, exchanged)
    begun(arm[0], bag, tmp_path / "own.yaml")
    said = capsys.readouterr().out
    assert "can be used" not in said and "positions and commands of shoulder and elbow seem to be exchanged" in said
    command = next(line for line in said.splitlines() if "seem to be exchanged" in line).partition("jointscope init ")[
        2
    ]
    *options, _, written = command.split()[2:]
    assert written == str(tmp_path / "own_exchanged.yaml")
    assert_true(begun(arm[0], bag, tmp_path / "own.yaml", *options)["drives"])
    assert "can be used" in capsys.readouterr().out


def test_commands_with_each_others_names_are_said(arm, tmp_path, capsys):
    bag = recorded(arm, tmp_path / "moves.mcap", commands=("shoulder", "wrist", "elbow"))
    begun(arm[0], bag, tmp_path / "own.yaml")
    assert "commands of elbow and wrist seem to be exchanged" in capsys.readouterr().out


def test_nothing_is_turned_where_all_is_right(arm, tmp_path, capsys):
    assert_true(begun(arm[0], recorded(arm, tmp_path / "moves.mcap"), tmp_path / "own.yaml")["drives"])
    assert "scale" not in (tmp_path / "own.yaml").read_text() and "exchanged" not in capsys.readouterr().out
