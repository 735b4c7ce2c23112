# SPDX-License-Identifier: BSD-3-Clause
"""A file that says the opposite of what the motion says of its drive signal is told what to write."""

from __future__ import annotations

import numpy as np
import pytest
from slow_pendulum import pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.screening.mistaken_hold import mistaken_hold
from jointscope.robots.files.effect_editing import add_effect
from jointscope.tools.verdicts.half_a_sample import fitted_half_sample
from jointscope.tools.verdicts.judgement import judge


@pytest.fixture(scope="module", params=[False, True], ids=["held", "measured"])
def swung(request):
    """Whether the current was measured, and the recording."""
    stamps, currents, angles = swing(4.0, 100.0, smooth_drive=request.param)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(angles.shape)
    return request.param, recorded(stamps, currents, angles + noise)


def said(measured):
    return f", held: {str(not measured).lower()}"


def test_the_opposite_of_what_the_motion_says_is_named(swung, tmp_path):
    measured, recording = swung
    wrong = pendulum(tmp_path, 1e-5, held=said(not measured))
    (notice,) = mistaken_hold(recording, wrong)
    assert f"write `held: {str(not measured).lower()}` in the section command of " in notice.text
    verdict = judge(calibrate(wrong, [recording]))
    assert verdict.level == "bad" and notice.text[1:] in verdict.answer


def test_nothing_is_said_of_a_file_that_is_right_or_says_nothing(swung, tmp_path):
    measured, recording = swung
    assert not mistaken_hold(recording, pendulum(tmp_path, 1e-5, held=said(measured)))
    assert not mistaken_hold(recording, pendulum(tmp_path, 1e-5))


def test_a_fitted_delay_of_half_a_sample_is_no_delay(swung, tmp_path):
    measured, recording = swung
    delayed = [
        add_effect(pendulum(tmp_path, 1e-5, held=said(x)), "command_delay@robot") for x in (measured, not measured)
    ]
    right, wrong = (fitted_half_sample(calibrate(robot, [recording])) for robot in delayed)
    assert not right
    assert "half a sample (5.0" in wrong or "half a sample (4.9" in wrong
    assert f"write `held: {str(not measured).lower()}`" in wrong and "jointscope remove" in wrong
