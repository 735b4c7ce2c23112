# SPDX-License-Identifier: BSD-3-Clause
"""The ROS 2 example with a stand-in for rclpy: messages of a simulated robot in, states that are right out."""

from __future__ import annotations

import dataclasses
import importlib.util
import re
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from ros_stand_in import CALLED, DiagnosticStatus, Imu, JointState, Node, install

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_writer import robot_text
from jointscope.tools.bags.needed_streams import needed_streams

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "ros2" / "estimator_node.py"
EPOCH = 1_700_000_000  # [s] stamps are large numbers on a robot


@pytest.fixture
def module(monkeypatch):
    install(monkeypatch)
    monkeypatch.setattr(Node, "parameters", {"robot": "doggy", "lag": 0.02, "rate": 100.0})
    spec = importlib.util.spec_from_file_location("estimator_node", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def message(stream, t, values):
    """What a driver would send; joints in another order than the robot's, and one that the robot does not have."""
    stamp = SimpleNamespace(sec=EPOCH + int(t), nanosec=round(1e9 * (t % 1.0)) % 10**9)
    header = SimpleNamespace(stamp=stamp)
    raw = values / stream.source.factor
    if stream.source.msgtype.endswith("Imu"):
        return Imu(header=header, angular_velocity=SimpleNamespace(**dict(zip("xyz", raw, strict=True))))
    names = [*(stream.source.names or ("joint1", "joint2", "joint3"))][::-1]
    return JointState(header=header, name=["other", *names], **{stream.source.field: [9.9, *raw[::-1]]})


def feed(node, robot, recording):
    rows = []
    for stream in needed_streams(robot):
        data = recording.streams[stream.name]
        rows += [(t, stream, values) for t, values in zip(data.times, data.values, strict=True)]
    for t, stream, values in sorted(rows, key=lambda row: row[0]):
        for kind, callback in node.heard[stream.source.topic]:
            sent = message(stream, t, values)
            assert isinstance(sent, kind)
            callback(sent)


def test_the_node_says_nothing_before_it_knows_a_state(module):
    node = module.EstimatorNode()
    node.timers[0.01]()
    node.timers[1.0]()
    assert not node.published["~/joint_states"]
    (told,) = node.published["/diagnostics"]
    assert (told.status[0].level, told.status[0].message) == (DiagnosticStatus.WARN, "waiting for samples")


def test_states_are_those_of_the_robot_in_the_order_of_its_joints(module, doggy, simulated, monkeypatch):
    monkeypatch.setattr(module.js, "load_robot", lambda name: doggy)
    node = module.EstimatorNode()
    part = simulated.recording.between(4.0, 4.15)
    feed(node, doggy, part)
    node.timers[0.01]()
    (state,) = node.published["~/joint_states"]
    assert state.name == list(doggy.joints)
    end = max(stream.times[-1] for stream in part.streams.values())
    assert state.header.stamp.sec == EPOCH + int(end)
    true = simulated.states[np.searchsorted(simulated.state_times, end - 1e-9)]
    assert np.abs(np.array(state.position) - true[:3]).max() < 0.02
    (mean,), (covariance,) = node.published["~/state"], node.published["~/covariance"]
    assert [d.size for d in covariance.layout.dim] == [len(mean.data)] * 2
    P = np.reshape(covariance.data, [len(mean.data)] * 2)
    assert np.all(np.linalg.eigvalsh(P) > -1e-12)
    node.timers[1.0]()
    keys = {pair.key for pair in node.published["/diagnostics"][-1].status[0].values}
    assert {"NIS joint1.motor_position", "NIS imu1.x"} <= keys


def test_the_command_of_the_readme_starts_the_node_and_leaves_rclpy_as_it_was(module, doggy, tmp_path, monkeypatch):
    (block,) = re.findall(r"```bash\n(.*?)```", (EXAMPLE.parent / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    python, script, *rest = shlex.split(block)
    assert python == "python" and Path(script) == EXAMPLE.relative_to(EXAMPLE.parents[2])
    given = dict(word.split(":=") for word in rest if ":=" in word)
    monkeypatch.chdir(tmp_path)
    (tmp_path / given["robot"]).write_text(robot_text(doggy, tmp_path))
    monkeypatch.setattr(Node, "parameters", {name: yaml_value(text) for name, text in given.items()})
    CALLED.clear()
    module.main()
    assert CALLED == ["init", "spin", "try_shutdown"]


def yaml_value(text: str):
    try:
        return float(text)
    except ValueError:
        return text


def test_joints_with_topics_of_their_own_are_all_heard(module, doggy, monkeypatch):
    joined = dataclasses.replace(doggy.motor_encoder.source, topic="/a/states + /b/states")
    robot = doggy.with_sensors({doggy.motor_encoder.name: dataclasses.replace(doggy.motor_encoder, source=joined)})
    monkeypatch.setattr(module.js, "load_robot", lambda name: robot)
    node = module.EstimatorNode()
    assert {"/a/states", "/b/states"} <= set(node.heard)
    assert not any("+" in topic for topic in node.heard)
    stamp = SimpleNamespace(sec=EPOCH, nanosec=0)
    taken = []
    monkeypatch.setattr(node.estimator, "sample", lambda name, t, values: taken.append((name, values.tolist())))
    for topic, joint, position in (("/a/states", "joint1", 0.25), ("/b/states", "joint3", 0.5)):
        ((_, callback),) = node.heard[topic]
        callback(JointState(header=SimpleNamespace(stamp=stamp), name=[joint], position=[position]))
    assert [name for name, _ in taken] == ["motor_encoder"] * 2
    np.testing.assert_array_equal([values for _, values in taken], [[0.25, np.nan, np.nan], [np.nan, np.nan, 0.5]])


def test_messages_for_other_joints_alone_are_not_taken(module):
    node = module.EstimatorNode()
    stream = next(s for s in needed_streams(module.js.load_robot("doggy")) if s.name == "motor_encoder")
    foreign = JointState(name=["gripper"], **{stream.source.field: [0.1]})
    node.take(stream, foreign)
    assert not node.estimator.status.received


def test_a_robot_with_other_types_of_messages_is_refused_in_one_line(module, doggy, monkeypatch):
    command = dataclasses.replace(doggy.command, msgtype="std_msgs/msg/Float64MultiArray")
    monkeypatch.setattr(module.js, "load_robot", lambda name: dataclasses.replace(doggy, command=command))
    with pytest.raises(RobotError, match=r"expected one of sensor_msgs/msg/JointState, sensor_msgs/msg/Imu$"):
        module.EstimatorNode()
