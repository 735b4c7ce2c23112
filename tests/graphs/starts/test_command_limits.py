# SPDX-License-Identifier: BSD-3-Clause
"""Drives that saturate: the level is found, and nothing is said of drives that give what is commanded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, divided, moved, written

from jointscope.graphs.starts.command_limits import command_limits, limited
from jointscope.graphs.starts.drive_regression import Driven, drive_equations
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream

ARM = Arm()
SIGMAS = np.full(3, 1e-5)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return RigidTree(written(ARM, tmp_path_factory.mktemp("arm")), ARM.joints, np.array(ARM.gravity))


@pytest.mark.parametrize("share", [0.5, 0.75, 0.92], ids=["often", "at times", "few samples"])
def test_the_level_at_which_every_drive_saturates_is_found(tree, share):
    most = tuple(share * np.abs(moved(ARM, seed=2)[1].values).max(axis=0))
    encoder, command = moved(ARM, most=most, seed=2)
    found = command_limits(tree, [Driven(encoder, command)], SIGMAS)
    for limit, level, column in zip(found, most, command.values.T, strict=True):
        assert limit.level == pytest.approx(level, rel=2e-3) and limit.lost == pytest.approx(1.0, abs=0.02)
        assert limit.share == pytest.approx(np.mean(np.abs(column) > level), abs=2e-3)
    values = [e.solve() for e in drive_equations(tree, [Driven(encoder, limited(command, found))], SIGMAS)]
    for j, solved in enumerate(values):
        for law, true in ARM.truth(j).items():
            assert solved[law].value == pytest.approx(true, rel=0.01), (j, law)


def test_one_drive_that_saturates_is_told_from_those_that_do_not(tree):
    most = (np.inf, 0.6 * np.abs(moved(ARM)[1].values[:, 1]).max(), np.inf)
    constants = (4.0, 2.0, 0.5)
    encoder, command = moved(ARM, most=most)
    first, second, third = command_limits(tree, [Driven(encoder, divided(command, constants))], SIGMAS)
    assert first is None and third is None
    assert second.level == pytest.approx(most[1] / constants[1], rel=2e-3)


@pytest.mark.parametrize(
    "arm, how",
    [
        (ARM, {}),
        (replace(ARM, inertia=(9.0, 4.0, 1.0)), {}),
        (ARM, {"counts": 2048}),
        (ARM, {"sticks": True}),
        (ARM, {"push": (2.0, 3.0, 1, 15.0)}),
        (ARM, {"pause": 0.5}),
        (ARM, {"cable": 8.0}),
        (ARM, {"encoder_rate": 50.0, "command_rate": 200.0}),
    ],
    ids=["plain", "heavy rotors", "coarse", "sticks", "pushed", "pauses", "cables", "slow encoders"],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_said_of_drives_that_give_what_is_commanded(tree, arm, how, seed):
    encoder, command = moved(arm, seed=seed, **how)
    sigmas = SIGMAS if "counts" not in how else np.full(3, 2.0 * np.pi / 2048 / np.sqrt(12.0))
    assert command_limits(tree, [Driven(encoder, command)], sigmas) == [None] * 3
    assert limited(command, [None] * 3) is command


SOFT = """<robot name="drive"><link name="base"/><link name="arm_link"><inertial><mass value="0.07"/>
<inertia ixx="1e-5" iyy="2.6e-3" izz="2.6e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="arm" type="revolute"><parent link="base"/><child link="arm_link"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="5" velocity="50"/></joint></robot>"""


@pytest.mark.parametrize("seed", range(4))
def test_a_drive_that_always_pushes_the_way_it_moves_is_not_taken_for_one_that_saturates(tmp_path, seed):
    # steps, losses far above the inertia, a soft spring: at a low limit the command is the sign of the velocity, a
    # friction, while no rigid arm explains the whole of it
    rng, h, hold, rate = np.random.default_rng(seed), 1e-4, 2000, 20
    command = np.repeat(rng.uniform(-0.35, 0.35, 25), hold)
    q, v = np.zeros(2), np.zeros(2)
    positions = np.empty(len(command))
    for i, torque in enumerate(command):
        positions[i] = q[0]
        spring = 1.3 * (q[0] - q[1]) + 0.004 * (v[0] - v[1])
        friction = 0.07 * v[0] + 0.03 * np.tanh(200.0 * v[0])
        v += h * np.array([(torque - friction - spring) / 2e-3, spring / 2.6e-3])
        q += h * v
    path = tmp_path / "drive.urdf"
    path.write_text(SOFT, encoding="utf-8")
    tree, times = RigidTree(path, ("arm",), np.array([0.0, 0.0, -9.81])), h * rate * np.arange(len(command) // rate)
    noisy = positions[::rate] + 4e-4 * rng.standard_normal(len(times))
    streams = [Stream("", times, values[:, None], ("arm",), "") for values in (noisy, command[::rate])]
    assert command_limits(tree, [Driven(*streams)], np.array([4e-4])) == [None]
