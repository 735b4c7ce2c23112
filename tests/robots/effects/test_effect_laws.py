# SPDX-License-Identifier: BSD-3-Clause
"""The laws of all effects: nothing at null, true derivatives, and each a few numbers that can be checked by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_check import null_values
from jointscope.robots.files.effect_editing import add_effect, cannot_be_added
from jointscope.robots.files.robot_file import load_robot

DOGGY = load_robot("doggy")
EFFECTS = list(catalogue().values())
TORQUES = [effect for effect in EFFECTS if isinstance(effect, JointTorque)]
READINGS = [effect for effect in EFFECTS if isinstance(effect, ReadingEffect)]
SHIFTS = [effect for effect in EFFECTS if isinstance(effect, TimeShift)]
SIGNALS = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring", "stiffness", "memory")
STEP = 1e-30


def of(effects):
    return pytest.mark.parametrize("effect", effects, ids=lambda effect: effect.id)


def motion() -> JointSignals:
    """Slow and fast, forwards and backwards, large and small deflections."""
    rng = np.random.default_rng(1)
    q, deflection = rng.uniform(-1.0, 1.0, 40), rng.uniform(-0.1, 0.1, 40)
    v, rate = rng.normal(size=40) * np.geomspace(1e-3, 3.0, 40), rng.normal(size=40) * 0.1
    signals = {"q_link": q + deflection, "v_link": v + rate, "q_motor": q, "v_motor": v}
    return JointSignals(
        **signals, tau_spring=150.0 * deflection + 5.0 * rate, stiffness=150.0, memory=rng.uniform(-1, 1, 40)
    )


def example(effect) -> dict[str, float]:
    """Its demonstration size, shapes and all."""
    return {**{p.name: p.start for p in effect.parameters}, **effect.example}


def null(effect) -> dict[str, float]:
    return null_values(effect.parameters)


# torques of a joint


@of(TORQUES)
def test_at_null_there_is_no_torque(effect):
    assert np.all(effect.law(motion(), null(effect)) == 0.0)


@of(TORQUES)
def test_complex_steps_agree_with_differences(effect):
    signals, p = motion(), example(effect)
    laws = [effect.law] if effect.memory is None else [effect.law, effect.memory.rate]
    for law in laws:
        for name in SIGNALS:
            value = getattr(signals, name)
            by = np.imag(law(replace(signals, **{name: value + 1j * STEP}), p)) / STEP
            h = 1e-7 * max(1.0, float(np.abs(value).max()))
            near = (law(replace(signals, **{name: value + h}), p) - law(replace(signals, **{name: value - h}), p)) / (
                2 * h
            )
            np.testing.assert_allclose(by * np.ones(40), near * np.ones(40), rtol=1e-4, atol=1e-4, err_msg=name)
        for name, value in p.items():
            by = np.imag(law(signals, {**p, name: value + 1j * STEP})) / STEP
            h = 1e-6 * abs(value)
            near = (law(signals, {**p, name: value + h}) - law(signals, {**p, name: value - h})) / (2 * h)
            np.testing.assert_allclose(by * np.ones(40), near * np.ones(40), rtol=1e-4, atol=1e-4, err_msg=name)


@of([e for e in TORQUES if e.side != "spring" and e.parameters[0].sign == "+"])
def test_friction_takes_energy(effect):
    s = motion()
    speed = s.v_motor if effect.side == "motor" else s.v_link
    assert np.all(effect.law(s, example(effect)) * speed <= 0.0)


def test_friction_by_direction_has_four_numbers():
    v = np.array([-2.0, -0.5, 0.5, 2.0])
    s = JointSignals(q_link=v, v_link=v, q_motor=v, v_motor=v, tau_spring=v, stiffness=150.0, sharpness=1e3)
    found = catalogue()["friction_by_direction"].law(s, {"torque": 0.4, "coefficient": 0.3})
    base = -(1.0 * np.sign(v) + 0.5 * v)
    forwards, backwards = -(1.4 * np.sign(v) + 0.8 * v), -(0.6 * np.sign(v) + 0.2 * v)
    np.testing.assert_allclose(base + found, np.where(v > 0.0, forwards, backwards))


def test_backlash_leaves_the_gap_free_and_spring_and_damper_beyond_it():
    q, rate = np.array([-0.05, -0.004, 0.004, 0.05]), np.array([0.3, -0.4, 0.5, -0.6])
    base = 150.0 * q + 2.0 * rate
    s = JointSignals(q_link=q, v_link=rate, q_motor=np.zeros(4), v_motor=np.zeros(4), tau_spring=base, stiffness=150.0)
    total = base + catalogue()["backlash"].law(s, {"half_gap": 0.01})
    beyond = 150.0 * np.array([-0.04, 0.0, 0.0, 0.04]) + 2.0 * np.array([0.3, 0.0, 0.0, -0.6])
    np.testing.assert_allclose(total, beyond, atol=1e-6)


def test_a_slack_rope_leaves_the_spring_free_on_its_own_side_only():
    q, rate = np.array([-0.05, -0.004, 0.004, 0.05]), np.array([0.3, -0.4, 0.5, -0.6])
    base = 150.0 * q + 2.0 * rate
    s = JointSignals(q_link=q, v_link=rate, q_motor=np.zeros(4), v_motor=np.zeros(4), tau_spring=base, stiffness=150.0)
    law = catalogue()["spring_slack"].law
    forward = 150.0 * np.array([-0.05, -0.004, 0.0, 0.03]) + 2.0 * rate * [1.0, 1.0, 0.0, 1.0]
    np.testing.assert_allclose(base + law(s, {"forward": 0.02, "backward": 0.0}), forward, atol=1e-4)
    both = 150.0 * np.array([-0.04, 0.0, 0.0, 0.03]) + 2.0 * rate * [1.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(base + law(s, {"forward": 0.02, "backward": 0.01}), both, atol=1e-4)
    same = catalogue()["backlash"].law(s, {"half_gap": 0.02})
    np.testing.assert_allclose(law(s, {"forward": 0.02, "backward": 0.02}), same, atol=1e-12)


def test_a_spring_has_one_dead_zone():
    arm = add_effect(load_robot("biorob"), "spring_slack@joint1")
    play = EffectAt(catalogue()["backlash"], "joint1")
    assert cannot_be_added(arm, play) == "spring_slack@joint1 is the dead zone of its spring already; remove that first"
    assert cannot_be_added(arm, replace(play, owner="joint2")) == ""


def test_a_curve_of_the_spring_begins_beyond_the_gap_and_is_asked_for_by_the_size_of_the_gap():
    q, gap = np.array([-0.3, -0.05, 0.0, 0.05, 0.3]), 0.1
    still = np.zeros(5)
    s = JointSignals(q_link=q, v_link=still, q_motor=still, v_motor=still, tau_spring=150.0 * q, stiffness=150.0)
    play, curve = catalogue()["backlash"], catalogue()["spring_curve"]
    effects = [EffectAt(curve, "joint1"), EffectAt(play, "joint1"), EffectAt(play, "joint2")]
    assert curve.behind(effects, "joint1") == ("joint1.backlash.half_gap",)
    assert curve.behind(effects, "joint3") == play.behind(effects, "joint1") == ()
    p = {"quadratic": 40.0, "cubic": 900.0}
    total = 150.0 * q + play.law(s, {"half_gap": gap}) + curve.law(replace(s, gap=(gap,)), p)
    z = np.array([-0.2, 0.0, 0.0, 0.0, 0.2])
    np.testing.assert_allclose(total, 150.0 * z + 40.0 * z**2 + 900.0 * z**3, atol=1e-6)


def test_an_encoder_on_the_link_has_two_harmonics_and_one_on_the_motor_its_order():
    effect, arm = catalogue()["encoder_eccentricity"], load_robot("biorob")
    assert "joint3.link" in effect.owners_of(arm) and "joint3.link" not in effect.owners_of(load_robot("doggy"))
    assert [p.name for p in effect.parameters_at(arm, "joint3.link")] == ["cos", "sin", "cos2", "sin2"]
    assert [p.name for p in effect.parameters_at(arm, "joint3")] == ["cos", "sin", "order"]
    q = np.linspace(-3.0, 3.0, 7)
    wave = 0.035 * np.sin(q + 0.6) + 0.017 * np.sin(2.0 * q - 1.1)
    p = {"cos": 0.035 * np.sin(0.6), "sin": 0.035 * np.cos(0.6)}
    p |= {"cos2": 0.017 * np.sin(-1.1), "sin2": 0.017 * np.cos(1.1)}
    np.testing.assert_allclose(effect.law(q, 0.0 * q, p), wave, atol=1e-15)


def test_hysteresis_takes_another_way_back():
    effect = catalogue()["hysteresis"]
    p, t = {"torque": 2.0, "deflection": 0.005}, np.linspace(0.0, 4 * np.pi, 8001)
    z = np.zeros(len(t))
    rate = 0.2 * np.cos(t)
    for k in range(len(t) - 1):
        s = replace(motion(), v_link=rate[k], v_motor=0.0, memory=z[k])
        z[k + 1] = z[k] + (t[1] - t[0]) * effect.memory.rate(s, p)
    assert 0.9 < z.max() <= 1.001 and -1.001 <= z.min() < -0.9
    assert np.sum(p["torque"] * z * rate) * (t[1] - t[0]) == pytest.approx(4 * 2 * 2.0 * 0.2, rel=0.1)


# inertia


BODY = np.array([2.0, 0.1, 0.2, 0.6, 0.5, 0.0, 0.52, 0.0, 0.0, 0.02])


@of([effect for effect in EFFECTS if isinstance(effect, InertiaEffect)])
def test_changes_of_a_body_are_those_of_its_parameters_and_only_a_wrong_mass_changes_the_mass(effect):
    changes = effect.change(BODY)
    assert set(changes) == {p.name for p in effect.parameters}
    for change in changes.values():
        assert change.shape == (10,)
        assert effect.id == "link_mass" or np.all(change[:4] == 0.0)


def test_a_heavier_link_has_more_of_its_own_material():
    changes = catalogue()["link_mass"].change(BODY)
    np.testing.assert_allclose(BODY + 2.0 * changes["mass"], 2.0 * BODY)
    np.testing.assert_allclose(changes["y"], np.eye(10)[2])


def test_a_payload_sits_on_the_axis_of_least_inertia():
    change = catalogue()["payload"].change(BODY)["inertia"]
    np.testing.assert_allclose(change, [0, 0, 0, 0, 1, 0, 1, 0, 0, 0], atol=1e-12)
    assert catalogue()["payload"].owners_of(DOGGY) == ("joint3",)


# readings and stamps


@of(READINGS)
def test_at_null_readings_are_true_and_otherwise_their_derivatives_are(effect):
    rng = np.random.default_rng(5)
    reading = rng.normal(size=(30, 1 if "joint" in effect.owners else 3))
    time, p = np.sort(rng.uniform(0.0, 20.0, 30)), example(effect)
    assert np.all(effect.law(reading, time, null(effect)) == 0.0)
    assert effect.law(reading, time, p).shape == reading.shape
    for name, value in p.items():
        by = np.imag(effect.law(reading, time, {**p, name: value + 1j * STEP})) / STEP
        h = 1e-6 * abs(value)
        up, down = (effect.law(reading, time, {**p, name: value + side}) for side in (h, -h))
        np.testing.assert_allclose(by, (up - down) / (2 * h), rtol=1e-5, atol=1e-8)
    by = np.imag(effect.law(reading + 1j * STEP, time, p)) / STEP
    up, down = (effect.law(reading + side, time, p) for side in (1e-6, -1e-6))
    np.testing.assert_allclose(by, (up - down) / 2e-6, rtol=1e-5, atol=1e-8)


@of(SHIFTS)
def test_stamps_are_late_in_proportion_to_the_parameter(effect):
    stamps = np.linspace(0.0, 20.0, 7)
    late, by = effect.late(stamps, null(effect))
    assert np.all(late == 0.0)
    ((name, value),) = example(effect).items()
    late, again = effect.late(stamps, {name: value})
    assert np.array_equal(by[name], again[name])
    np.testing.assert_allclose(late, value * by[name])
