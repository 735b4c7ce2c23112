# SPDX-License-Identifier: BSD-3-Clause
"""Springs are seen where two encoders say other positions; what encoders and stamps do is no spring."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointscope.graphs.starts.drive_regression import Links
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.drive_values import find_drives
from jointscope.tools.init.estimates.soft_joints import soft_joints

TIMES = np.arange(0.0, 8.0, 4e-3)
NOISE = 1e-4


def motion(t):
    return 0.6 * np.sin(2.0 * t) + 0.2 * np.sin(9.0 * t + 1.0)


def acceleration(t):
    return -2.4 * np.sin(2.0 * t) - 16.2 * np.sin(9.0 * t + 1.0)


def deflection(t):
    """An inertia of 0.02 kg m2 behind a spring of 100 N m/rad."""
    return 2e-4 * acceleration(t)


@pytest.mark.parametrize(
    ("motor", "soft"),
    [
        (lambda t, rng: motion(t), False),
        (lambda t, rng: motion(t) + deflection(t), True),
        (lambda t, rng: 1.01 * motion(t) + 0.3, False),
        (lambda t, rng: motion(t - 3e-3), False),
        (lambda t, rng: motion(t + 1e-3 * rng.standard_normal(len(t))), False),
    ],
    ids=["rigid", "soft", "another scale and zero", "late", "stamps that jitter"],
)
def test_only_deflections_are_soft(motor, soft):
    rng = np.random.default_rng(0)
    values = [motor(TIMES, rng), motion(TIMES)]
    noisy = [(v + NOISE * rng.standard_normal(len(TIMES)))[:, None] for v in values]
    streams = [Stream(name, TIMES, v, ("j",), "rad") for name, v in zip(("motor", "links"), noisy, strict=True)]
    assert soft_joints(*streams, np.array([1.4 * NOISE])).tolist() == [soft]


def test_streams_of_other_times_tell_nothing():
    one, other = (
        Stream(n, TIMES + d, motion(TIMES)[:, None], ("j",), "rad") for n, d in (("motor", 0.0), ("links", 99.0))
    )
    assert soft_joints(one, other, np.array([NOISE])).tolist() == [False]


K, D, LINK, ROTOR, CONSTANT, VISCOUS, DRY = 1.3, 0.004, 0.0026, 0.002, 0.13, 0.07, 0.03
CUBIC = 60.0  # [N m/rad^3]
URDF = f"""<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="0.01"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="{LINK}"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"""


def driven(cubic):
    """Motor and link on a spring, by a general solver: streams of both encoders and of the command."""
    rng = np.random.default_rng(3)
    times = np.arange(0.0, 6.0, 2e-3)
    volts = np.repeat(rng.uniform(-3.0, 3.0, 60), 50)

    def rates(t, x):
        q_motor, v_motor, q_link, v_link = x
        torque = K * (q_motor - q_link) + cubic * (q_motor - q_link) ** 3 + D * (v_motor - v_link)
        motor = CONSTANT * volts[min(int(t / 2e-3 + 1e-6), len(volts) - 1)] - VISCOUS * v_motor - torque
        return v_motor, (motor - DRY * np.tanh(500.0 * v_motor)) / ROTOR, v_link, torque / LINK

    x = solve_ivp(rates, (0.0, times[-1]), np.zeros(4), "LSODA", times, rtol=1e-7, atol=1e-9, max_step=2e-3).y
    seen = [q + 3e-4 * rng.standard_normal(len(times)) for q in (x[0], x[2])]
    return [Stream(name, times, v[:, None], ("turn",), "rad") for name, v in zip("mlu", (*seen, volts), strict=True)]


@pytest.mark.parametrize("cubic", [0.0, CUBIC])
def test_a_drive_is_told_through_any_spring_where_an_encoder_sees_the_link(cubic, tmp_path):
    (tmp_path / "one.urdf").write_text(URDF)
    tree, noise = RigidTree(tmp_path / "one.urdf", ("turn",), np.zeros(3)), np.array([3e-4])
    motor, links, command = driven(cubic)
    drives = find_drives(tree, motor, command, noise, elastic=("turn",), unit="V", links=Links(links, noise))
    (drive,) = drives.joints
    assert drive.explained > 0.995
    found = {name: value.value for name, value in drive.found.items()}
    truth = {"gain": CONSTANT, "inertia": ROTOR, "viscous": VISCOUS, "dry": DRY}
    assert found == pytest.approx(truth, rel=0.05)
    assert {name: drive.start[name] for name in truth} == pytest.approx(found)
    if cubic:
        assert K < drive.spring.stiffness < 2.0 * K
    else:
        assert drive.spring == pytest.approx((K, D), rel=0.05, abs=2e-3)


def test_without_an_encoder_on_the_link_the_same_drive_is_guessed_and_has_no_spring(tmp_path):
    (tmp_path / "one.urdf").write_text(URDF)
    tree, noise = RigidTree(tmp_path / "one.urdf", ("turn",), np.zeros(3)), np.array([3e-4])
    motor, _, command = driven(0.0)
    (drive,) = find_drives(tree, motor, command, noise, elastic=("turn",), unit="V").joints
    assert drive.spring is None and not drive.own_links
