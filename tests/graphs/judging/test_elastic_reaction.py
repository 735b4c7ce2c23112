# SPDX-License-Identifier: BSD-3-Clause
"""The torque that a rigid model lacks for a load behind a spring, against loads integrated sample by sample."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.judging.elastic_reaction import (
    beside_springs,
    known_springs,
    reaction_column,
    spring_hypotheses,
    spring_start,
)
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue

H, FINE, LOAD = 1e-3, 50, 0.4
SPRING = EffectAt(catalogue()["joint_elasticity"], "axis")


def swinging_load(accelerations, stiffness, damping):
    """Torque of the spring at the ticks, by small semi-implicit steps."""
    q = v = ql = vl = 0.0
    torques, h = [], H / FINE
    for k, a in enumerate(accelerations[:-1]):
        torques.append(stiffness * (q - ql) + damping * (v - vl))
        for i in range(FINE):
            now = a + (accelerations[k + 1] - a) * i / FINE
            vl += h * (stiffness * (q - ql) + damping * (v - vl)) / LOAD
            v += h * now
            q, ql = q + h * v, ql + h * vl
    return np.array(torques)


def steps_of(accelerations):
    """Steps of one axis whose model is a rigid load."""
    tree = SimpleNamespace(torque=lambda q, v, a: LOAD * a)
    robot = SimpleNamespace(joints=("axis",), kinematic_tree=tree)
    layout = SimpleNamespace(joint_link=np.array([0]), q_link=[0], v_link=[1])
    ticks, zero = H * np.arange(len(accelerations)), np.zeros(len(accelerations))
    signals = SimpleNamespace(
        robot=robot,
        model=SimpleNamespace(layout=layout),
        ticks=ticks,
        x=np.zeros((len(ticks), 2)),
        rate=np.column_stack([zero, accelerations]),
    )
    return SimpleNamespace(segment=SimpleNamespace(signals=signals), missing=np.zeros((len(ticks) - 1, 1)))


@pytest.mark.parametrize(("frequency", "ratio"), [(6.0, 0.1), (15.0, 0.03), (33.0, 0.01)])
def test_a_rigid_model_lacks_what_the_load_keeps_back(frequency, ratio):
    rng = np.random.default_rng(5)
    accelerations = np.convolve(rng.normal(size=3000), np.ones(40) / 40.0)[:3000] * 20.0
    accelerations[:100] = 0.0
    w = 2.0 * np.pi * frequency
    torque = swinging_load(accelerations, LOAD * w * w, 2.0 * ratio * w * LOAD)
    hypothesis = SimpleNamespace(here=SPRING, shapes={"frequency": frequency, "damping_ratio": ratio})
    found = reaction_column(steps_of(accelerations), hypothesis)[:-1, 0, 0]
    lacking = LOAD * accelerations[:-1] - torque
    wanted = 0.5 * (lacking[1:] + lacking[:-1])
    assert np.sqrt(np.mean((found[: len(wanted)] - wanted) ** 2)) < 0.02 * np.sqrt(np.mean(wanted**2))


@dataclass(frozen=True)
class Steps:
    """Steps whose missing torque and base columns may change."""

    segment: SimpleNamespace
    missing: np.ndarray
    base: np.ndarray


def test_what_a_known_spring_keeps_back_is_not_missing_and_its_error_is_a_base_column():
    rng = np.random.default_rng(6)
    accelerations = np.convolve(rng.normal(size=3000), np.ones(40) / 40.0)[:3000] * 20.0
    accelerations[:100] = 0.0
    (true,) = known_springs(elastic(12.0, 0.05), rigid())
    assert true.shapes == pytest.approx({"frequency": 12.0, "damping_ratio": 0.05})
    bare = steps_of(accelerations)
    steps = Steps(bare.segment, reaction_column(bare, true)[:, :, 0] + 0.7, np.ones((2999, 1, 1)))
    np.testing.assert_allclose(beside_springs(steps, [true]).missing, 0.7, atol=1e-12)
    (wrong,) = known_springs(elastic(12.003, 0.0505), rigid())
    beside = beside_springs(steps, [wrong])
    fitted, left = np.linalg.lstsq(beside.base[:, 0], beside.missing[:, 0], rcond=None)[:2]
    assert fitted == pytest.approx([0.7, np.log(12.0 / 12.003), np.log(0.05 / 0.0505)], rel=0.03)
    assert left[0] < 1e-3 * np.sum((beside.missing - 0.7) ** 2)


def elastic(frequency, ratio):
    """A robot with a spring behind its axis."""
    w = 2.0 * np.pi * frequency
    values = {"compliance": 1.0 / (LOAD * w * w), "damping": 2.0 * ratio * w * LOAD}
    parameters = {SPRING.parameter(name): SimpleNamespace(value=value) for name, value in values.items()}
    return SimpleNamespace(effects=(SPRING,), parameters=parameters)


def rigid():
    """The same without."""
    return SimpleNamespace(joints=("axis",), n=1, tree=SimpleNamespace(mass_matrix=lambda q: np.array([[[LOAD]]])))


def test_resonances_that_the_ticks_hardly_show_are_not_tried():
    slow = [h.shapes["frequency"] for h in spring_hypotheses(SPRING, 0.01)]
    fast = [h.shapes["frequency"] for h in spring_hypotheses(SPRING, 0.001)]
    assert max(slow) <= 1.0 / 0.06 < max(fast) and min(slow) == min(fast)


def test_a_spring_starts_at_its_resonance():
    robot = rigid()
    hypothesis = SimpleNamespace(here=SPRING, shapes={"frequency": 10.0, "damping_ratio": 0.05})
    start = spring_start(robot, hypothesis)
    w = np.sqrt(1.0 / (start["compliance"] * LOAD))
    assert w == pytest.approx(20.0 * np.pi) and start["damping"] == pytest.approx(0.1 * w * LOAD)
