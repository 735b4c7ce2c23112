# SPDX-License-Identifier: BSD-3-Clause
"""Samples of a quantized encoder share errors in slow motion, those of a white one never do."""

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.coarse_encoder import MOST, encoder_steps, shared_error
from jointscope.robots.recordings.recording import Stream

pytest.importorskip("mujoco", reason="one test simulates its recording")

STEP, SIGMA = 2.4e-4, 2.4e-4 / np.sqrt(12.0)


def stream(values):
    times = np.arange(len(values)) * 1e-3
    return Stream("motor_encoder", times, values, ("joint1.motor_position",), "rad")


def rounded(values):
    return STEP * np.rint(values / STEP)


def test_the_smallest_change_of_a_quantized_encoder_is_its_step():
    ramp = rounded(0.05 * np.arange(2000)[:, None] * 1e-3)
    assert encoder_steps(ramp) == pytest.approx([STEP])
    assert encoder_steps(np.ones((5, 1))) == pytest.approx([0.0])


def test_a_sample_counts_for_less_the_more_of_them_share_one_error():
    """At 0.012 rad/s one step lasts 20 ms: twenty samples are worth one."""
    ramp = rounded(0.012 * np.arange(4000)[:, None] * 1e-3)
    scale = shared_error(stream(ramp), SIGMA)
    assert np.median(scale[200:-200]) == pytest.approx(np.sqrt(20.0), rel=0.15)


def test_fast_motion_shares_nothing_and_rest_is_bounded():
    fast = rounded(2.0 * np.arange(1000)[:, None] * 1e-3)
    assert np.all(shared_error(stream(fast), SIGMA) == 1.0)
    both = np.vstack([fast, np.full((1000, 1), fast[-1, 0])])
    assert shared_error(stream(both), SIGMA)[-100:].max() == pytest.approx(np.sqrt(MOST))


def test_white_noise_is_no_quantization():
    rng = np.random.default_rng(1)
    assert shared_error(stream(SIGMA * rng.standard_normal((3000, 1))), SIGMA) is None


@pytest.mark.slow
def test_quantized_encoders_leave_friction_and_noise_where_they_are(doggy, simulated):
    published = {name: p.published for name, p in doggy.parameters.items() if p.published is not None}
    result = calibrate(doggy.with_values(published), [simulated.recording])
    truth = simulated.truth["parameters"]
    for joint in doggy.joints:
        name = f"{joint}.coulomb_torque"
        found = next(p for p in result.parameters if p.name == name)
        assert abs(found.value - truth[name]) < 4.0 * found.sigma
        assert result.channels[f"{joint}.motor_position"].chi2 < 1.3
    assert np.all(result.noise.motor_velocity < 0.01)
