# SPDX-License-Identifier: BSD-3-Clause
"""Random torques that last: found with their memory and size where they are, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.noise.linear_smoother import LinearSmoother
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.robots.parts.sensors import MotorEncoder

TORQUE = 0.5  # [N m]


def simulated(doggy, memory, seconds=6.0, seed=100):
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import Disturbance, simulate

    disturbance = Disturbance(link=TORQUE, motor=TORQUE, correlation_time=memory)
    return simulate(doggy, "calibration", seconds, seed, friction="smooth", quantized=False, disturbance=disturbance)


def test_all_memories_are_as_likely_where_sensors_tell_nothing(doggy):
    """Steps of torques that decay are no plain differences: without their volume short memories would win."""
    recording = simulated(doggy, 0.02, seconds=1.0).recording
    blind = doggy.with_sensors({name: replace(s, **_deaf(s)) for name, s in doggy.sensors.items()})
    found = []
    for memory in (0.005, 0.02, 0.1):
        robot = replace(blind, noise=doggy.noise.with_lasting(memory, np.linspace(0.5, 2.0, 6)))
        problem = BagProblem.of(robot, recording)
        x = np.zeros((len(problem.timeline.ticks), robot.layout.size))
        found.append(LinearSmoother.of(problem, x, Calibration.of(robot)).smooth(robot.noise, {}).evidence)
    np.testing.assert_allclose(found, found[0], atol=0.5)


def _deaf(sensor):
    """A sensor a million times noisier."""
    return {"sigmas": 1e6 * sensor.sigmas} if isinstance(sensor, MotorEncoder) else {"sigma": 1e6 * sensor.sigma}


@pytest.fixture(scope="module")
def lasting(doggy):
    """Simulation and calibration under torques that last 50 ms."""
    simulation = simulated(doggy, 0.05)
    return simulation, calibrate(doggy, [simulation.recording])


@pytest.mark.slow
def test_torques_that_last_are_found_with_their_memory_and_size(lasting):
    simulation, result = lasting
    assert result.noise.correlation_time == 0.05
    assert list(lasting_torques(result.robot).values()) == pytest.approx([TORQUE] * 6, rel=0.25)
    truth = simulation.truth["parameters"]
    z = [(p.value - truth[p.name]) / p.sigma for p in result.parameters if p.name in result.robot.parameters]
    assert np.sqrt(np.mean(np.square(z))) < 1.5


@pytest.mark.slow
def test_they_are_told_and_kept_in_the_robot_file(lasting, tmp_path):
    _, result = lasting
    assert any("random torques last: joint1.link 0." in finding for finding in result.findings)
    told = result.to_json()["noise"]["lasting_torques"]
    assert told["memory"] == 0.05
    assert told["rms"] == lasting_torques(result.robot)
    (tmp_path / "kept.yaml").write_text(robot_text(result.robot, tmp_path), encoding="utf-8")
    kept = load_robot(tmp_path / "kept.yaml")
    assert kept.layout == result.robot.layout
    np.testing.assert_allclose(kept.noise.memory, result.noise.memory, rtol=1e-3)


@pytest.mark.slow
def test_white_torques_leave_a_calibration_as_it_was(doggy):
    recording = simulated(doggy, 0.0).recording
    with_search, without = (calibrate(doggy, [recording], memory=memory) for memory in (True, False))
    assert with_search.noise.correlation_time == 0.0
    assert [p.value for p in with_search.parameters] == [p.value for p in without.parameters]
    assert "lasting_torques" not in with_search.to_json()["noise"]
