# SPDX-License-Identifier: BSD-3-Clause
"""The pieces of the benchmark of arms: its simulation is right, and its judge lets nothing pass that is wrong."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.metadata import PackageNotFoundError

import numpy as np
import pinocchio as pin
import pytest

pytest.importorskip("mujoco", reason="arms are simulated with its mass matrix")

import arm_verbs
from arm_bodies import ArmBodies
from arm_cases import ArmCase, cases, urdf_file
from arm_drives import Drives, loads, make_drives
from arm_motion import make_motion
from arm_recording import excited
from arm_row import ADVISED, BROKEN, MISLED, RIGHT, STUCK, WRONG, judge
from arm_simulation import simulate
from arm_table import section
from arm_urdf import read_urdf
from arm_verbs import JSON, ROBOT, Session, Typed, first_contact

# a turn, a slide that carries a finger and its mimic, a held joint with an inertia that no body can have
URDF = """<robot name="odd">
  <link name="base"><inertial><mass value="5"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="a"><inertial><origin xyz="0.1 0.02 -0.2" rpy="0.3 0.2 -0.5"/><mass value="2"/>
    <inertia ixx="0.04" iyy="0.03" izz="0.02" ixy="0.001" ixz="-0.002" iyz="0.003"/></inertial></link>
  <link name="b"><inertial><origin xyz="0 0.1 0.05"/><mass value="1.5"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="c"><inertial><origin xyz="0.1 0 0"/><mass value="0.7"/>
    <inertia ixx="0.002" iyy="0.003" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="d"><inertial><origin xyz="0 0 0.1"/><mass value="0.4"/>
    <inertia ixx="0.002" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><inertial><mass value="0.2"/>
    <inertia ixx="0.0002" iyy="0.0001" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="a"/><origin xyz="0 0 0.3" rpy="0.4 -0.7 0.2"/>
    <axis xyz="0 0.6 0.8"/></joint>
  <joint name="held" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 -0.4" rpy="0 0.5 1"/>
    <axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="9" velocity="2"/></joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.1 0.2 0" rpy="0 0 0.3"/>
    <axis xyz="0 0 1"/><limit lower="-0.3" upper="0.3" effort="9" velocity="1"/></joint>
  <joint name="finger" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.1 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="3"/></joint>
  <joint name="follows" type="revolute"><parent link="d"/><child link="tip"/><origin xyz="0 0 0.2"/>
    <axis xyz="1 0 0"/><limit lower="-3" upper="3" effort="9" velocity="3"/>
    <mimic joint="finger" multiplier="-1.5" offset="0.2"/></joint>
  <transmission name="t"><joint name="turn"><hardwareInterface>Effort</hardwareInterface></joint></transmission>
