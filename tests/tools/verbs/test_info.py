# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.descriptions.describe_bag import describe_bag
from jointscope.tools.bags.needed_streams import needed_streams
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import add_verb

SHARED = Path(__file__).resolve().parents[3].parent / "shared"
REAL_BAGS = ("hebi_arms_mit/arm2_ps1_star_trace", "kr300/traj_A", "bam_xl330/kp100_sin_sin", "hebi_example/exampleLog")


@pytest.fixture(scope="module")
def doggy():
    return load_robot("doggy")


@pytest.fixture
def bag(doggy, tmp_path):
    """One second in which the encoders lost 20 messages and imu1 says NaN in six of ten messages."""
    rng = np.random.default_rng(1)
    times = np.arange(1000) / 1e3
    streams = {
        need.name: Stream(need.name, times, rng.uniform(-1, 1, (1000, 3)), need.channels, "")
        for need in needed_streams(doggy)
    }
    kept = np.r_[0:500, 520:1000]
    encoder = streams["motor_encoder"]
    streams["motor_encoder"] = Stream("motor_encoder", times[kept], encoder.values[kept], encoder.channels, "")
    streams["imu1"].values[np.arange(1000) % 10 > 3, 0] = np.nan
    write_bag(tmp_path / "run.mcap", Recording("", "", 10**18, streams), doggy)
    return tmp_path / "run.mcap"


def run(*arguments):
    parser = argparse.ArgumentParser()
    add_verb(parser.add_subparsers(), "info")
    args = parser.parse_args(["info", *map(str, arguments)])
    return args.run(args)


def test_a_bag_alone_is_described_without_what_only_robots_need(bag):
    program = (
        f"import sys\nfrom jointscope.tools.command_line import main\nassert main(['info', {str(bag)!r}]) == 0\n"
        "assert not {'gtsam', 'pinocchio', 'scipy', 'numba', 'mujoco', 'rerun'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "/joint_states" in done.stdout


def test_topics_are_described_with_rates_gaps_names_and_ranges(bag):
    topics = {topic.topic: topic for topic in describe_bag(bag).topics}
    states = topics["/joint_states"]
    assert (states.count, states.gaps, states.missing, states.stamped) == (980, 1, 20, True)
    assert states.longest_gap == pytest.approx(0.021)
    assert states.names == ("joint1", "joint2", "joint3")
    (position,) = [part for part in states.fields if part.columns and part.field == "position"]
    assert -1 <= position.minimum[0] < position.maximum[0] <= 1
    imu = topics["/imu1/data_raw"]
    assert imu.rate == pytest.approx(1000.0)
    assert [part.not_finite for part in imu.fields if part.field == "angular_velocity"] == [600]


def test_the_robots_needs_are_compared_with_the_bag(bag, doggy):
    description = describe_bag(bag, doggy)
    assert [need.problem for need in description.needs] == [None] * 4
    assert description.usable is False
    assert description.problem.startswith("imu1.x is no number (NaN or infinite) in 600 of 1000 messages (60 %)")


def test_info_prints_a_table_and_writes_the_same_as_json(bag, tmp_path, capsys):
    assert run(bag, "--robot", "doggy", "--json", tmp_path / "info.json") == 0
    text = capsys.readouterr().out
    assert "/joint_states   sensor_msgs/msg/JointState  980 " in text
    assert "The recording cannot be used for doggy: imu1.x is no number (NaN or infinite) in 600 of 1000" in text
    content = json.loads((tmp_path / "info.json").read_text())
    assert content["usable"] is False
    assert [need["stream"] for need in content["needs"]] == ["command", "motor_encoder", "imu1", "imu2"]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["info.json", "run.mcap"]


@pytest.mark.parametrize("name", REAL_BAGS)
def test_recordings_of_other_robots_are_described_too(doggy, name):
    path = SHARED / "data" / "real" / name
    if not path.exists():
        pytest.skip(f"the shared recording {name} is not on this machine")
    description = describe_bag(path, doggy)
    assert description.usable is False
    assert all(topic.trouble is None and topic.fields for topic in description.topics)
    json.dumps(description.to_json(), allow_nan=False)
    assert "/motor_command" in description.text()
