# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects of an arm of one joint at rest, whose equilibria are worked out here by hand, are named."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from lever_arm import URDF
from scipy.optimize import brentq

from jointscope.graphs.rest_search.discover_rests import diagnose_rests, discover_rests
from jointscope.graphs.rest_search.rest_fits import folds_of
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.rests import Rests
from jointscope.tools.bags.at_poses.read_rests import read_rests

YAML = """
format: 1
name: lever
urdf: lever.urdf
gravity: [0.0, 0.0, -9.81]
joints: [swing]
command: {topic: /u, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motor_angle: {kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad,
                sigma: 1.0e-5}
  link_angle: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad,
               sigma: 2.0e-4}
parameters:
  swing.coulomb_torque: {value: 0.2, unit: N m, prior_sigma: 2.0}
  swing.inertia: {value: 0.2, unit: kg m2, prior_sigma: 0.5}
  swing.stiffness: {value: 60.0, unit: N m/rad, prior_sigma: 100.0}
  swing.damping: {value: 0.1, unit: N m s/rad, prior_sigma: 1.0}
noise: {link_velocity: [0.3], motor_velocity: [0.3]}
"""
K, C0 = 40.0, 0.3


@dataclass(frozen=True)
class Lever:
    """The true lever: hardening and slack of its spring, mass at the hook, offsets, friction both ways, gain."""

    hardening: float = 0.0  # [N m/rad^3]
    slack: float = 0.0  # [rad] before the spring pulls the link back from ahead of the motor
    payload: float = 0.0  # [kg]
    offset: float = 0.0  # [N m]
    zero: float = 0.0  # [rad] of the link encoder
    wave: float = 0.0  # [rad] of the same, twice per turn
    ripple: float = 0.0  # [rad] of the same, four times per turn
    slope: float = 0.0  # [N m] more friction forwards, less backwards
    gain: float = 1.0

    def hanging(self, count: int, seed: int, path: str = "bench") -> Rests:
        """Rests with weights that pull at the hook over a pulley; friction anywhere in its band."""
        rng = np.random.default_rng(seed)
        pull = rng.choice([0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0], count)
        motor, link, u = np.zeros((3, count, 1))
        for k in range(count):
            q = rng.uniform(-1.0, 1.0)
            # torque about the joint that gravity and rope exert, which the spring must balance
            tau = -9.81 * (2.0 * 0.3 + self.payload * 0.5) * np.sin(q) - pull[k] * 0.5 * np.cos(q)
            d = brentq(lambda d, tau=tau: K * d + self.hardening * d**3 - tau, -1.0, 1.0)
            d += self.slack * (tau > 0.0)
            share = rng.uniform(-1.0, 1.0)
            # what friction can hold when the motor is about to move one way or the other
            friction = share * (C0 + self.slope if share > 0.0 else C0 - self.slope)
            motor[k] = q - d + 1e-5 * rng.normal()
            link[k] = q + self.zero + self.wave * np.sin(2.0 * q) + self.ripple * np.sin(4.0 * q) + 2e-4 * rng.normal()
            u[k] = (friction - tau - self.offset) / self.gain
        zero = np.zeros((count, 1))
        forces = np.column_stack([pull, 0.0 * pull, 0.0 * pull])
        return Rests(
            path, path, np.zeros((count, 2)), motor, link, u, zero, zero, zero, forces, ("hook",) * count,
            np.ones((count, 1), dtype=bool), zero,
        )  # fmt: skip


# truth, effects that say the same at rest, and the size that the first of them has
HIDDEN = {
    "hardening": (Lever(hardening=400.0), ("spring_cubic@swing", "spring_curve@swing"), {"stiffness": 400.0}),
    # weight about the joint is what the cosine law says: 9.81 m/s^2 * 0.3 kg * 0.5 m
    "payload": (Lever(payload=0.3), ("gravity_imbalance@swing", "link_mass@swing"), {"sin": -1.4715, "cos": 0.0}),
    "offset": (Lever(offset=0.2), ("asymmetric_friction@swing", "torque_offset@swing"), {"torque": -0.2}),
    "zero": (Lever(zero=0.01), ("encoder_offset@swing.link",), {"offset": 0.01}),
    "wave": (Lever(wave=0.01), ("encoder_eccentricity@swing.link",), {"sin2": 0.01}),
    "slack": (Lever(slack=0.03), ("spring_slack@swing",), {"forward": 0.03}),
    "ripple": (Lever(ripple=0.005), ("encoder_harmonics@swing.link",), {"sin": 0.005}),
    "friction": (Lever(slope=0.15), ("asymmetric_friction@swing", "torque_offset@swing"), {"torque": 0.15}),
    "gain": (Lever(gain=1.15), ("torque_constant_error@swing",), {"share": 0.15}),
}
DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
needs_biorob = pytest.mark.skipif(not DATA.is_dir(), reason="shared/data/biorob is not beside the project")


