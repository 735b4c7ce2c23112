# SPDX-License-Identifier: BSD-3-Clause
"""Faults of rope drives and of encoders on links come out as large as the engine made them."""

from __future__ import annotations

import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
pytestmark = pytest.mark.slow

ARM = load_robot("biorob")
CURVE = "spring_curve@joint1:quadratic=-0.13,cubic=0.54"


@pytest.mark.parametrize(
    ("label", "sizes"),
    [
        ("spring_slack@joint1", {"forward": 0.2, "backward": 0.0}),  # behind it the spring has a curve
        ("encoder_harmonics@joint3.link", {"cos": 0.006, "sin": -0.004, "order": 4.0}),
    ],
)
def test_a_fault_comes_out_as_large_as_it_is(label, sizes):
    from jointscope.tools.simulator import simulate

    fault = f"{label}:{','.join(f'{name}={value}' for name, value in sizes.items())}"
    recording = simulate(ARM, "calibration", 5.0, 3, effects=[CURVE, fault]).recording
    found = calibrate(add_effect(ARM, label), [recording]).robot.parameters
    start = "{1}.{0}.".format(*label.split("@"))
    for name, value in sizes.items():
        p = found[f"{start}{name}"]
        assert p.sigma is not None and p.sigma < 0.05
        assert abs(p.value - value) < 3.0 * p.sigma, f"{p.name}: {p.value} +- {p.sigma}, true {value}"