</robot>
"""
JOINTS = ("turn", "slide", "finger")
POSTURE = {"held": 0.8}


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    path = tmp_path_factory.mktemp("urdf") / "odd.urdf"
    path.write_text(URDF, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def by_pinocchio(odd):
    """Mass matrix and bias by the other library, with all joints of the file."""
    model = pin.buildModelFromUrdf(str(odd), mimic=True)
    data = model.createData()

    def evaluate(q, v):
        full, rates = pin.neutral(model), np.zeros(model.nv)
        places = [model.joints[model.getJointId(name)] for name in JOINTS]
        for joint, angle, rate in zip(places, q, v, strict=True):
            turns = joint.nq == 2  # continuous joints are written as cosine and sine
            full[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(angle), np.sin(angle)] if turns else angle
            rates[joint.idx_v] = rate
        full[model.joints[model.getJointId("held")].idx_q] = POSTURE["held"]
        rows = [joint.idx_v for joint in places]
        M = np.triu(pin.crba(model, data, full))
        M = M + np.triu(M, 1).T
        return M[np.ix_(rows, rows)], pin.rnea(model, data, full, rates, np.zeros(model.nv))[rows]

    return evaluate


def test_mass_matrix_and_bias_are_those_of_the_whole_robot_with_the_held_joint_at_its_posture(odd, by_pinocchio):
    bodies = ArmBodies(read_urdf(odd), JOINTS, POSTURE)
    rng = np.random.default_rng(1)
    for _ in range(5):
        q, v = rng.uniform(-1, 1, 3), rng.normal(size=3)
        for own, other in zip(bodies.mass_and_bias(q, v), by_pinocchio(q, v), strict=True):
            np.testing.assert_allclose(own, other, rtol=1e-9, atol=1e-9)


def test_a_simulated_arm_takes_the_torque_that_its_drives_had(odd, by_pinocchio):
    urdf = read_urdf(odd)
    bodies = ArmBodies(urdf, JOINTS, POSTURE)
    rng = np.random.default_rng(2)
    motion = make_motion([urdf.joints[name] for name in JOINTS], np.array([0.3, 0.0, 0.1]), rng)
    drives = Drives(np.array([0.2, 0.5, 0.05]), np.array([0.4, 0.3, 0.05]), np.array([0.5, 2.0, 0.04]), np.full(3, 2.0))
    h = 1e-3
    times = np.arange(h, 0.6, h)
    run = simulate(bodies, drives, motion, times[::10] - h / 2, times)
    q = run.positions
    v, a = (q[2:] - q[:-2]) / (2 * h), (q[2:] - 2 * q[1:-1] + q[:-2]) / h**2
    lacking = []
    for k in range(20, len(v)):
        tau = drives.k * run.commands[np.searchsorted(run.command_times, times[k + 1]) - 1]
        if times[k + 1] - run.command_times[np.searchsorted(run.command_times, times[k + 1]) - 1] < 2 * h:
            continue  # the torque jumps between the three samples
        M, bias = by_pinocchio(q[k + 1], v[k])
        asked = M @ a[k] + bias + drives.inertia * a[k] + drives.viscous * v[k] + drives.coulomb * np.sign(v[k])
        lacking.append((asked - tau)[np.abs(v[k]) > 0.02])
    lacking = np.concatenate(lacking)
    assert len(lacking) > 600
    # the last tenth has a jump of the torque or a reversal between its samples
    assert np.median(np.abs(lacking)) < 1e-5 and np.quantile(np.abs(lacking), 0.9) < 0.02


def test_motions_stay_between_the_limits_and_below_the_speed(odd):
    joints = [replace(read_urdf(odd).joints[name], speed=0.2) for name in JOINTS]
    for seed in range(5):
        motion = make_motion(joints, np.array([2.0, 0.2, -0.9]), np.random.default_rng(seed))
        q = np.array([motion.position(t) for t in np.arange(0, 10, 0.01)])
        assert all(q[:, k].min() >= joint.lower and q[:, k].max() <= joint.upper for k, joint in enumerate(joints))
        assert np.abs(np.diff(q[:, 0])).max() / 0.01 < 0.2


def test_torque_constants_are_asked_for_only_where_known_masses_tell_them(odd):
    urdf = read_urdf(odd)
    bodies = ArmBodies(urdf, JOINTS, POSTURE)
    motion = make_motion([urdf.joints[name] for name in JOINTS], np.zeros(3), np.random.default_rng(3))
    load = loads(bodies, motion, 5.0)
    inertia = np.diag(bodies.mass_matrix(np.zeros(3)))
    slides = np.array([False, True, False])
    told, unit = make_drives(load, inertia, slides, "A", np.random.default_rng(4))
    assert unit == "A" and np.all(told.k != 1.0)
    nothing = replace(load, torque=1e-3 * load.torque)
    told, unit = make_drives(nothing, inertia, slides, "A", np.random.default_rng(4))
    assert unit == "Nm" and np.all(told.k == 1.0)


def test_prefixes_that_nobody_declares_do_not_matter(tmp_path):
    path = tmp_path / "prefixed.urdf"
    path.write_text(URDF.replace("<transmission", '<xacro:unknown a:b="1"/><transmission'), encoding="utf-8")
    assert list(read_urdf(path).joints) == ["turn", "held", "slide", "finger", "follows"]


def test_every_robot_of_the_table_has_the_joints_that_shall_move():
    names = [case.name for case in cases()]
    assert len(names) == len(set(names)) >= 40
    for case in cases():
        try:
            urdf = read_urdf(urdf_file(case))
        except PackageNotFoundError as err:
            pytest.skip(f"the robots of the benchmark are not installed: {err}")
        assert len(excited(case, urdf)) == case.count, case.name


TRUTH = {
    "variant": "N m",
    "joints": ["a"],
    "unit": "A",
    "inertia": [0.5],
    "coulomb": [1.0],
    "viscous": [2.0],
    "k": [3.0],
}


def typed(line, code=0, out="", err=""):
    return Typed(line, code, out, err, 1.0, 100.0)


def judged(folder, verdict, k=3.0, sigma=0.01, extra=None, advice=(), **last):
    values = {"a.inertia": 0.5, "a.coulomb_torque": 1.0, "a.motor_viscous.coefficient": 2.0, "a.torque_constant": k}
    values |= extra or {}
    content = {name: {"value": value, "sigma": sigma} for name, value in values.items() if value is not None}
    (folder / JSON).write_text(json.dumps({"parameters": content, "findings": []}), encoding="utf-8")
    (folder / ROBOT).write_text("name: made up\n", encoding="utf-8")
    last = typed("calibrate robot.yaml", **{"out": f"summary\n\n{verdict}, and so on\n", **last})
    return judge("robot", TRUTH, Session([typed("init x"), typed("info x"), last], list(advice)), folder)


def test_a_row_is_right_only_with_all_values_and_a_good_verdict(tmp_path):
    assert judged(tmp_path, "Yes").outcome == RIGHT
    assert judged(tmp_path, "Usable", k=3.02).outcome == RIGHT  # below one percent
    assert judged(tmp_path, "Yes", k=3.3, sigma=0.1).outcome == RIGHT  # within 3.5 sigma
    assert judged(tmp_path, "Yes", k=3.3).outcome == WRONG
    assert judged(tmp_path, "Yes", k=None).outcome == WRONG
    assert judged(tmp_path, "No").outcome == STUCK
    assert judged(tmp_path, "No").message.startswith("values are right")
    assert judged(tmp_path, "No", advice=["calibrate x y"]).outcome == MISLED
    assert judged(tmp_path, "Yes", advice=["calibrate x y"]).outcome == ADVISED


def test_a_row_names_errors_and_crashes(tmp_path):
    refused = judged(tmp_path, "", code=1, err="jointscope: error: no motion\n")
    assert (refused.outcome, refused.message, refused.promised) == (STUCK, "jointscope: error: no motion", True)
    bug = judged(tmp_path, "", code=1, err="jointscope: error: this is a bug in jointscope: KeyError\n")
    assert bug.outcome == BROKEN
    assert judged(tmp_path, "", code=124).message == "no end in time"
    assert judged(tmp_path, "", code=-9).outcome == BROKEN


def test_friction_of_two_laws_adds_up_and_a_constant_per_volt_counts_for_the_supply(tmp_path):
    laws = {"a.motor_viscous.coefficient": 1.5, "a.k_mi": 0.5, "a.torque_constant": None, "a.k_pwm": 0.125}
    judged(tmp_path, "Yes", extra=laws)
    (tmp_path / ROBOT).write_text("constants:\n  motor.supply_voltage: 24.0\n", encoding="utf-8")
    row = judge("robot", TRUTH, Session([typed("calibrate", out="Yes, good")]), tmp_path)
    assert row.outcome == RIGHT and row.largest == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("said", "command"),
    [
        ("no; type: jointscope init a.urdf b.mcap --joints x,y -o r.yaml", "init a.urdf b.mcap --joints x,y -o r.yaml"),
        ("it moves; `jointscope calibrate r.yaml b.mcap -o c.yaml` does it.", "calibrate r.yaml b.mcap -o c.yaml"),
        ("see jointscope init URDF BAG -o ROBOT.yaml", None),
        ("add a recording in which it moves", None),
    ],
)
def test_the_command_of_a_refusal_is_found(said, command):
    assert typed("init", code=1, err=f"jointscope: error: {said}\n").next_command() == command


def test_advice_is_typed_and_what_follows_it(tmp_path, monkeypatch):
    lines = []

    def answer(arguments, folder, limit):
        line = " ".join(arguments)
        lines.append(line)
        if line == "init a.urdf b.mcap -o robot.yaml":
            return typed(
                line, code=1, err="jointscope: error: which?; jointscope init a.urdf b.mcap --joints x -o r.yaml"
            )
        return typed(line, out="Yes, good")

    monkeypatch.setattr(arm_verbs, "run_verb", answer)
    session = first_contact(tmp_path, "a.urdf", "b.mcap", 1.0)
    assert session.advice == ["init a.urdf b.mcap --joints x -o r.yaml"]
    assert lines[2:] == [
        "info b.mcap --robot r.yaml",
        "calibrate r.yaml b.mcap -o calibrated.yaml --json calibration.json",
    ]
    assert session.robot_file == "r.yaml"


def test_a_verb_runs_in_its_folder_and_is_ended_when_its_time_is_over(tmp_path):
    done = arm_verbs.run_verb(["--version"], tmp_path, 60.0)
    assert done.code == 0 and done.out.startswith("jointscope ") and done.cpu > 0 and done.megabytes > 5
    assert arm_verbs.run_verb(["robots"], tmp_path, 0.0).code == 124


def test_the_table_counts_and_names_what_is_not_right(tmp_path):
    rows = [judged(tmp_path, "Yes"), judged(tmp_path, "Yes", k=4.0)]
    text = section(rows).markdown()
    assert "1 of 2" in text and "robot (wrong and called good): a.k 4, true 3" in text


def test_cases_say_how_they_were_recorded():
    case = ArmCase("x", "p", "x.urdf", "j", 1, unit="A", counts=4096, held="zero")
    assert case.variant == "A, 100 Hz, alphabetical, command: all, 4096 counts, others at zero"
