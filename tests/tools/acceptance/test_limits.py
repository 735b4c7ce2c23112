# SPDX-License-Identifier: BSD-3-Clause
"""Limits that a user declares, and results that keep them, break them or say nothing of them."""

import math
from pathlib import Path

import pytest

from jointscope.robots.errors import RobotError
from jointscope.tools.acceptance.evaluation import FAIL, FAILED, OPEN, PASS, UNDECIDED, check_limits, exit_code
from jointscope.tools.acceptance.limits import read_limits

CONTENT = {
    "converged": True,
    "parameters": {
        "joint1.stiffness": {"value": 190.0, "sigma": 1.0, "unit": "N m/rad"},
        "joint2.stiffness": {"value": 120.0, "sigma": 6.0, "unit": "N m/rad"},
        "joint3.stiffness": {"value": 100.0, "sigma": None, "unit": "N m/rad"},
        "imu1.bias": {"value": [0.1, 0.2, 0.3], "sigma": [0.1, 0.1, 0.1], "unit": "rad/s"},
        "joint1.torque_offset.torque": {"value": 0.0, "sigma": 0.1, "unit": "N m"},
    },
    "channels": {
        "joint1.motor_position": {"rmse": 1e-4, "chi2": 1.5},
        "imu1.x": {"horizons": {"0.1": 0.01, "1.0": 0.2, "open_loop": None}},
    },
    "missing_torque_percent": {"joint1": 2.0, "joint2": None},
    "poses": {"p90_mm": 0.05, "max_mm": 0.12},
}


def limits_of(folder: Path, *lines: str):
    (folder / "limits.yaml").write_text("limits:\n" + "".join(f"  - {{{line}}}\n" for line in lines))
    return read_limits(folder / "limits.yaml")


def outcome(folder: Path, line: str, content=CONTENT) -> tuple[str, str]:
    (checked,) = check_limits(limits_of(folder, f"{line}, because: bench"), content)
    return checked.outcome, checked.found


@pytest.mark.parametrize(
    "line, expected",
    [
        ("parameter: joint1.stiffness, between: [187, 193]", PASS),
        ("parameter: joint1.stiffness, between: [188.5, 193]", OPEN),  # inside, but two sigma reach out
        ("parameter: joint1.stiffness, between: [191, 193]", FAIL),
        ("parameter: joint1.stiffness, at_most: 192.5", PASS),
        ("parameter: joint1.stiffness, at_least: 189", OPEN),
        ("parameter: joint2.stiffness, sigma: 6.5", PASS),
        ("parameter: joint2.stiffness, sigma_percent: 4.9", FAIL),
        ("parameter: joint3.stiffness, at_most: 1000", OPEN),  # held, not calibrated
        ("parameter: imu1.bias, at_most: 1", OPEN),  # no single number
        ("parameter: joint1.torque_offset.torque, sigma_percent: 5", OPEN),  # of zero
        ("parameter: joint4.stiffness, at_most: 1", OPEN),
        ("channel: joint1.motor_position, rmse: 2.0e-4", PASS),
        ("channel: joint1.motor_position, chi2: 1.2", FAIL),
        ("channel: imu1.x, horizon: 0.1, error: 0.02", PASS),
        ("channel: imu1.x, horizon: 1, error: 0.02", FAIL),
        ("channel: imu1.x, horizon: 0.5, error: 0.02", OPEN),
        ("channel: imu1.x, horizon: open_loop, error: 0.02", OPEN),
        ("channel: joint1.motor_position, horizon: 0.1, error: 0.02", OPEN),
        ("channel: imu1.x, rmse: 1", OPEN),
        ("joint: joint1, missing_torque_percent: 3", PASS),
        ("joint: joint2, missing_torque_percent: 3", OPEN),
        ("poses: all, p90_mm: 0.06", PASS),
        ("poses: all, max_mm: 0.11", FAIL),
        ("poses: all, mean_mm: 1", OPEN),
    ],
)
def test_outcomes(tmp_path, line, expected):
    found = outcome(tmp_path, line)
    assert found[0] == expected
    assert found[1]


@pytest.mark.parametrize(
    "horizon, words", [("0.1", "no error 0.1 s ahead; "), ("open_loop", "no error in the open loop; ")]
)
def test_an_error_that_is_not_there_is_named_with_its_horizon(tmp_path, horizon, words):
    line = f"channel: joint1.motor_position, horizon: {horizon}, error: 0.02"
    assert outcome(tmp_path, line) == (OPEN, f"this result has {words}`jointscope compare` has it")


def test_a_pattern_is_checked_on_every_name_that_fits(tmp_path):
    limits = limits_of(tmp_path, 'parameter: "joint*.stiffness", sigma_percent: 4.9, because: bench')
    assert [(line.name, line.outcome) for line in check_limits(limits, CONTENT)] == [
        ("joint1.stiffness", PASS),
        ("joint2.stiffness", FAIL),
        ("joint3.stiffness", OPEN),
    ]


@pytest.mark.parametrize("line", ["parameter: joint1.stiffness, at_most: 1000", "poses: all, p90_mm: 1"])
def test_nothing_of_a_calibration_that_has_not_converged_passes(tmp_path, line):
    assert outcome(tmp_path, line, {**CONTENT, "converged": False})[0] == OPEN


@pytest.mark.parametrize("line", ["parameter: joint1.stiffness, at_most: 1", "channel: imu1.x, rmse: 1"])
def test_what_a_result_does_not_say_is_not_evaluated(tmp_path, line):
    assert outcome(tmp_path, line, {"poses": {"p90_mm": 0.05}})[0] == OPEN


