# SPDX-License-Identifier: BSD-3-Clause
"""Limits that a user declares, and results that keep them, break them or say nothing of them."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.acceptance.evaluation import FAIL, FAILED, OPEN, PASS, UNDECIDED, check_limits, exit_code
from jointscope.tools.acceptance.limits import check_units, read_limits

CONTENT = {
    "converged": True,
    "parameters": {
        "joint1.stiffness": {"value": 190.0, "sigma": 1.0, "unit": "N m/rad"},
        "joint2.stiffness": {"value": 120.0, "sigma": 6.0, "unit": "N m/rad"},
        "joint3.stiffness": {"value": 100.0, "sigma": None, "unit": "N m/rad"},
        "imu1.bias": {"value": [0.1, 0.2, 0.3], "sigma": [0.1, 0.1, 0.1], "unit": "rad/s"},
        "imu1.R_imu_body": {"value": [[1.0, 0.0, 0.0]] * 3, "sigma": [0.001, 0.001, 0.1], "unit": "1; sigma ..."},
        "imu2.bias": {"value": [0.1, 0.2, 0.3], "sigma": None, "unit": "rad/s"},
        "joint4.damping": {"value": 5.0, "sigma": math.nan, "unit": "N m s/rad"},
        "joint1.torque_offset.torque": {"value": 0.0, "sigma": 0.1, "unit": "N m"},
    },
    "channels": {
        "joint1.motor_position": {"rmse": 1e-4, "chi2": 1.5, "unit": "rad"},
        "imu1.x": {"horizons": {"0.1": 0.01, "1.0": 0.2, "open_loop": None}, "unit": "rad/s"},
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
        ("parameter: joint1.stiffness, between: [187, 193 N m/rad]", PASS),
        ("parameter: joint1.stiffness, between: [188.5, 193 N m/rad]", OPEN),  # inside, but two sigma reach out
        ("parameter: joint1.stiffness, between: [191 N m/rad, 193 N m/rad]", FAIL),
        ("parameter: joint1.stiffness, at_most: 0.1925 kN m/rad", PASS),
        ("parameter: joint1.stiffness, at_least: 189 N m/rad", OPEN),
        ("parameter: joint2.stiffness, sigma: 6.5 N m/rad", PASS),
        ("parameter: joint2.stiffness, sigma_percent: 4.9", FAIL),
        ("parameter: joint3.stiffness, at_most: 1000 N m/rad", OPEN),  # held, not calibrated
        ("parameter: imu1.bias, at_most: 1", OPEN),  # no single number
        ("parameter: imu1.bias.y, between: [-0.1, 0.5 rad/s]", PASS),
        ("parameter: imu1.bias.y, sigma: 5 deg/s", FAIL),
        ("parameter: imu1.R_imu_body.z, sigma: 6 deg", PASS),
        ("parameter: imu1.R_imu_body.z, sigma: 5 deg", FAIL),
        ("parameter: imu1.R_imu_body.z, at_most: 1 rad", OPEN),  # an angle of nothing
        ("parameter: imu1.R_imu_body.z, sigma: 1 m", OPEN),
        ("parameter: imu2.bias.x, sigma: 1 rad/s", OPEN),  # held
        ("parameter: joint4.damping, at_most: 9 N m s/rad", OPEN),  # a sigma that is no number
        ("parameter: joint1.torque_offset.torque, sigma_percent: 5", OPEN),  # of zero
        ("parameter: joint4.stiffness, at_most: 1", OPEN),
        ("channel: joint1.motor_position, rmse: 0.2 mrad", PASS),
        ("channel: joint1.motor_position, chi2: 1.2", FAIL),
        ("channel: imu1.x, horizon: 0.1, error: 20 mrad/s", PASS),
        ("channel: imu1.x, horizon: 1, error: 20 mrad/s", FAIL),
        ("channel: imu1.x, horizon: 0.5, error: 20 mrad/s", OPEN),
        ("channel: imu1.x, horizon: open_loop, error: 20 mrad/s", OPEN),
        ("channel: joint1.motor_position, horizon: 0.1, error: 20 mrad/s", OPEN),
        ("channel: imu1.x, rmse: 1 rad/s", OPEN),
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
    line = f"channel: joint1.motor_position, horizon: {horizon}, error: 20 mrad/s"
    assert outcome(tmp_path, line) == (
        OPEN,
        f"this result has {words}`jointscope compare` has 0.01, 0.1, 1.0, open_loop",
    )


def test_of_what_is_no_single_number_the_names_of_the_screen_are_told_and_found(tmp_path):
    told = outcome(tmp_path, "parameter: imu1.bias, sigma: 1 rad/s")
    assert told == (OPEN, "it is no single number: name one of imu1.bias.x, imu1.bias.y, imu1.bias.z")
    assert outcome(tmp_path, "parameter: imu2.bias.x, sigma: 1 rad/s") == (OPEN, "it was held, not calibrated")
    lines = check_limits(limits_of(tmp_path, 'parameter: "imu1.*", sigma: 0.11 rad, because: bench'), CONTENT)
    assert [line.name for line in lines if line.outcome == PASS] == [f"imu1.R_imu_body.{axis}" for axis in "xyz"]
    assert [line.name for line in lines if line.outcome == OPEN] == [f"imu1.bias.{axis}" for axis in "xyz"]


def test_a_pattern_is_checked_on_every_name_that_fits(tmp_path):
    limits = limits_of(tmp_path, 'parameter: "joint*.stiffness", sigma_percent: 4.9, because: bench')
    assert [(line.name, line.outcome) for line in check_limits(limits, CONTENT)] == [
        ("joint1.stiffness", PASS),
        ("joint2.stiffness", FAIL),
        ("joint3.stiffness", OPEN),
    ]


@pytest.mark.parametrize("line", ["parameter: joint1.stiffness, at_most: 1000 N m/rad", "poses: all, p90_mm: 1"])
def test_nothing_of_a_calibration_that_has_not_converged_passes(tmp_path, line):
    assert outcome(tmp_path, line, {**CONTENT, "converged": False})[0] == OPEN


@pytest.mark.parametrize("line", ["parameter: joint1.stiffness, at_most: 1", "channel: imu1.x, rmse: 1 rad/s"])
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
    assert limit.earlier["joint1.stiffness"].value == 400.0  # of the ready robot
    found = outcome(tmp_path, f"{earlier}, drift_percent: 60")
    assert found == (PASS, "52.5 % ± 0.25, from 400 (no sigma: taken as exact) to 190 ± 1 N m/rad")
    assert outcome(tmp_path, f"{earlier}, drift_percent: 52.6")[0] == OPEN
    assert outcome(tmp_path, f"{earlier}, drift: 200 N m/rad")[0] == FAIL
    assert outcome(tmp_path, "parameter: joint1.torque_offset.torque, against: doggy, drift: 200 N m/rad")[0] == OPEN


def test_a_drift_has_the_sigmas_of_both_robots(tmp_path):
    """Of independent values; in percent of the earlier one, whose own sigma counts in proportion."""
    before = load_robot("doggy").parameters["joint1.stiffness"]
    lines = [
        f"parameter: joint1.stiffness, against: doggy, {q}, because: b"
        for q in ("drift: 12 N m/rad", "drift_percent: 6")
    ]
    for limit, far in zip(limits_of(tmp_path, *lines), ("10 N m/rad ± 5", "5 % ± 2.4"), strict=True):
        earlier = {"joint1.stiffness": replace(before, value=200.0, sigma=math.sqrt(24.0))}
        (checked,) = check_limits([replace(limit, earlier=earlier)], CONTENT)
        assert checked.outcome == OPEN
        assert checked.found.startswith(f"{far}, from 200 ± 4.9 to 190 ± 1 N m/rad: two sigma reach")


def test_nothing_passes_in_a_unit_that_was_not_said(tmp_path):
    """Also where only the result knows the unit."""
    (limit,) = limits_of(tmp_path, "parameter: joint1.stiffness, at_most: 1000 N m/rad, because: b")
    for unit, words in (("", "it is in N m/rad, the limit has no unit"), ("N m", "it is in N m/rad, the limit in N m")):
        (checked,) = check_limits([replace(limit, unit=unit)], CONTENT)
        assert (checked.outcome, checked.found) == (OPEN, words)


@pytest.mark.parametrize(
    "line, words",
    [
        ("parameter: joint1.stiffness, at_most: 190", "'190 N m/rad', got '190 without a unit'"),
        ("parameter: joint1.stiffness, sigma: 0.3 N m", "joint1.stiffness is in N m/rad; .*, got '0.3 N m'"),
        ('parameter: "joint1.*", at_least: 1 N m', "limits.1.: at_least of joint1.stiffness is in N m/rad"),
        ("channel: imu1.x, horizon: 0.1, error: 0.5 mrad", "error of imu1.x is in rad/s"),
        ("channel: joint1.motor_position, rmse: 5 mm", "rmse of joint1.motor_position is in rad"),
        ("channel: joint1.motor_position, rmse: 0.5", "rmse of joint1.motor_position is in rad"),
    ],
)
def test_a_unit_that_does_not_fit_the_robot_is_told_before_anything_is_computed(tmp_path, line, words):
    with pytest.raises(RobotError, match=words) as raised:
        check_units(limits_of(tmp_path, f"{line}, because: b"), [load_robot("doggy")])
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "line",
    [
        "parameter: joint1.stiffness, between: [0.1, 0.2 N m/mrad]",
        "parameter: joint1.stiffness, at_least: 0",  # the same in all units
        "parameter: joint1.stiffness, sigma_percent: 2 %",
        "parameter: no.such, at_least: 3",
        "channel: joint1.motor_position, rmse: 0.03 deg",
        "channel: joint1.motor_position, chi2: 1.2",
        "poses: all, p90_mm: 55 um",
    ],
)
def test_units_that_fit_the_robot_are_taken(tmp_path, line):
    check_units(limits_of(tmp_path, f"{line}, because: b"), [load_robot("doggy")])


def test_millimetres_of_poses_may_be_micrometres(tmp_path):
    assert outcome(tmp_path, "poses: all, p90_mm: 55 um") == (PASS, "50 um")
    assert outcome(tmp_path, "poses: all, p90_mm: 45 um") == (FAIL, "50 um")


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
        "parameter: joint1.stiffness, between: [180, 200 N m/rad], because: a",
        "channel: imu1.x, horizon: 0.1, error: 1 deg/s, because: b",
        "parameter: joint1.stiffness, drift_percent: 5, against: doggy, because: c",
    )
    assert first.text == "joint1.stiffness between 180 and 200 N m/rad"
    assert second.text == "imu1.x error 0.1 s ahead at most 1 deg/s"
    assert third.text == "joint1.stiffness drift_percent against doggy at most 5 %"
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
        ("parameter: a.b, between: 3, because: x", r"expected \[lowest, highest\], got 3"),
        ("parameter: a.b, between: [1 N m, 2 s], because: x", "expected two bounds of one unit, got '1 N m' and '2 s'"),
        ("parameter: a.b, between: [1 N m, 2], because: x", "expected two bounds of one unit"),
        ("parameter: a.b, sigma: 2 %, because: x", "write `sigma_percent: 2`"),
        ("parameter: a.b, sigma_percent: 2 mm, because: x", "sigma_percent is in %; .* got '2 mm'"),
        ("poses: all, p90_mm: 2 s, because: x", "p90_mm is in mm"),
        ("parameter: a.b, at_most: .inf, because: x", "expected a number with its unit"),
        ("parameter: a.b, at_most: true, because: x", "expected a number with its unit"),
        ("parameter: a.b, at_most: one, because: x", "expected a number with its unit, such as '0.3 N m', got 'one'"),
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
    for line in (
        "parameter: joint1.stiffness, between: [187, 193 N m/rad]",
        "channel: joint1.motor_position, rmse: 0.2 mrad",
    ):
        assert outcome(tmp_path, line, content)[0] == expected
    assert outcome(tmp_path, "parameter: joint1.stiffness, between: [191 N m/rad, 193 N m/rad]", content)[0] == FAIL
    checked = check_limits(limits_of(tmp_path, "channel: joint1.motor_position, rmse: 0.2 mrad, because: b"), content)
    assert exit_code(checked) == (UNDECIDED if level == "bad" else 0)
