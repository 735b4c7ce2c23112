# SPDX-License-Identifier: BSD-3-Clause
"""Accelerometers where models are compared: predicted from the equations of motion, and part of a diagnosis."""

from __future__ import annotations

import numpy as np
import pytest
from linearised_motion import with_an_accelerometer

from jointscope.graphs.comparison.channel_errors import channel_errors
from jointscope.graphs.discovery.diagnose import diagnose

pytestmark = pytest.mark.slow

HIDDEN, COEFFICIENT = "load_dependent_friction@joint2", 0.25
AXES = ("acc.x", "acc.y", "acc.z")


@pytest.fixture(scope="module")
def found():
    """Two seconds of a robot with an accelerometer and an effect that its model lacks."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    robot = with_an_accelerometer()
    near = robot.with_values({name: p.published for name, p in robot.parameters.items() if p.published is not None})
    effect = f"{HIDDEN}:coefficient={COEFFICIENT}"
    recording = simulate(robot, "calibration", 2.0, seed=5, friction="smooth", effects=[effect]).recording
    return diagnose(near, [recording], leaders=1, missing_torque=False)


def test_the_hidden_effect_is_found_with_its_size(found):
    best = found.candidates[0]
    size = best.parameters["coefficient"]
    assert (best.label, best.verdict) == (HIDDEN, "missing")
    assert abs(size.value - COEFFICIENT) < 3.5 * size.sigma
    assert best.validation_error < 1.2 < 2.0 < found.validation_error


def test_every_axis_has_an_error_and_a_floor_in_its_unit(found):
    errors = {e.channel: e for e in channel_errors(found.comparison)}
    assert all(errors[axis].unit == "m/s^2" for axis in AXES)
    assert all(1.0 <= errors[axis].floor / errors[axis].sigma < 1.2 for axis in AXES)
    errors_ahead = [found.comparison.channels[axis].horizons[ahead] for axis in AXES for ahead in ("0.01", "0.1")]
    assert np.all(np.isfinite(errors_ahead))
