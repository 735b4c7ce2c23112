# SPDX-License-Identifier: BSD-3-Clause
"""The free torque is the one that was hidden, in its own equation, within its sigma."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.discovery.missing_torque import estimate_missing_torque
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.lasting_torques import lasting_torques

RIGHT_ROW = 4  # "joint2.motor"
SETTLED = 0.2  # [s]


def truth_of(doggy, simulation):
    """The base model with true values, and the noise that the recording makes it need."""
    values = {k: v for k, v in simulation.truth["parameters"].items() if k in doggy.parameters}
    true = doggy.with_values(values)
    known = simulation.truth["parameters"]
    gyros = {
        g.name: replace(g, bias=np.array(known[f"{g.name}.bias"]), R_imu_body=np.array(known[f"{g.name}.R_imu_body"]))
        for g in true.gyros
    }
    true = true.with_sensors(gyros)
    found = calibrate(true, [simulation.recording], biases_only=True)
    return replace(true, noise=found.noise), found.bags[0]


@pytest.fixture(scope="module", params=["motor_viscous@joint2", "cogging@joint2"])
def hidden(request, doggy):
    """Missing torque of a recording with one effect that the model lacks, beside its true curve."""
    pytest.importorskip("mujoco")
    from jointscope.tools.simulator import simulate

    label = request.param
    simulation = simulate(doggy, "moves", 3.5, seed=7, friction="smooth", effects=[label])
    robot, bag = truth_of(doggy, simulation)
    right = add_effect(robot, label)
    known = simulation.truth["parameters"]
    right = right.with_values({name: known[name] for name in right.parameters if name in known})
    found = estimate_missing_torque(robot, simulation.recording, bag.states, None, bag.calibration, {label: right})
    return found, found.explained_by[label], found.times > found.times[0] + SETTLED


@pytest.mark.slow
def test_the_hidden_torque_is_found_in_its_own_equation(hidden):
    found, true, late = hidden
    assert found.rows[RIGHT_ROW] == "joint2.motor"
    assert np.corrcoef(found.torque[late, RIGHT_ROW], true[late, RIGHT_ROW])[0, 1] > 0.9
    size = np.sqrt(np.mean(found.torque[late] ** 2, axis=0))
    assert np.all(np.delete(size, RIGHT_ROW) < 0.05 * size[RIGHT_ROW])


@pytest.mark.slow
def test_its_sigma_covers_the_distance_to_the_truth(hidden):
    found, true, late = hidden
    in_sigmas = (found.torque - true)[late, RIGHT_ROW] / found.sigma[late, RIGHT_ROW]
    assert 0.2 < np.sqrt(np.mean(in_sigmas**2)) < 1.5


@pytest.mark.slow
def test_nothing_is_missing_from_a_clean_recording(doggy):
    pytest.importorskip("mujoco")
    from jointscope.tools.simulator import simulate

    simulation = simulate(doggy, "moves", 3.0, seed=8, friction="smooth")
    robot, bag = truth_of(doggy, simulation)
    found = estimate_missing_torque(robot, simulation.recording, bag.states, None, bag.calibration)
    late = found.times > found.times[0] + SETTLED
    assert np.all(np.abs(found.torque[late]) < 3.0 * found.sigma[late])
    assert np.max(found.sigma[late]) < 0.05
    deflection = simulation.states[:, 0] - simulation.states[:, 6]
    stiffness = robot.parameter("joint1.stiffness").value
    assert np.std(found.tau_spring[:, 0]) == pytest.approx(stiffness * np.std(deflection), rel=0.1)


def test_a_rigid_joint_has_one_torque_that_lasts(doggy):
    rigid = replace(doggy, choices=replace(doggy.choices, rigid_joints=("joint2",)))
    noise = replace(rigid.noise, motor_velocity=rigid.noise.motor_velocity[:2])
    free = replace(rigid, noise=noise.with_lasting(0.01, np.ones(5)))
    names = ("joint1.link", "joint2.link", "joint3.link", "joint1.motor", "joint3.motor")
    assert tuple(lasting_torques(free)) == names
    assert free.noise.white.memory.shape == (0,)
    assert free.layout.memories == tuple(f"{name}_torque" for name in names)
    assert free.layout.memory == slice(10, 15)