@pytest.fixture
def lever(tmp_path):
    (tmp_path / "lever.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "lever.yaml").write_text(YAML, encoding="utf-8")
    return load_robot(tmp_path / "lever.yaml")


@pytest.mark.parametrize("name", HIDDEN)
def test_a_hidden_effect_is_named_first_and_found_with_its_size(lever, name):
    truth, known, sizes = HIDDEN[name]
    found = discover_rests(lever, [truth.hanging(60, 1)], [truth.hanging(30, 2, "other")])
    (added,) = [step.added for step in found.steps if step.added]
    assert added.label == known[0] and set(known[1:]) <= set(added.look_alikes)
    assert added.verdict == "missing" and added.helped == 1.0 and found.adequate
    for size, value in sizes.items():
        assert added.sizes[size][0] == pytest.approx(value, abs=max(3.0 * added.sizes[size][1], 0.1 * abs(value)))
    last = found.errors(found.steps[-1], found.holdout)
    assert last.error < 1.2 and last.torque.std() < 0.02


@pytest.mark.parametrize("seed", range(1, 6))
def test_nothing_is_missing_where_the_model_is_whole(lever, seed):
    found = diagnose_rests(lever, [Lever().hanging(60, seed)])
    assert found.adequate and {c.verdict for c in found.candidates} == {"absent", "untestable"}


def test_effects_that_rests_cannot_show_say_why(lever):
    found = diagnose_rests(lever, [Lever().hanging(30, 1)])
    why = {c.label: c.why for c in found.candidates if c.verdict == "untestable"}
    assert why["encoder_delay@swing"] == "does nothing while nothing moves"
    assert why["hysteresis@swing"] == "depends on how a joint came to rest, which rests do not show"
    assert why["motor_viscous@swing"] == "does nothing at these rests"
    assert why["link_coulomb@swing"] == "would hold a link away from equilibrium, at which rests take all links"


def test_two_effects_are_found_one_after_the_other(lever):
    truth = Lever(hardening=400.0, gain=1.15)
    found = discover_rests(lever, [truth.hanging(40, 1), truth.hanging(40, 2, "more")])
    assert [step.added and step.added.label for step in found.steps] == [
        None, "spring_cubic@swing", "torque_constant_error@swing",
    ]  # fmt: skip
    assert found.robot.parameters["swing.spring_cubic.stiffness"].value == pytest.approx(400.0, rel=0.05)


def test_each_group_left_out_takes_a_block_of_every_recording():
    recordings = [Lever().hanging(20, 1), Lever().hanging(11, 2)]
    folds = folds_of(recordings)
    assert len(folds) == 5 and np.all(np.sum(folds, axis=0) == 1)
    for fold in folds:
        for part in (fold[:20], fold[20:]):
            assert part.any() and np.count_nonzero(np.diff(part.astype(int)) == 1) + part[0] == 1


def test_too_few_rests_and_rests_twice_are_refused(lever):
    few = Lever().hanging(7, 1)
    with pytest.raises(RecordingError, match="bench: 7 rests; expected 8 or more, so that groups of them can"):
        diagnose_rests(lever, [few])
    rests = Lever().hanging(20, 1)
    with pytest.raises(RecordingError, match="--holdout-rests copy is also given with --rests"):
        discover_rests(lever, [rests], [replace(rests, path="copy")])


@needs_biorob
@pytest.mark.slow
def test_springs_that_harden_are_found_on_the_rope_driven_arm():
    robot = load_robot("biorob")
    for joint in ("joint1", "joint2"):
        robot = remove_effect(robot, f"spring_curve@{joint}")
    found = discover_rests(robot, rests_of(robot))
    assert {step.added.label for step in found.steps[1:]} == {"spring_curve@joint1", "spring_curve@joint2"}
    true = json.loads((DATA / "static_spring" / "truth.json").read_text())["spring1"]["true"]
    radii = json.loads((DATA / "static_spring" / "truth.json").read_text())["spring1"]["base"]["r"]
    for j, joint in enumerate(("joint1", "joint2")):
        # force over elongation x = -r deflection: torque on the pulley is -r f
        for power, name in ((2, "quadratic"), (3, "cubic")):
            force = true["spring_N_per_m_powers_1_2_3"][j][power - 1]
            p = found.robot.parameters[f"{joint}.spring_curve.{name}"]
            assert p.value == pytest.approx((-radii[j]) ** (power + 1) * force, abs=3.0 * p.sigma), p.name


@needs_biorob
@pytest.mark.slow
def test_an_idler_that_is_left_out_is_found_and_the_whole_model_lacks_nothing():
    whole = load_robot("biorob")
    rests = rests_of(whole)
    assert {c.verdict for c in diagnose_rests(whole, rests).candidates} == {"absent", "untestable"}
    diagonal = replace(whole, transmission=np.diag(np.diag(whole.transmission)))
    found = discover_rests(diagonal, rests)
    assert [step.added.label for step in found.steps[1:]] == ["kinematic_coupling@joint4"]
    p = found.robot.parameters["joint4.kinematic_coupling.from_joint3"]
    assert p.value == pytest.approx(whole.transmission[3, 2], abs=3.0 * p.sigma) and p.sigma < 1e-4


def rests_of(robot):
    paths = [*sorted((DATA / "static_spring").glob("spring?")), DATA / "static_gravity" / "gravity"]
    return [read_rests(path, robot) for path in paths]
