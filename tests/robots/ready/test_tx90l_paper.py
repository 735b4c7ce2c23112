# SPDX-License-Identifier: BSD-3-Clause
"""Table 1 of the TX90L's paper gives damping in kN m s/rad: taken as printed, nothing of the arm resonates."""

from __future__ import annotations

import numpy as np

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.flexible_arm import FlexibleArm


def oscillating(name):
    """Frequencies [Hz] and damping ratios of the modes that swing, motors held, stretched out."""
    robot = load_robot(name)
    arm, values = FlexibleArm(robot), robot.values
    M, _, G = arm.linearised(np.zeros(robot.n), values).mean
    k, d = (np.diag([values[getattr(s, name)] for s in arm.springs]) for name in ("stiffness", "damping"))
    n = len(M)
    rates = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, k + G), -np.linalg.solve(M, d)]])
    poles = np.linalg.eigvals(rates)
    poles = poles[poles.imag > 1e-6]
    return np.abs(poles) / (2.0 * np.pi), -poles.real / np.abs(poles)


def test_damping_as_printed_leaves_nothing_to_resonate():
    frequencies, ratios = oscillating("tx90l")
    low = frequencies < 75.0  # [Hz] to which the paper shakes the arm
    assert np.sum(low) >= 3 and np.all(ratios[low] < 0.3)
    assert not len(oscillating("tx90l_paper")[0])


def test_nothing_but_damping_differs():
    right, printed = load_robot("tx90l").values, load_robot("tx90l_paper").values
    assert right.keys() == printed.keys()
    for name, value in right.items():
        assert printed[name] == (1000.0 if "damping" in name else 1.0) * value, name
