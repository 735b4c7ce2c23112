# SPDX-License-Identifier: BSD-3-Clause
"""Calibrated URDFs, read again by programs that know nothing of jointscope."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from tilted_arm import FRICTION, ROTORS, arm_with

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.export.urdf_model import urdf_model


def model_of(text: str) -> pin.Model:
    return pin.buildModelFromXML(text)


def dynamics_of(text: str) -> dict[str, tuple[float, float]]:
    joints = ET.fromstring(text).iter("joint")
    found = {joint.get("name"): joint.find("dynamics") for joint in joints}
    return {n: (float(d.get("damping")), float(d.get("friction"))) for n, d in found.items() if d is not None}


def test_friction_of_rigid_joints_is_in_dynamics_and_rotors_are_said(tmp_path):
    robot = add_effects(arm_with(tmp_path), ["motor_viscous@*", "link_viscous@elbow", "link_coulomb@elbow"]).robot
    robot = robot.with_values(
        {
            "shoulder.motor_viscous.coefficient": 1.5,
            "elbow.motor_viscous.coefficient": 0.5,
            "elbow.link_viscous.coefficient": 0.25,
            "elbow.link_coulomb.torque": 0.2,
        }
    )
    exported = urdf_model(robot)
    found = dynamics_of(exported.text)
    assert found["shoulder"] == pytest.approx((1.5, FRICTION))
    assert found["elbow"] == pytest.approx((0.75, FRICTION + 0.2))
    (armature,) = (reason for name, reason in exported.lacks.items() if name == "rotor inertias")
    assert all(f"{joint} {inertia:g} kg m2" in armature for joint, inertia in ROTORS.items())


@pytest.mark.parametrize("seed", range(3))
def test_a_changed_inertia_moves_as_the_calibrated_model_does(seed, tmp_path):
    robot = add_effects(arm_with(tmp_path), ["inertia_error@elbow", "payload@elbow"]).robot
    values = {"elbow.inertia_error.ixx": 0.01, "elbow.inertia_error.izz": 0.02, "elbow.payload.inertia": 0.03}
    robot = robot.with_values({**values, **{f"{joint}.coulomb_torque": 1e-12 for joint in robot.joints}})
    exported = model_of(urdf_model(robot).text)
    exported.armature = np.array(list(ROTORS.values()))
    rng, equations = np.random.default_rng(seed), ElasticJoints(robot)
    q, v, tau = rng.uniform(-1.0, 1.0, (3, 2))
    parameters = np.array([robot.parameter(name).value for name in equations.names])
    expected = equations.accelerations(np.concatenate([q, v])[None], tau[None], parameters)[0]
    np.testing.assert_allclose(pin.aba(exported, exported.createData(), q, v, tau), expected, rtol=1e-7, atol=1e-7)


def test_an_elastic_joint_becomes_two_that_carry_the_same_links(tmp_path):
    robot = arm_with(tmp_path, rigid=("shoulder",))
    exported = urdf_model(robot)
    model, plain = model_of(exported.text), robot.tree.model
    assert list(model.names)[1:] == ["shoulder", "elbow", "elbow_spring"]
    assert dynamics_of(exported.text)["elbow_spring"] == (1.0, 0.0)
    stiffness = ET.fromstring(exported.text).find("gazebo[@reference='elbow_spring']/springStiffness")
    assert float(stiffness.text) == 900.0
    cos_sin = pin.integrate(model, pin.neutral(model), np.array([0.3, -0.5, 0.2]))
    tip = pin.SE3(plain.frames[plain.getFrameId("fore")].placement)
    data, expected = model.createData(), plain.createData()
    pin.framesForwardKinematics(model, data, cos_sin)
    pin.framesForwardKinematics(plain, expected, np.array([0.3, -0.3]))  # the spring adds to the motor
    place, frame = data.oMf[model.getFrameId("fore")], expected.oMf[plain.getFrameId("fore")]
    np.testing.assert_allclose(place.homogeneous, frame.homogeneous, atol=1e-12)
    assert tip == plain.frames[plain.getFrameId("fore")].placement
    # rotor about its axis, nothing of it in the link's mass
    assert model.inertias[2].inertia.trace() == pytest.approx(2.0 * ROTORS["elbow"])
    axis = np.array([0.6, 0.0, -0.8])
    assert axis @ model.inertias[2].inertia @ axis == pytest.approx(ROTORS["elbow"])
    assert "armature" in exported.lacks["inertia of elastic drives"]


def test_a_found_spring_and_its_joint_are_written_like_one_of_the_file(tmp_path):
    robot = add_effects(arm_with(tmp_path), ["joint_elasticity@elbow"]).robot
    robot = robot.with_values({"elbow.joint_elasticity.compliance": 1 / 900.0, "elbow.joint_elasticity.damping": 1.0})
    of_file = urdf_model(arm_with(tmp_path, rigid=("shoulder",)))
    assert urdf_model(robot).text == of_file.text


def test_comments_meshes_and_undeclared_prefixes_survive(tmp_path):
    robot = arm_with(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    kept = (
        '<!-- as measured --><xacro:left x="1"/>'
        '<link name="cover"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>'
    )
    (tmp_path / "arm.urdf").write_text(text.replace('<link name="base"/>', f'<link name="base"/>{kept}', 1))
    exported = urdf_model(robot).text
    assert "<!-- as measured -->" in exported
    assert '<xacro:left x="1" />' in exported
    assert '<mesh filename="a.stl" />' in exported


def test_a_file_that_only_this_program_reads_stays_so_and_that_is_said(tmp_path):
    """pinocchio wants limits, which makers leave out."""
    arm_with(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    (tmp_path / "arm.urdf").write_text(text.replace('<limit effort="40" velocity="4" lower="-2" upper="2"/>', ""))
    exported = urdf_model(load_robot(tmp_path / "arm.yaml"))
    (warning,) = exported.warnings
    assert "pinocchio refuses the file, as it refuses the original" in warning
    assert "elbow" in warning
    with pytest.raises(ValueError, match="valid URDF"):
        model_of(exported.text)


def test_geometry_of_poses_is_in_it_and_sag_is_named(tmp_path):
    robot = load_robot("tx90l").with_values({"joint2.ly": 0.001})
    exported = urdf_model(robot)
    before, after = model_of(robot.tree.urdf.read_text()), model_of(exported.text)
    shift = after.jointPlacements[2].translation - before.jointPlacements[2].translation
    np.testing.assert_allclose(shift, [0.0, 0.001, 0.0], atol=1e-8)
    assert any("joint2.stiffness" in name for name in exported.lacks)


def test_a_robot_whose_masses_are_not_known_is_refused():
    told = r"^kr300 has link_dynamics: free, so its masses are not known, .* is in kr300\.yaml$"
    with pytest.raises(RobotError, match=told):
        urdf_model(load_robot("kr300"))


def with_inertia(folder, link: str, moments: dict[str, float]) -> None:
    """Writes other moments of inertia into the maker's file."""
    root = ET.parse(folder / "arm.urdf").getroot()
    root.find(f"link[@name='{link}']/inertial/inertia").attrib.update({n: str(x) for n, x in moments.items()})
    ET.ElementTree(root).write(folder / "arm.urdf")


