# SPDX-License-Identifier: BSD-3-Clause
"""Words of advised commands: what a command writes is never what it reads, nor a placeholder."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import edited_argument, edited_path, init_command, robot_argument
from jointscope.robots.parts.position_target import PositionTarget

HOUSE = Path(__file__).parents[3]
OVERWRITES = re.compile(
    r"(?:add|remove|calibrate|discover|init) [^`\n]*?(\{[\w.]+\}|[\w.]+\.yaml)[^`\n]* -o \1(?![\w.])"
)
PLACEHOLDER = re.compile(r"-o (?:OUT|NEW|ROBOT|CALIBRATED)(?:\.yaml)?\b")
NOT_PRINTED = (
    "tools/terminal/effect_page.py",
    "tools/verb_parts/edited_robot.py",
    "tools/verb_parts/discovery_state.py",
)


def test_a_ready_robot_is_named_and_what_becomes_of_it_lies_where_the_user_is():
    doggy = load_robot("doggy")
    assert (robot_argument(doggy), edited_argument(doggy, "limited")) == ("doggy", "doggy_limited.yaml")


def test_a_file_of_the_users_is_quoted_and_what_becomes_of_it_lies_beside_it(tmp_path):
    own = tmp_path / "my arm.yaml"
    robot = replace(load_robot("doggy"), path=own)
    assert shlex.split(robot_argument(robot)) == [str(own)]
    assert shlex.split(edited_argument(robot, "anew")) == [str(tmp_path / "my arm_anew.yaml")]
    assert edited_path(Path("arm.yaml"), "anew") == "arm_anew.yaml"


def test_a_file_is_written_anew_with_all_that_its_user_said(tmp_path):
    doggy = load_robot("doggy")
    urdf, plain = shlex.quote(str(doggy.tree.urdf)), replace(doggy, path=tmp_path / "own.yaml")
    assert init_command(plain, "a b", "anew") == f"jointscope init {urdf} 'a b' -o {tmp_path}/own_anew.yaml"
    encoder = doggy.motor_encoder
    called = replace(encoder, source=replace(encoder.source, names=("m 1", *encoder.source.names[1:])))
    marker = replace(encoder.source, topic="/camera/marker")
    target = PositionTarget("marker", marker, doggy.tree.bodies[-1], np.zeros(3), None, np.eye(4), "marker", 1e-3)
    typed = replace(
        plain,
        name="rex",
        command=replace(doggy.command, unit="N m", confirmed=True),
        held_at_mean=("wrist",),
        sensors={**doggy.sensors, encoder.name: called, "marker": target},
    )
    words = shlex.split(init_command(typed, "run.mcap", "anew"))
    joints = ",".join(["joint1=m 1", *doggy.joints[1:]])
    assert words[4:-2] == [
        *("--joints", joints, "--name", "rex", "--lock", "wrist", "--unit", "Nm"),
        *("--target", f"/camera/marker={doggy.tree.bodies[-1]}"),
    ]
    words = shlex.split(init_command(typed, "run.mcap", "with", joints=["joint2", "joint1"], unit="A"))
    assert words[5] == "joint2,joint1=m 1" and words[words.index("--unit") + 1] == "A"


@pytest.mark.parametrize("room", ["robots", "factors", "graphs", "tools"])
def test_no_advice_writes_over_what_it_reads_or_leaves_the_name_open(room):
    for path in (HOUSE / room).rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not OVERWRITES.search(text), f"{path}: {OVERWRITES.search(text)}"
        if path.relative_to(HOUSE).as_posix() not in NOT_PRINTED:
            assert not PLACEHOLDER.search(text), f"{path}: {PLACEHOLDER.search(text)}"
