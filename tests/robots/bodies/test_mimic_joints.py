# SPDX-License-Identifier: BSD-3-Clause
"""Bodies of which some follow others, against an engine that knows nothing of that, and against differences."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import MIMICKING

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.urdf_bodies import UrdfBodies
from jointscope.robots.urdf.usable_joints import moving_joints

JOINTS, ORDER = ("joint1", "joint2", "joint3"), ("joint3", "joint1", "joint2")
GRAVITY = np.array([1.0, -2.0, -9.0])
EAR = 0.7
# joints of the file by hand: position = factors (joint1, joint2, joint3) + offset; knee = 0.5 tail + 0.1
ALL = {
    "joint1": ((1.0, 0.0, 0.0), 0.0),
    "joint2": ((0.0, 1.0, 0.0), 0.0),
    "joint3": ((0.0, 0.0, 1.0), 0.0),
    "tail": ((0.0, 0.0, -0.7), 0.3),
    "knee": ((0.0, 0.0, -0.35), 0.25),
    "reach": ((0.05, 0.0, 0.0), 0.0),
    "ear": ((0.0, 0.0, 0.0), EAR),
    "wave": ((0.0, 0.0, 0.0), 0.0),
}


@pytest.fixture(params=[JOINTS, ORDER], ids=["in order", "in another order"])
def tree(request):
    return RigidTree(MIMICKING, request.param, GRAVITY, locked={"ear": EAR})


def samples(count, seed=0):
    return np.random.default_rng(seed).normal(size=(3, count, 3))


class Engine:
    """MuJoCo's model of all joints of the file as free ones."""

    def __init__(self):
        mujoco = pytest.importorskip("mujoco", reason="the engine comes with the extra `sim`")
        self._mujoco, self.model = mujoco, mujoco.MjModel.from_xml_string(_without_mimics(MIMICKING.read_text()))
        self.model.opt.gravity = GRAVITY
        self.data = mujoco.MjData(self.model)
        names = [self.model.joint(i).name for i in range(self.model.njnt)]
        self.G = np.array([ALL[name][0] for name in names])
        self.offset = np.array([ALL[name][1] for name in names])

    def at(self, q, v):
        """M and c + g of joint1, joint2, joint3."""
        self.data.qpos, self.data.qvel = self.G @ q + self.offset, self.G @ v
        self._mujoco.mj_forward(self.model, self.data)
        M = np.zeros((self.model.nv, self.model.nv))
        self._mujoco.mj_fullM(self.model, self.data, M)
        return self.G.T @ M @ self.G, self.G.T @ self.data.qfrc_bias


def _without_mimics(urdf):
    return "".join(line for line in urdf.splitlines(keepends=True) if "<mimic" not in line)


