# SPDX-License-Identifier: BSD-3-Clause
"""The floor is the error of the right model, whether or not the model is right; free torques and widened gyros."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.comparison.compare import compare_model, compared, smooth
from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.noise.lasting_noise import separate_noise
from jointscope.graphs.noise.linear_smoother import LinearSmoother
from jointscope.graphs.noise.noise_estimation import densities, scaled
from jointscope.robots.parts.process_noise import ProcessNoise


def recorded(doggy, seconds=3.0, **choices):
    """A recording and the base model with its true values, never calibrated: its noise comes from the recording."""
    pytest.importorskip("mujoco")
    from jointscope.tools.simulator import simulate

    simulation = simulate(doggy, "moves", seconds, seed=7, friction="smooth", **choices)
    known = simulation.truth["parameters"]
    robot = doggy.with_values({name: known[name] for name in doggy.parameters})
    mounted = {g.name: replace(g, R_imu_body=np.array(known[f"{g.name}.R_imu_body"])) for g in robot.gyros}
    return robot.with_sensors(mounted), simulation.recording


@pytest.mark.slow
def test_floor_of_a_true_model_under_white_torques_is_its_error(doggy):
    from jointscope.tools.simulator import Disturbance

    robot, recording = recorded(doggy, 4.0, disturbance=Disturbance(link=0.3, motor=0.3))
    found = compare_model("true", robot, recording)
    assert found.error > 1.4
    assert found.floor == pytest.approx(found.error, rel=0.1)


@pytest.mark.slow
def test_a_missing_effect_does_not_lift_the_floor(doggy):
    robot, recording = recorded(doggy, effects=["motor_viscous@joint2"])
    found = compare_model("base", robot, recording)
    assert found.error > 5.0
    assert found.floor == pytest.approx(1.02, abs=0.05)


def test_white_densities_never_exceed_the_models_own_and_known_values_smooth_as_the_solver_does(doggy):
    robot, recording = recorded(doggy, 2.0)
    problem, x, calibration = smooth(robot, recording)
    own = problem.dynamics.steps.noise
    separate = separate_noise(problem, x, calibration)
    assert np.all(densities(separate.white) <= densities(own) * (1.0 + 1e-12))
    again = LinearSmoother.of(problem, x, calibration).smooth(own, {}).x
    np.testing.assert_allclose(again, x, atol=1e-5)


def test_a_worse_model_stands_beside_the_floor_of_the_best_and_not_beside_its_own():
    def one(label, robot, recording):
        error, floor, names = robot
        return ModelComparison(label, None, error, floor, {}, (), {}, dict.fromkeys(names, floor))

    models = {"useless": (50.0, 49.9, "ab"), "exact": (1.03, 1.0, "ab"), "of other channels": (7.0, 2.0, "bc")}
    found = compared(models, None, one, None).models
    assert [model.floor for model in found] == [1.0, 1.0, 2.0]
    assert [model.error for model in found] == [50.0, 1.03, 7.0]
    assert found[0].floors == {"a": 1.0, "b": 1.0}


def test_torques_that_last_are_scaled_and_memories_of_effects_are_not():
    noise = ProcessNoise(True, "integrated", np.ones(1), np.ones(1), memory=np.array([0.5]))
    factors = np.array([2.0, 3.0, 5.0, 7.0, 11.0])
    np.testing.assert_allclose(densities(scaled(noise, factors[:3])), [2.0, 3.0, 0.5])
    lasting = noise.with_lasting(0.02, np.array([1.0, 2.0]))
    np.testing.assert_allclose(densities(scaled(lasting, factors)), [2.0, 3.0, 0.5, 70.0, 220.0])


def test_where_lasting_torques_run_away_the_floor_is_the_noise_of_the_sensors(monkeypatch, doggy):
    from types import SimpleNamespace

    from jointscope.graphs.comparison import noise_floor
    from jointscope.robots.errors import SolveError

    def runs_away(*args):
        raise SolveError("the state at tick 7 is not determined")

    monkeypatch.setattr(noise_floor, "separate_noise", runs_away)
    floors = noise_floor.channel_floors(SimpleNamespace(robot=doggy, with_noise=None), None, None, 0.1)
    assert floors == dict.fromkeys(doggy.channels, 1.0)
