# SPDX-License-Identifier: BSD-3-Clause
"""Arms whose friction turns over at speeds that their encoders see: standstill is asked, no joint is said to stick."""

from __future__ import annotations

import pytest
from simulated_arm import Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.verdicts.judgement import judge

ARM = Arm("yxy", dry=(3.0, 1.5, 0.5))
SHARP = 40.0  # [s/rad] full friction at a few percent of the fastest motion
FREE = "  jN.friction_sharpness: {value: 200.0, unit: s/rad, prior_sigma: 400.0}\n"


@pytest.mark.parametrize("seed", [1, 2])
def test_a_law_in_sight_is_found_in_few_iterations(tmp_path, seed):
    encoder, command = moved(ARM, encoder_rate=125.0, command_rate=125.0, noise=1e-5, seed=seed, sharp=SHARP)
    recording = Recording("arm.mcap", "", 10**18, {"encoder": encoder, "command": command})
    path = robot_file(ARM, tmp_path)
    path.write_text(path.read_text() + "".join(FREE.replace("jN", joint) for joint in ARM.joints))
    result = calibrate(load_robot(path), [recording])
    assert_right(ARM, result.parameters, rel=0.01)
    found = [p for p in result.parameters if p.name.endswith("friction_sharpness")]
    assert len(found) == len(ARM.joints) and not any(result.robot.parameters[p.name].fixed for p in found)
    for p in found:
        assert abs(p.value - SHARP) < 3.5 * p.sigma < 0.5 * SHARP
    assert not any("sticks" in said for said in result.findings)
    assert sum(i.stage == "all samples" for i in result.iterations) < 25
    assert judge(result).level in ("good", "warn")