def test_the_worst_session_of_a_calibration_from_poses_is_judged(tmp_path):
    sessions = {"poses": [{"p90_mm": 0.05}, {"p90_mm": 0.3}]}
    assert outcome(tmp_path, "poses: all, p90_mm: 0.31", sessions) == (PASS, "0.3 mm")
    assert outcome(tmp_path, "poses: all, p90_mm: 0.2", sessions)[0] == FAIL
    assert outcome(tmp_path, "poses: all, p90_mm: 1", {"poses": [{"p90_mm": 0.05}, {}]})[0] == OPEN


def test_drift_is_against_the_values_of_an_earlier_robot(tmp_path):
    earlier = "parameter: joint1.stiffness, against: doggy"
    (limit,) = limits_of(tmp_path, f"{earlier}, drift_percent: 60, because: belt set in January")
    assert limit.earlier["joint1.stiffness"] == 400.0  # of the ready robot
    found = outcome(tmp_path, f"{earlier}, drift_percent: 60")
    assert found == (PASS, "52.5 % ± 0.25")
    assert outcome(tmp_path, f"{earlier}, drift_percent: 52.6")[0] == OPEN
    assert outcome(tmp_path, f"{earlier}, drift: 200")[0] == FAIL
    assert outcome(tmp_path, "parameter: joint1.torque_offset.torque, against: doggy, drift: 200")[0] == OPEN


def test_exit_codes(tmp_path):
    good, bad, open_ = (
        check_limits(limits_of(tmp_path, f"{line}, because: bench"), CONTENT)
        for line in ("poses: all, p90_mm: 0.06", "poses: all, p90_mm: 0.01", "poses: all, rms_mm: 1")
    )
    assert exit_code(good) == 0
    assert exit_code([*good, *open_]) == UNDECIDED
    assert exit_code([*good, *open_, *bad]) == FAILED


def test_a_limit_says_itself_in_words(tmp_path):
    first, second, third = limits_of(
        tmp_path,
        "parameter: joint1.stiffness, between: [180, 200], because: a",
        "channel: imu1.x, horizon: 0.1, error: 0.02, because: b",
        "parameter: joint1.stiffness, drift_percent: 5, against: doggy, because: c",
    )
    assert first.text == "joint1.stiffness between 180 and 200"
    assert second.text == "imu1.x error 0.1 s ahead at most 0.02"
    assert third.text == "joint1.stiffness drift_percent against doggy at most 5"
    assert math.isinf(second.lower)


@pytest.mark.parametrize(
    "line, words",
    [
        ("parameter: a.b, at_most: 1", "'because' is missing"),
        ("parameter: a.b, at_most: 1, because: ''", "expected the reason for this limit"),
        ("parameter: a.b, because: x", "what is limited of a parameter"),
        ("parameter: a.b, at_most: 1, sigma: 2, because: x", "got at_most and sigma"),
        ("parameter: a.b, channel: c, at_most: 1, because: x", "what the limit is of"),
        ("parameter: a.b, sigma_percnt: 1, because: x", "did you mean 'sigma_percent'?"),
        ("parameter: a.b, between: [2, 1], because: x", r"expected \[lowest, highest\]"),
        ("parameter: a.b, at_most: one, because: x", "expected a finite number, got 'one'"),
        ("parameter: a.b, at_most: 1, horizon: 3, because: x", "unknown key 'horizon'"),
        ("channel: a, error: 1, because: x", "'horizon' is missing"),
        ("parameter: a.b, drift: 1, because: x", "'against' is missing"),
        ("parameter: a.b, drift: 1, against: none.yaml, because: x", "none.yaml"),
    ],
)
def test_mistakes_of_a_file_are_told_with_their_place(tmp_path, line, words):
    with pytest.raises(RobotError, match=words):
        limits_of(tmp_path, line)


@pytest.mark.parametrize("text", ["limits: []", "limits: 3", "{}", "- 1", "limits: [1]", "limit: []"])
def test_a_file_without_lines_is_refused(tmp_path, text):
    (tmp_path / "limits.yaml").write_text(text)
    with pytest.raises(RobotError, match=r"limits\.yaml"):
        read_limits(tmp_path / "limits.yaml")


@pytest.mark.parametrize(
    "name, content, words",
    [
        ("absent.yaml", None, r"^cannot read the limits file .*absent\.yaml: No such file or directory$"),
        ("bag.mcap", b"\x89MCAP0\xff", r"bag\.mcap is not a limits file: it is not text$"),
        ("arm.urdf", b"<robot name='a'>\n  <link: [</robot>", r"^arm\.urdf is a URDF and no limits file$"),
        ("broken.yaml", b"limits: [", r"^broken\.yaml is not YAML: line 1, column 10: "),
    ],
)
def test_a_file_that_cannot_be_read_is_called_a_limits_file(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(RobotError, match=words) as raised:
        read_limits(tmp_path / name)
    assert "robot file" not in str(raised.value)


@pytest.mark.parametrize(("level", "expected"), [("good", PASS), ("warn", PASS), ("bad", OPEN)])
def test_nothing_passes_of_a_result_that_says_no(tmp_path, level, expected):
    content = {**CONTENT, "verdict": {"level": level, "text": ""}}
    for line in ("parameter: joint1.stiffness, between: [187, 193]", "channel: joint1.motor_position, rmse: 2.0e-4"):
        assert outcome(tmp_path, line, content)[0] == expected
    assert outcome(tmp_path, "parameter: joint1.stiffness, between: [191, 193]", content)[0] == FAIL
    checked = check_limits(limits_of(tmp_path, "channel: joint1.motor_position, rmse: 2.0e-4, because: b"), content)
    assert exit_code(checked) == (UNDECIDED if level == "bad" else 0)