def test_mass_matrix_and_torques_are_those_of_an_engine_projected_on_the_joints(tree):
    engine, (q, v, a) = Engine(), samples(8)
    own = [tree.joints.index(joint) for joint in JOINTS]
    M, tau = tree.mass_matrix(q[:, np.argsort(own)]), tree.torque(*(part[:, np.argsort(own)] for part in (q, v, a)))
    for k in range(len(q)):
        expected, bias = engine.at(q[k], v[k])
        np.testing.assert_allclose(M[k][np.ix_(own, own)], expected, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(tau[k][own], expected @ a[k] + bias, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("coriolis", [True, False])
def test_accelerations_answer_the_torques_and_have_the_slopes_of_differences(coriolis):
    tree = RigidTree(MIMICKING, ORDER, GRAVITY, coriolis, locked={"ear": EAR})
    q, v, tau = samples(5, seed=1)
    a, *slopes = tree.acceleration_derivatives(q, v, tau)
    np.testing.assert_allclose(tree.torque(q, v if coriolis else 0 * v, a), tau, atol=1e-10)
    np.testing.assert_allclose(tree.acceleration(q, v, tau), a, atol=1e-11)
    np.testing.assert_allclose(tree.acceleration(q[:1], v[:1], tau[:1]), a[:1], atol=1e-11)
    for i, step in enumerate(1e-6 * np.eye(3)):
        moved = ((step, 0, 0), (0, step, 0), (0, 0, step))
        for slope, (dq, dv, dtau) in zip(slopes, moved, strict=True):
            ahead, behind = (tree.acceleration(q + s * dq, v + s * dv, tau + s * dtau) for s in (1, -1))
            np.testing.assert_allclose(slope[:, :, i], (ahead - behind) / 2e-6, rtol=1e-6, atol=1e-6)
        weight = tree.torque(q + step, 0 * q, 0 * q) - tree.torque(q - step, 0 * q, 0 * q)
        np.testing.assert_allclose(tree.gravity_derivatives(q)[:, :, i], weight / 2e-6, atol=1e-7)


@pytest.mark.parametrize("body", ["link1", "tail", "tip", "shin", "link3", "ear"])
def test_body_rates_are_the_change_of_the_poses(tree, body):
    q, v, _ = samples(6, seed=2)
    omega, by_q, by_v = tree.body_rate(body, q, v)
    R = tree.body_poses(body, q)[0]
    change = (tree.body_poses(body, q + 1e-6 * v)[0] - tree.body_poses(body, q - 1e-6 * v)[0]) / 2e-6
    spin = R.transpose(0, 2, 1) @ change
    np.testing.assert_allclose(omega, np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]]), atol=1e-8)
    for i, step in enumerate(1e-6 * np.eye(3)):
        slope = (tree.body_rate(body, q + step, v)[0] - tree.body_rate(body, q - step, v)[0]) / 2e-6
        np.testing.assert_allclose(by_q[:, :, i], slope, atol=1e-8)
        np.testing.assert_allclose(by_v[:, :, i], tree.body_rate(body, q, 0 * v + np.eye(3)[i])[0], atol=1e-12)


def test_where_bodies_are_is_what_an_engine_says(tree):
    engine = Engine()
    q = samples(1, seed=3)[0]
    engine.at(q[0], np.zeros(3))
    own = [JOINTS.index(joint) for joint in tree.joints]
    for body in ("tip", "ear", "link3"):
        R, p = tree.body_poses(body, q[:, own])
        np.testing.assert_allclose(p[0], engine.data.body(body).xpos, atol=1e-12)
        np.testing.assert_allclose(R[0], engine.data.body(body).xmat.reshape(3, 3), atol=1e-12)


def test_a_joint_is_limited_by_what_follows_it_too():
    tree = RigidTree(MIMICKING, JOINTS, GRAVITY)
    # tail from -1.0 to 0.9 is joint3 from (0.9 - 0.3) / -0.7 to (-1.0 - 0.3) / -0.7; reach allows 20 rad of joint1
    np.testing.assert_allclose(tree.limits, [[-20.0, 20.0], [-1.5708, 1.5708], [-0.6 / 0.7, 1.5708]], atol=1e-12)
    np.testing.assert_allclose(tree.velocity_limits, [12.0, 12.0, 3.0 / 0.7])
    np.testing.assert_allclose(RigidTree(MIMICKING, ORDER, GRAVITY).effort_limits, [150.0, 200.0, 200.0])


def test_the_joints_on_the_way_to_a_link_are_those_that_move_it(tree):
    names = {body: {tree.joints[i] for i in tree.joints_below(body)} for body in ("link1", "tip", "shin", "link3")}
    assert names == {
        "link1": {"joint1"},
        "tip": {"joint1", "joint3"},
        "shin": {"joint1", "joint2", "joint3"},
        "link3": set(JOINTS),
    }


