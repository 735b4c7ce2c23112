# SPDX-License-Identifier: BSD-3-Clause
"""Names of joints are read where a message type has them, on the fast path and on the slow one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.messages.fast_columns import fast_columns
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.message_type import MessageType
from jointscope.tools.bags.messages.slow_columns import slow_columns
from jointscope.tools.bags.read_recording import read_recording

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
POINT = "float64[] positions\nfloat64[] effort"
TYPES = {
    "a/msg/Point": POINT,
    "a/msg/Trajectory": "string[] joint_names\na/Point[] points",
    "a/msg/State": "string[] modes\nstring[] joint_names\na/Point actual",
    "a/msg/Interface": "string[] interface_names\nfloat64[] values",
    "a/msg/Dynamic": "string[] joint_names\na/Interface[] interface_values",
    "a/msg/Motor": "float32 q\nfloat32 tau",
    "a/msg/Low": "uint8 level\na/Motor[3] motor_state",
    "a/msg/Servo": "string name\nint32 position",
    "a/msg/Servos": "a/Servo[] servos",
    "a/msg/Labels": "string[] labels\nfloat64[] torque",
}


@pytest.fixture(scope="module")
def kinds():
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    for name, text in TYPES.items():
        store.register(get_types_from_msg(text, name))
    return {name.removeprefix("a/msg/"): MessageType(name, store, True) for name in TYPES}


def message(kinds, name, *values):
    return kinds[name].typestore.types[f"a/msg/{name}"](*values)


def point(kinds, *positions):
    return message(kinds, "Point", np.array(positions), np.array(positions) * 10.0)


def examples(kinds):
    """Messages, a field in them, names and values that it should give."""
    names = ["b", "a"]
    yield (
        "Trajectory",
        message(kinds, "Trajectory", names, [point(kinds, 1.0, 2.0)]),
        "points.0.effort",
        names,
        [10, 20],
    )
    yield "State", message(kinds, "State", ["x"], names, point(kinds, 1.0, 2.0)), "actual.positions", names, [1, 2]
    shapes = (["position", "effort"], [1.0, 2.0]), (["effort", "position"], [4.0, 3.0])
    parts = [message(kinds, "Interface", found, np.array(values)) for found, values in shapes]
    dynamic = message(kinds, "Dynamic", names, parts)
    yield "Dynamic", dynamic, "interface_values.*.values.position", names, [1, 3]
    yield "Dynamic", dynamic, "interface_values.*.values.effort", names, [2, 4]
    yield "Dynamic", dynamic, "interface_values.1.values", ["effort", "position"], [4, 3]
    low = message(kinds, "Low", 1, [message(kinds, "Motor", q, 10.0 * q) for q in (1.0, 2.0, 3.0)])
    yield "Low", low, "motor_state.*.tau", None, [10, 20, 30]
    yield "Low", low, "motor_state.2.q", None, [3]
    servos = message(kinds, "Servos", [message(kinds, "Servo", name, k) for k, name in enumerate(names)])
    yield "Servos", servos, "servos.*.position", names, [0, 1]
    yield "Labels", message(kinds, "Labels", names, np.array([5.0, 6.0])), "torque", names, [5, 6]
    yield "Labels", message(kinds, "Labels", names, np.array([5.0, 6.0])), "torque.1", names, [6]


def test_names_and_numbers_are_the_same_on_both_paths(kinds):
    for name, content, field, names, values in examples(kinds):
        raw = [kinds[name].encode(content)] * 2
        for found in (fast_columns(raw, kinds[name], field), slow_columns(raw, kinds[name], field, "/t")):
            assert found is not None, field
            assert found.names == (None if names is None else tuple(names)), field
            np.testing.assert_array_equal(found.values, [values, values])


def test_an_element_without_the_wanted_number_is_named(kinds):
    part = message(kinds, "Interface", ["position"], np.array([1.0]))
    raw = [kinds["Dynamic"].encode(message(kinds, "Dynamic", ["a"], [part]))]
    field = "interface_values.*.values.effort"
    assert fast_columns(raw, kinds["Dynamic"], field) is None
    with pytest.raises(RecordingError, match=r"topic /t, message 0: the field .* holds no numbers"):
        slow_columns(raw, kinds["Dynamic"], field, "/t")


def test_a_field_that_is_not_there_is_refused_with_those_that_are(kinds):
    with pytest.raises(RecordingError, match=r"has no field 'actual.torque': no 'torque'; it has positions, effort"):
        field_path(kinds["State"], "actual.torque", "/t")
    with pytest.raises(RecordingError, match="there is nothing below"):
        field_path(kinds["Low"], "motor_state.0.q.effort", "/t")


@pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
def test_two_arms_whose_controller_names_them_in_another_order_are_not_exchanged():
    robot = load_robot(CASES / "dual_arm_joint_names.yaml")
    found = calibrate(robot, [read_recording(CASES / "dual_arm_joint_names.mcap", robot)]).robot.parameters
    for name, true in (("a_right.coulomb_torque", 0.9), ("b_left.coulomb_torque", 0.3)):
        assert found[name].value == pytest.approx(true, rel=0.01)
    for name, true in (("a_right.inertia", 0.08), ("b_left.inertia", 0.03)):
        assert found[name].value == pytest.approx(true, rel=0.01)


@pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
def test_names_that_the_messages_do_not_have_are_refused(tmp_path):
    text = (CASES / "dual_arm_joint_names.yaml").read_text().replace("names: [a_right, b_left]", "names: [right, left]")
    (tmp_path / "dual.yaml").write_text(text.replace("urdf: dual.urdf", f"urdf: {CASES / 'dual.urdf'}"))
    with pytest.raises(RecordingError, match="no joint 'right' in the messages, which name b_left, a_right"):
        read_recording(CASES / "dual_arm_joint_names.mcap", load_robot(tmp_path / "dual.yaml"))
