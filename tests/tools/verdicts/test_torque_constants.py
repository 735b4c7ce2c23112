# SPDX-License-Identifier: BSD-3-Clause
"""Constants that are all one number speak of wrong masses, not of drives; no residual shows that."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from jointscope.tools.command_line import main
from jointscope.tools.verdicts.torque_constants import suspicious_constants

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")


def result(constants, law="torque_constant", confirmed=False):
    joints = tuple("abcdef"[: len(constants)])
    robot = SimpleNamespace(
        joints=joints,
        n=len(joints),
        drive_gain=law,
        command=SimpleNamespace(confirmed=confirmed),
        tree=SimpleNamespace(urdf=Path("arm.urdf"), other_joints=()),
        **{"name": "arm", "path": Path("arm.yaml"), "held_at_mean": (), "sensors": {}},
        motor_encoder=SimpleNamespace(source=SimpleNamespace(names=joints)),
    )
    told = [SimpleNamespace(name=f"{j}.{law}", value=k) for j, k in zip(joints, constants, strict=True)]
    return SimpleNamespace(
        robot=robot, start=robot, bags=(), parameters=[*told, SimpleNamespace(name="a.inertia", value=1.0)]
    )


@pytest.mark.parametrize(
    "constants", [(16.4, 6.07, 0.74), (0.1, 0.1, 0.2), (2.3,), (0.4,)], ids=["unlike", "two alike", "one", "lone"]
)
def test_drives_that_are_unlike_are_believed(constants):
    assert suspicious_constants(result(constants)) == ""


@pytest.mark.parametrize(
    ("constants", "words"),
    [
        ((1000.2, 999.8, 1000.0), "1e+03 times what they should be (in grams?)"),
        ((930.0, 1100.0, 1000.0), "in grams?"),
        ((1004.0,), "in grams?"),
        ((0.00101, 0.00099), "0.001 times"),
        ((0.4946, 0.5124, 0.52), "0.512 times what they should be, or torques before gears of that ratio"),
        ((100.0, 101.0), "`scale: 100`"),
        (
            (0.99, 1.02, 1.0),
            "it is a torque, then, in N m: `jointscope init arm.urdf BAG --unit Nm -o arm_anew.yaml` says",
        ),
    ],
)
def test_one_number_on_all_joints_is_doubted_with_what_it_may_be(constants, words):
    text = suspicious_constants(result(constants))
    assert words in text
    assert "confirmed: true" in text


def test_who_names_the_unit_is_believed():
    assert suspicious_constants(result((0.5, 0.5, 0.5), confirmed=True)) == ""
    assert suspicious_constants(result((0.5, 0.5, 0.5), law="k_pwm")) == ""


@pytest.mark.slow
@needs_cases
@pytest.mark.parametrize("factor", [1000.0, 0.5])
def test_masses_that_are_off_by_a_factor_are_never_called_good(tmp_path, capsys, factor):
    def scaled(match):
        return f'{match[1]}="{factor * float(match[2]):.9g}"'

    text = re.sub(r'(mass value|i[xyz]{2})="([0-9.e+-]+)"', scaled, (CASES / "arm_viscous.urdf").read_text())
    urdf, bag, robot = tmp_path / "arm.urdf", CASES / "arm_viscous.mcap", tmp_path / "arm.yaml"
    urdf.write_text(text)
    assert main(["init", str(urdf), str(bag), "-o", str(robot)]) == 0
    assert main(["calibrate", str(robot), str(bag), "-o", str(tmp_path / "c.yaml")]) == 0
    told = capsys.readouterr().out
    assert "No, do not rely" in told
    assert f"the masses of arm.urdf are {factor:.3g} times what they should be" in told


@needs_cases
def test_a_unit_that_was_named_is_written_as_confirmed(tmp_path):
    urdf, bag, robot = CASES / "arm_amps.urdf", CASES / "arm_amps.mcap", tmp_path / "arm.yaml"
    assert main(["init", str(urdf), str(bag), "-o", str(robot), "--unit", "A"]) == 0
    assert re.search(r"\n  confirmed: true +# you named the unit\n", robot.read_text())
