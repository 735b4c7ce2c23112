# SPDX-License-Identifier: BSD-3-Clause
"""A singular Hessian is answered with the names of the values that it leaves open."""

from __future__ import annotations

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.graphs.solving.unobservable import unobservable, value_names


def test_every_shared_value_of_two_recordings_has_a_name(doggy):
    calibration = Calibration.of(doggy)
    shared = SharedLayout.of(calibration, 2)
    names = value_names(shared, calibration)
    assert len(names) == shared.size and "" not in names
    assert names[: len(calibration.names)] == list(calibration.names)
    assert names.count("imu1.R_imu_body") == 3 and names.count("imu2.bias") == 6


def test_the_values_of_the_weakest_direction_are_named_whatever_their_units(doggy):
    calibration = Calibration.of(doggy)
    shared = SharedLayout.of(calibration, 1)
    i, j = (calibration.names.index(name) for name in ("motor.k_pwm", "motor.inertia"))
    H = np.diag(10.0 ** np.linspace(-8, 8, shared.size))
    H[i, j] = H[j, i] = np.sqrt(H[i, i] * H[j, j])  # only their product is known
    said = str(unobservable(H, np.arange(shared.size), shared, calibration))
    assert "do not determine" in said and "motor.k_pwm" in said and "motor.inertia" in said
    assert "stiffness" not in said and "imu" not in said


def test_a_value_that_nothing_sees_is_named_alone_and_held_ones_never(doggy):
    calibration = Calibration.of(doggy)
    shared = SharedLayout.of(calibration, 1)
    k = calibration.names.index("joint2.damping")
    H = np.eye(shared.size)
    H[k, k] = H[0, 0] = 0.0
    said = str(unobservable(H, np.arange(1, shared.size), shared, calibration))
    assert "determine joint2.damping:" in said