def test_a_follower_of_a_joint_that_is_locked_is_locked_with_it():
    tree = RigidTree(MIMICKING, ("joint2",), GRAVITY, locked={"joint3": -0.5})
    engine, q = Engine(), np.array([0.4])
    expected, bias = engine.at(np.array([0.0, q[0], -0.5]), np.zeros(3))
    # the ear is at zero here
    ear = [engine.model.joint(i).name for i in range(engine.model.njnt)].index("ear")
    engine.offset[ear] = 0.0
    expected, bias = engine.at(np.array([0.0, q[0], -0.5]), np.zeros(3))
    np.testing.assert_allclose(tree.mass_matrix(q[None])[0], expected[1:2, 1:2], rtol=1e-10)
    np.testing.assert_allclose(tree.torque(q[None], 0 * q[None], 0 * q[None])[0], bias[1:2], rtol=1e-9)


def test_mimic_joints_are_no_joints_of_a_robot_and_continuous_ones_are():
    assert moving_joints(MIMICKING) == ("joint1", "joint2", "joint3", "ear", "wave")


def test_only_joints_that_carry_or_are_carried_matter():
    bodies = UrdfBodies.read(MIMICKING)
    assert bodies.that_matter(JOINTS) == ("ear",)
    assert bodies.that_matter(("ear",)) == JOINTS
    assert bodies.that_matter(("wave",)) == ()
    # joint3 moves the tail, which stands on link1
    assert bodies.that_matter(("joint1",)) == ("joint2", "joint3", "ear")
    assert RigidTree(MIMICKING, JOINTS, GRAVITY).other_joints == ("ear",)


def test_a_posture_may_be_told_by_what_follows():
    tree = RigidTree(MIMICKING, ("joint2",), GRAVITY)
    assert tree.posture({"knee": 0.6, "wave": 1.0, "unknown": 2.0, "joint2": 0.3}) == {"joint3": pytest.approx(-1.0)}
    assert tree.posture({"knee": 0.6, "joint3": 0.2}) == {"joint3": 0.2}


@pytest.mark.parametrize(
    ("joints", "locked", "told"),
    [
        (("joint1", "tail"), {}, "mimicking_doggy.urdf: tail is a mimic joint: it follows joint3 (-0.7 times its "
         "position) and is modelled with it; leave tail out of the joints, name joint3"),
        (("joint3", "knee"), {}, "mimicking_doggy.urdf: knee is a mimic joint: it follows joint3 (-0.35 times its "
         "position) and is modelled with it; leave knee out of the joints"),
        (("joint1",), {"joint1": 0.0}, "locked: joint1 is one of the robot's joints, which move; remove it from one of "
         "the two"),
        (("joint1",), {"tail": 0.0}, "locked: tail is a mimic joint of mimicking_doggy.urdf and follows joint3: lock "
         "joint3 instead"),
        (("joint3",), {"tail": 0.0}, "locked: tail is a mimic joint of mimicking_doggy.urdf and follows joint3: which "
         "is one of the robot's joints; remove tail"),
        (("joint1",), {"nose": 0.0}, "locked: mimicking_doggy.urdf has no joint 'nose' that can be locked; it has "
         "joint2, joint3, ear, wave"),
        (("joint1",), {"ear": np.nan}, "locked: position nan of ear; expected a finite number [rad] or [m]"),
    ],
)  # fmt: skip
def test_joints_that_cannot_be_are_refused_with_what_to_write(joints, locked, told):
    with pytest.raises(RobotError) as error:
        RigidTree(MIMICKING, joints, GRAVITY, locked=locked)
    assert str(error.value) == told


def test_a_ring_of_mimic_joints_is_named(tmp_path):
    (tmp_path / "d.urdf").write_text(MIMICKING.read_text().replace('joint="joint3" mult', 'joint="knee" mult'))
    with pytest.raises(RobotError) as error:
        moving_joints(tmp_path / "d.urdf")
    assert str(error.value) == (
        "d.urdf: joint knee mimics tail, which follows knee itself; remove one <mimic> of the ring"
    )


def test_what_follows_a_joint_that_is_not_there_is_a_joint_of_its_own(tmp_path):
    (tmp_path / "d.urdf").write_text(MIMICKING.read_text().replace('joint="joint3" mult', 'joint="joint9" mult'))
    assert moving_joints(tmp_path / "d.urdf") == ("joint1", "joint2", "joint3", "ear", "tail", "wave")
