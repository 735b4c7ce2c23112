# SPDX-License-Identifier: BSD-3-Clause
"""One model grown by several kinds of recordings of a lever: MuJoCo moves it, equilibria are worked out by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, hanging, lever, lever_in_sight
from lever_of_all_kinds import Lever

import jointscope as js
from jointscope import simulate
from jointscope.factors.calibration import Calibration
from jointscope.graphs.across_kinds.discover_kinds import NOTHING_LEFT, discover_kinds, leading
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.said_by_kinds import AcrossKinds, Said
from jointscope.graphs.across_kinds.shared_effect import own_names, with_shared_effect, without_shared_effect
from jointscope.graphs.poses.tip_errors import whitened
from jointscope.graphs.poses.tracker_start import placed
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.geometry.arm_effects import hypotheses
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main
from jointscope.tools.report.searches.kinds_search_report import kinds_search_report
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.terminal.searches.kinds_discovery_text import kinds_discovery_text
from jointscope.tools.verb_parts.searches import kinds_search

VISCOUS = 0.1  # [N m s/rad]


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    """The rigid lever."""
    return lever(tmp_path_factory.mktemp("rod"), rigid=True)


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """The same with a target."""
    return lever_in_sight(tmp_path_factory.mktemp("seen"))


def moved(robot, *effects):
    true = robot.with_values({"swing.coulomb_torque": C0})
    return simulate(true, seconds=8.0, seed=3, effects=list(effects), friction="smooth").recording


def sighted(robot, count, session, *effects):
    return simulate_poses(robot, count, 3, PoseConditions(effects=effects, perfect=True), session)[0]


def lighter(rests):
    """With loads that are a tenth smaller than they were."""
    return replace(rests, forces=0.9 * rests.forces)


def labels(found):
    return {step.added.label for step in found.steps if step.added is not None}


def value(robot, name, true):
    """Whether a value is within three sigma of the truth."""
    p = robot.parameters[name]
    return abs(p.value - true) < 3.0 * p.sigma


@pytest.mark.slow
def test_each_kind_brings_in_what_it_shows_and_both_are_right_in_one_graph(rod):
    motion = moved(rod, f"motor_viscous@swing:coefficient={VISCOUS}")
    given = KindsRecordings(motion=(motion,), rests=(lighter(hanging(40, 3, rigid=True)),))
    held = KindsRecordings(rests=(lighter(hanging(16, 5, rigid=True)),))
    found = discover_kinds(rod, given, held, missing_torque=False)
    assert [step.added.label for step in found.steps[1:]] == ["motor_viscous@swing", "load_scale@robot"]
    assert [step.added.shown_by for step in found.steps[1:]] == [("motion",), ("rests",)]
    assert found.adequate and found.stop_reason == NOTHING_LEFT
    viscous, share = (found.robot.parameters[n] for n in ("swing.motor_viscous.coefficient", "robot.load_scale.share"))
    assert value(found.robot, viscous.name, VISCOUS) and abs(viscous.value - VISCOUS) < 1e-3
    assert value(found.robot, share.name, 1.0 / 0.9 - 1.0) and abs(share.value - 0.111) < 0.02
    assert value(found.robot, "swing.coulomb_torque", C0)
    (first, held_first), *_, (last, held_last) = found.errors
    assert last["motion"] < 2.0 < first["motion"] and held_last["rests"] < held_first["rests"]
    said = kinds_discovery_text(found)
    assert "motor_viscous@swing is shown by motion and cannot be shown by rests; from all kinds: swing.motor" in said
    assert "The last model: Nothing of the catalogue is missing in motion and rests." in said
    page = kinds_search_report(found)
    assert "error for training over that of the last model" in page and "What may be missing still" in page


@pytest.mark.slow
def test_motion_and_poses_bring_in_what_the_other_cannot_show(seen):
    effects = "torque_constant_error@swing:share=0.05", "tracker_drift@robot:x=1e-4,z=0"
    given = KindsRecordings((moved(seen, effects[0]),), (sighted(seen, 40, "poses", effects[1]),))
    held = KindsRecordings(poses=(sighted(seen, 20, "others", effects[1]),))
    found = discover_kinds(seen, given, held, missing_torque=False)
    assert labels(found) == {"torque_constant_error@swing", "tracker_drift@robot"} and found.adequate
    share, drift = "swing.torque_constant_error.share", "tracker.tracker_drift.x"
    assert value(found.robot, share, 0.05) and abs(found.robot.parameters[share].value - 0.05) < 5e-4
    assert value(found.robot, drift, 1e-4) and abs(found.robot.parameters[drift].value - 1e-4) < 3e-5
    # what only poses know changed nothing in the motion
    drifted = next(k for k, step in enumerate(found.steps) if step.added and step.added.label.startswith("tracker"))
    before, after = (found.errors[k][0]["motion"] for k in (drifted - 1, drifted))
    assert abs(after / before - 1.0) < 0.01
    assert found.errors[-1][1]["poses"] < 1.3 < found.errors[0][1]["poses"]
    again = robot_text(found.robot, seen.path.parent)
    path = seen.path.with_name("again.yaml")
    path.write_text(again, encoding="utf-8")
    assert load_robot(path).parameters[drift].value == pytest.approx(found.robot.parameters[drift].value)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ["rests", "poses"])
def test_nothing_comes_into_a_true_model(kinds, rod, seen):
    robot = rod if kinds == "rests" else seen
    other = {"rests": (hanging(40, 3, rigid=True),)} if kinds == "rests" else {"poses": (sighted(seen, 40, "poses"),)}
    found = discover_kinds(robot, KindsRecordings(motion=(moved(robot),), **other), missing_torque=False)
    assert len(found.steps) == 1 and found.adequate and found.stop_reason == NOTHING_LEFT


@pytest.mark.slow
def test_rests_and_poses_grow_one_model_without_motion(seen):
    rests, drift = lighter(hanging(40, 3, rigid=True)), "tracker_drift@robot:x=1e-4,z=0"
    given = KindsRecordings(poses=(sighted(seen, 40, "poses", drift),), rests=(rests,))
    found = discover_kinds(seen, given, KindsRecordings(poses=(sighted(seen, 20, "others", drift),)))
    assert labels(found) == {"load_scale@robot", "tracker_drift@robot"} and found.adequate
    share, along = "robot.load_scale.share", "tracker.tracker_drift.x"
    assert value(found.robot, share, 1.0 / 0.9 - 1.0) and value(found.robot, along, 1e-4)
    assert found.robot.parameters[along].sigma < 2e-5 and found.robot.parameters[share].sigma < 0.03
    assert found.errors[-1][1]["poses"] < 1.3 < found.errors[0][1]["poses"]


@pytest.mark.slow
def test_the_command_writes_the_model_its_steps_and_its_page(rod, tmp_path, capsys, monkeypatch):
    bag, out = tmp_path / "moves.mcap", tmp_path / "found.yaml"
    write_bag(bag, moved(rod), rod)
    given = {"weights.mcap": lighter(hanging(40, 3, rigid=True)), "held.mcap": lighter(hanging(16, 5, rigid=True))}
    monkeypatch.setattr(kinds_search, "read_all_rests", lambda paths, *_: [given[path.name] for path in paths])
    words = ["discover", str(rod.path), str(bag), "--rests", "weights.mcap", "--holdout-rests", "held.mcap"]
    files = {"-o": out, "--json": tmp_path / "found.json", "--report": tmp_path / "found.html"}
    assert main([*words, *(str(word) for pair in files.items() for word in pair)]) == 0
    said = capsys.readouterr().out
    assert "+ load_scale@robot" in said and "held out: rests [of friction]" in said
    content = json.loads(files["--json"].read_text(encoding="utf-8"))
    assert [step["added"] for step in content["steps"]] == [None, "load_scale@robot"] and content["adequate"]
    last = content["steps"][-1]
    assert last["effect"]["shown_by"] == ["rests"] and set(last["train_by_kind"]) == {"motion", "rests"}
    assert set(last["heldout_by_kind"]) == {"rests"} and last["heldout_error"] == last["by_kind"]["rests"]
    assert {each["kind"] for each in content["recordings"]} == {"bags", "rests"}
    share = load_robot(out).parameters["robot.load_scale.share"]
    assert abs(share.value - (1.0 / 0.9 - 1.0)) < 3.0 * share.sigma


@pytest.mark.slow
def test_four_kinds_find_one_load_that_responses_alone_are_led_astray_by(tmp_path):
    lever, kinds = Lever(tmp_path, load=0.3), ("motion", "poses", "rests", "frequency")
    found = discover_kinds(lever.robot, lever.recordings(*kinds), lever.held(*kinds), missing_torque=False)
    assert labels(found) == {"payload@robot"} and found.adequate
    (step,) = found.steps[1:]
    assert {"motion", "rests"} <= {*step.added.shown_by} and step.added.against == ()
    mass = found.robot.parameters["robot.payload.mass"]
    assert abs(mass.value - 0.3) < 3.0 * mass.sigma and mass.sigma < 1e-5
    for name in ("swing.stiffness", "swing.damping", "swing.coulomb_torque", "swing.motor_viscous.coefficient"):
        assert value(found.robot, name, lever.truth[name]), name
    (first, held_first), (last, held_last) = found.errors
    shown = [kind for kind in kinds if kind != "poses"]  # poses of this arm are within their noise without the load
    assert set(first) == set(kinds) and all(last[kind] < first[kind] for kind in shown)
    assert all(held_last[kind] < 0.1 * held_first[kind] for kind in ("motion", "rests"))
    assert first["poses"] < 1.0 and last["poses"] < 1.0 and held_last["poses"] < 1.1
    # what the last model is, as a graph for a user
    assert js.graph(found.steps[-1].model.motion.result).graph.size() < 40


@pytest.mark.slow
def test_a_torque_constant_of_an_elastic_drive_is_one_number_of_motion_and_rests_beside_poses(tmp_path):
    lever, share = Lever(tmp_path), 0.05
    poses, own, others = lever.seen(), lever.hanging(), lever.hanging(20, 17)
    rests, held = (replace(r, u=r.u / (1.0 + share)) for r in (own, others))
    lever.effects = [f"torque_constant_error@swing:share={share}"]
    given = KindsRecordings((lever.moved(),), (poses,), rests=(rests,))
    found = discover_kinds(lever.robot, given, KindsRecordings(rests=(held,)), missing_torque=False)
    assert labels(found) == {"torque_constant_error@swing"} and found.adequate
    assert found.steps[1].added.shown_by == ("motion", "rests")
    p = found.robot.parameters["swing.torque_constant_error.share"]
    assert value(found.robot, p.name, share) and abs(p.value - share) < 1e-4
    assert found.errors[-1][1]["rests"] < 1.2


@pytest.mark.slow
def test_nothing_comes_into_a_true_model_of_four_kinds(tmp_path):
    lever, kinds = Lever(tmp_path), ("motion", "poses", "rests", "frequency")
    found = discover_kinds(lever.robot, lever.recordings(*kinds), missing_torque=False)
    assert len(found.steps) == 1 and found.adequate


def test_recordings_of_one_graph_are_sent_where_they_belong(rod):
    with pytest.raises(RecordingError, match="recordings of one graph: call discover for motion, discover_rests"):
        discover_kinds(rod, KindsRecordings(rests=(hanging(10, 3, rigid=True),)))


def across(label, **by_kind):
    return AcrossKinds(label, by_kind, ())


def test_a_rigid_joint_that_poses_find_soft_gets_the_spring_that_all_kinds_read(seen):
    (hypothesis,) = (h for h in hypotheses(seen.joints, seen.parameters, True) if h.kind.soft and "elast" in h.kind.id)
    found = across("joint_elasticity@swing", poses=Said("missing", {"compliance": (2e-3, 1e-4, "rad/(N m)")}))
    soft = with_shared_effect(seen, found, hypothesis)
    assert soft.choices.rigid_joints == () and soft.layout.motors == ("swing",)
    assert set(own_names(soft, seen)) == {"swing.stiffness", "swing.damping"}
    assert soft.parameters["swing.stiffness"].value == pytest.approx(500.0)
    path = seen.path.with_name("soft.yaml")
    path.write_text(robot_text(soft, path.parent), encoding="utf-8")
    assert load_robot(path).parameters["swing.stiffness"].value == pytest.approx(500.0)


def test_an_effect_that_poses_alone_know_leaves_the_rest_of_the_model_as_it_is(seen):
    (drift,) = (h for h in hypotheses(seen.joints, seen.parameters, True) if h.kind.id == "tracker_drift")
    sizes = {axis: (1e-4, 1e-6, "m") for axis in "xyz"}
    grown = with_shared_effect(seen, across(drift.label, poses=Said("missing", sizes)), drift)
    assert grown.effects == seen.effects and grown.layout == seen.layout
    assert set(own_names(grown, seen)) == {*drift.names}
    smaller = without_shared_effect(grown, drift.label, seen)
    assert smaller.parameters == seen.parameters


def test_names_that_all_kinds_share_are_one_number(seen):
    known = hypotheses(seen.joints, {*seen.parameters, "swing.stiffness"}, True)
    (mass,) = (h for h in known if h.kind.id == "link_mass")
    found = across(mass.label, poses=Said("missing", {"mass": (0.4, 0.1, "kg")}), motion=Said("possible", {}))
    grown = with_shared_effect(seen, found, mass)
    assert grown.has_effect("link_mass", "swing") and grown.parameters["swing.link_mass.mass"].value == 0.4


def test_an_eccentric_encoder_is_one_number_with_one_sign_for_motion_and_poses(seen):
    (wave,) = (h for h in hypotheses(seen.joints, seen.parameters, True) if h.kind.id == "encoder_eccentricity")
    sizes = {"cos": (3e-4, 1e-6, "rad"), "sin": (-2e-4, 1e-6, "rad")}
    grown = with_shared_effect(seen, across(wave.label, poses=Said("missing", sizes), motion=Said("absent", {})), wave)
    assert grown.has_effect("encoder_eccentricity", "swing")
    poses = sighted(seen, 30, "poses", "encoder_eccentricity@swing:cos=3e-4,sin=-2e-4")
    _, (problem,) = placed(grown, [poses])
    assert whitened(grown, grown.poses, [problem]) < 1.3 < 5.0 < whitened(seen, seen.poses, [problem])
    grown = grown.with_values({"swing.encoder_eccentricity.order": 3.0})
    problem = problem.of_robot(grown)
    calibration = problem.start(Calibration.of(grown))[1]
    point, size = problem.point(calibration), 1e-7
    for name in ("cos", "sin", "order"):
        full = f"swing.encoder_eccentricity.{name}"
        value = grown.parameters[full].value
        ends = [
            problem.of_robot(grown.with_values({full: value + sign * size})).point(
                Calibration.of(grown.with_values({full: value + sign * size}))
            )
            for sign in (1.0, -1.0)
        ]
        slope = (ends[0].target - ends[1].target) / (2.0 * size)
        np.testing.assert_allclose(point.by_value[full], slope, atol=1e-6)


def test_the_first_of_each_kind_is_a_leader_and_the_one_with_most_evidence_comes_in():
    def missing(kind, evidence):
        return {kind: Said("missing", {}, (), "", evidence)}

    class Found:
        candidates = (
            across("a@j", **missing("motion", 10.0)),
            across("b@j", **missing("motion", 90.0)),
            across("c@r", **missing("poses", 50.0)),
        )
        kinds = ("motion", "poses")

        def order_of(self, kind):
            return ("a@j", "b@j") if kind == "motion" else ("c@r",)

    assert leading(Found()).label == "c@r"  # b comes after a in the order of the motion, which knows what is alike
    assert leading(Found(), ["c@r"]).label == "a@j" and leading(Found(), ["c@r", "a@j"]).label == "b@j"
    assert leading(Found(), ["a@j", "b@j", "c@r"]) is None


def test_evidence_of_an_effect_counts_each_kind_that_shows_it():
    both = across("a@j", motion=Said("missing", {}, evidence=3.0), poses=Said("missing", {}, evidence=4.0))
    assert both.evidence == 7.0 and np.isclose(across("a@j", poses=Said("possible", {}, evidence=9.0)).evidence, 0.0)
    assert across("a@j", motion=Said("missing", {}), poses=Said("untestable", {})).seen_by == ("motion",)
