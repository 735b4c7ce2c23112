# SPDX-License-Identifier: BSD-3-Clause
"""Predictions do not begin while a motor stands whose friction is stiff: no equation holds its speed there."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.comparison.compare import compare_model, smooth
from jointscope.graphs.comparison.noise_floor import are_judged
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording

BIOROB = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "biorob"
RADII = (0.0079, 0.0121, 0.0121, 0.009)  # [m] of the pulleys, where ropes leave the motors


@pytest.fixture(scope="module")
def arm():
    """BioRob with the values with which its recordings were simulated."""
    if not BIOROB.is_dir():
        pytest.skip("needs recordings that are not part of this repository")
    true = json.loads((BIOROB / "clean" / "truth.json").read_text())["train"]["true"]
    values = {}
    for i, r in enumerate(RADII):
        spring, friction = true["spring_N_per_m_powers_1_2_3"][i], true["friction_Nm_powers_0_1_2_of_abs_load"][i]
        back, own = (true[f"{name}_pulley_Nms_per_rad"][i] for name in ("back_emf_damping", "motor_viscous"))
        own_values = {
            "stiffness": spring[0] * r**2,
            "damping": true["spring_damping_Ns_per_m"][i] * r**2,
            "coulomb_torque": friction[0],
            "weight_dependent_friction.coefficient": friction[1],
            "weight_dependent_friction.quadratic": friction[2],
            "inertia": true["motor_inertia_pulley_kgm2"][i],
            "k_mi": back + own,
            "link_viscous.coefficient": true["link_damping_Nms_per_rad"][i],
        }
        if any(spring[1:]):
            own_values |= {"spring_curve.quadratic": -spring[1] * r**3, "spring_curve.cubic": spring[2] * r**4}
        values |= {f"joint{i + 1}.{name}": value for name, value in own_values.items()}
    return load_robot("biorob").with_values(values)


@pytest.mark.slow
def test_the_error_of_true_values_is_what_noise_alone_leaves(arm):
    found = compare_model("true", arm, read_recording(BIOROB / "clean" / "test", arm))
    assert found.error == pytest.approx(found.floor, rel=0.03)


def test_starts_while_a_motor_stands_are_left_out_where_others_remain(arm):
    recording = read_recording(BIOROB / "clean" / "test", arm)
    problem, _, _ = smooth(arm, recording.between(0.0, 3.0))
    ticks = np.arange(len(problem.timeline.ticks) - 60)
    stands = problem.motor_stands(ticks)
    assert 0.02 < np.mean(stands) < 0.9
    judged = are_judged(problem, ticks, 0.1)
    assert not np.any(judged & stands) and np.any(judged)
    only = ticks[stands]
    np.testing.assert_array_equal(are_judged(problem, only, 0.1), np.ones(len(only), bool))