def test_a_sound_file_has_no_warnings(tmp_path):
    assert urdf_model(arm_with(tmp_path)).warnings == ()
    assert urdf_model(arm_with(tmp_path, rigid=("shoulder",))).warnings == ()  # the rotor is a disc: A + B = C


@pytest.mark.parametrize(
    "moments",
    [{"ixx": 0.01, "iyy": 0.01, "izz": 0.03}, {"ixx": 0.01, "iyy": 0.01, "izz": 0.01, "ixy": 0.02}],
    ids=["triangle inequality", "negative principal moment"],
)
def test_an_impossible_inertia_of_the_maker_is_kept_and_said(moments, tmp_path):
    arm_with(tmp_path)
    with_inertia(tmp_path, "fore", {**dict.fromkeys(("ixy", "ixz", "iyz"), 0.0), **moments})
    exported = urdf_model(load_robot(tmp_path / "arm.yaml"))
    (warning,) = exported.warnings
    assert "inertia of fore" in warning
    assert "kept as the original has it" in warning
    mujoco = pytest.importorskip("mujoco", reason="reads the URDF as users of MuJoCo do")
    with pytest.raises(ValueError, match="inertia must"):
        mujoco.MjModel.from_xml_string(exported.text)


def test_an_impossible_inertia_that_was_calibrated_is_said_as_such(tmp_path):
    robot = add_effects(arm_with(tmp_path), ["inertia_error@elbow"]).robot
    (warning,) = urdf_model(robot.with_values({"elbow.inertia_error.izz": 9.0})).warnings
    assert "calibrated for fore" in warning


def test_a_urdf_that_pinocchio_refuses_is_an_error(tmp_path, monkeypatch):
    from jointscope.tools.export import urdf_model as module

    monkeypatch.setattr(module, "_unlimited", lambda element: "nonsense")
    with pytest.raises(RobotError, match="pinocchio refuses the URDF that would be made"):
        urdf_model(arm_with(tmp_path, rigid=("shoulder",)))
