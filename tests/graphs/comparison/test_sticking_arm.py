# SPDX-License-Identifier: BSD-3-Clause
"""True values of an arm whose dry friction truly holds its joints: no floor above the error, no push that was none."""

from __future__ import annotations

import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.graphs.comparison.compare import compare_model
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yxy", dry=(4.0, 1.5, 0.5))
PUSH = (4.0, 4.25, 1, 4.0)


@pytest.fixture
def compared(tmp_path):
    """The arm's true values against a recording of it; the noise comes from the recording."""
    robot = load_robot(robot_file(ARM, tmp_path))
    laws = {"inertia": ARM.inertia, "coulomb_torque": ARM.dry, "motor_viscous.coefficient": ARM.viscous}
    values = {f"{joint}.{law}": own[j] for law, own in laws.items() for j, joint in enumerate(ARM.joints)}

    def of(**how):
        encoder, command = moved(ARM, encoder_rate=250.0, command_rate=250.0, sticks=True, **how)
        recording = Recording("stick.mcap", "", 10**18, {"encoder": encoder, "command": command})
        return compare_model("true", robot.with_values(values), recording)

    return of


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_of_a_rounded_friction_makes_no_floor_above_the_error(compared, seed):
    found = compared(seed=seed)
    assert 1.0 < found.floor < found.error  # the values are true, but a rounded friction never quite holds
    assert found.isolated == ()


def test_a_push_on_a_sticking_arm_is_told_by_a_comparison_too(compared):
    (moment,) = compared(seed=1, push=PUSH).isolated
    assert moment.row == "j1.link"
    assert moment.t0 < PUSH[0] + 0.1 and moment.t1 > PUSH[1] - 0.1
    assert moment.torque == pytest.approx(PUSH[3], rel=0.2)
