# SPDX-License-Identifier: BSD-3-Clause
"""Iterations end where steps say nothing any more, measured against what the model leaves unexplained."""

import math
from dataclasses import replace

import pytest

from jointscope.graphs.calibration.findings import findings
from jointscope.graphs.solving.convergence import Iteration, has_converged, is_flat, misfit, next_damping, short_step


def falls(cost, share, steps, in_sigmas=1.3):
    """Iterations whose cost falls by the same share each."""
    found = []
    for _ in range(steps):
        found.append(Iteration(cost, cost * (1.0 - share), 0.7, in_sigmas))
        cost *= 1.0 - share
    return found


def test_a_model_that_agrees_has_no_misfit_and_the_usual_tolerance():
    assert misfit(400.0, 1000) == 1.0
    assert short_step(400.0, 0.1, 1000) == 0.1


def test_steps_are_judged_against_the_misfit():
    assert misfit(12_500.0, 1000) == pytest.approx(5.0)
    short = [Iteration(12_501.0, 12_500.5, 0.0, 0.3), Iteration(12_500.5, 12_500.0, 0.0, 0.1)]
    assert has_converged(short, 0.1, 1000, undamped=False)
    assert not has_converged(short, 0.1, 25_000, undamped=False)  # the same steps where the residuals are as stated


def test_only_a_model_that_contradicts_its_recording_is_flat():
    assert is_flat(falls(12_500.0, 1e-6, 3), 1000)
    assert not is_flat(falls(12_500.0, 1e-6, 2), 1000)
    assert not is_flat(falls(12_500.0, 1e-4, 3), 1000)
    assert not is_flat(falls(600.0, 1e-6, 3), 1000)


def test_short_damped_steps_that_gain_nothing_end_at_kinks_and_undamped_or_long_ones_do_not():
    assert is_flat(falls(600.0, 1e-6, 3, in_sigmas=0.2), 1000)
    assert not is_flat(falls(600.0, 1e-4, 3, in_sigmas=0.2), 1000)
    assert not is_flat([replace(i, damping=1e-9) for i in falls(600.0, 1e-6, 3, in_sigmas=0.2)], 1000)


def test_a_solve_goes_on_with_the_damping_of_the_last():
    assert next_damping([]) == 1e-9
    assert next_damping(falls(600.0, 1e-6, 2)) == pytest.approx(0.7 / 30.0)


def test_steps_that_shrink_slowly_have_not_arrived():
    slow = [Iteration(500.0, 499.9, 0.0, 0.099), Iteration(499.9, 499.8, 0.0, 0.098)]
    assert not has_converged(slow, 0.1, 1000, undamped=False)


def test_rounding_alone_counts_only_in_undamped_steps():
    same = [Iteration(500.0, 500.0, 1e-9, 3.0)]
    assert has_converged(same, 0.1, 1000, undamped=True)
    assert not has_converged(same, 0.1, 1000, undamped=False)


@pytest.mark.slow
def test_a_calibration_that_never_came_to_rest_says_so_first(simulated, doggy):
    from jointscope.graphs.calibration.calibrate import calibrate

    result = calibrate(doggy, [simulated.recording.between(0.0, 4.0)])
    assert result.converged and result.to_json()["converged"] is True
    restless = replace(result, converged=False)
    assert "contradicts the recordings" in findings(restless)[0]
    assert restless.to_json()["converged"] is False
    assert math.isfinite(result.cost)
