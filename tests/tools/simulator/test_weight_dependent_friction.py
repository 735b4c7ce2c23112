# SPDX-License-Identifier: BSD-3-Clause
"""The friction that a weight makes: the load is that of the posture, by another library, whatever moves."""

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.effects import make_effects
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.engine import Engine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


def test_the_load_is_the_weight_behind_the_rope_in_any_posture_and_motion():
    arm = true_robot(load_robot("biorob"), {})
    effects = make_effects([f"weight_dependent_friction@{j}:coefficient=1,quadratic=0.5" for j in arm.joints], arm)
    engine, rng = Engine(arm, effects), np.random.default_rng(5)
    for _ in range(5):
        q = rng.uniform(-1.5, 1.5, 4)
        engine.place(q)
        engine.data.qvel[:] = rng.standard_normal(engine.model.nv)
        model = arm.tree.model
        load = arm.transmission.T @ pin.computeGeneralizedGravity(model, model.createData(), q)
        extra = [effect.extra(0.0, 1.0) for effect in effects]
        np.testing.assert_allclose(extra, np.abs(load) + 0.5 * load**2, atol=1e-9)
