# SPDX-License-Identifier: BSD-3-Clause
"""Targets on links of a TX90L other than its tool, measured by a simulated tracker."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from slopes_of_rows import checked_slopes
from tools_with_targets import tool_with

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.seen_targets import mounts
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.graphs.poses.tracker_start import placed
from jointscope.robots.errors import RecordingError, RobotError, SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
ELBOW = "elbow: {link: link3, at: [0.1, 0.05, 0.02]}, arm: {link: link2}"
WRIST = ("joint4.mis_x", "joint5.lx", "joint5.mis_x", "joint6.mis_x")
BEHIND = [f"joint{j}.{part}" for j in (4, 5, 6) for part in ("lx", "ly", "lz", "mis_y", "mis_x", "offset")]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return tool_with(tmp_path_factory.mktemp("links"), ELBOW)


@pytest.fixture(scope="module")
def simulated(robot):
    return simulate_poses(robot, 60, 3)


@pytest.fixture(scope="module")
def result(robot, simulated):
    return calibrate_poses(robot, [simulated[0]])


def on_third_link(folder):
    """The arm whose one target hangs on its third link, with the wrist as weight behind it."""
    path = tool_with(folder, "").path
    text = path.read_text(encoding="utf-8").replace("target: reflector ", "target: link3     # ", 1)
    path.write_text(text.replace("poses:\n", "poses:\n  at: [0.1, 0.05, 0.02]\n", 1), encoding="utf-8")
    return load_robot(path)


def off(result, truth, names):
    """Sigmas that values are away from the truth."""
    parameters = result.robot.parameters
    return np.array([(parameters[n].value - truth[n]) / parameters[n].sigma for n in names])


def test_derivatives_of_targets_on_three_links_are_those_of_what_is_missed(robot):
    poses = simulate_poses(robot, 12, 3, PoseConditions(orientation=True))[0]
    problem, columns, _ = checked_slopes(robot, poses)
    rows = {owner: np.flatnonzero([o == owner for o in problem.targets.owners]) for owner in ("elbow", "reflector")}
    behind = max(np.abs(columns[name][:, rows["elbow"]]).max() for name in BEHIND)
    assert 0.0 < behind < 1e-2  # joints behind a link move it by their weight alone
    assert not np.any(columns["tool.lx"][:, rows["elbow"]]) and np.any(columns["elbow.lx"][:, rows["elbow"]])
    assert not np.any(columns["elbow.lx"][:, rows["reflector"]])


def test_derivatives_of_a_first_target_with_weight_behind_it_are_those_of_what_is_missed(tmp_path):
    robot = on_third_link(tmp_path)
    assert robot.poses.link == "link3"
    _, columns, _ = checked_slopes(robot, simulate_poses(robot, 12, 3)[0])
    assert max(np.abs(columns[name]).max() for name in BEHIND) < 1e-2 < np.abs(columns["joint3.lx"]).max()


def test_a_payload_at_a_target_pulls_at_the_joints_that_carry_it_only(tmp_path):
    path = on_third_link(tmp_path).path
    line = "  robot.payload.mass: {value: 0.0, unit: kg, positive: false, prior_sigma: 3.0}\n"
    path.write_text(path.read_text(encoding="utf-8").rstrip("\n") + f"\n{line}", encoding="utf-8")
    robot = load_robot(path)
    robot = robot.with_values({"robot.payload.mass": 5.0})
    _, columns, _ = checked_slopes(robot, simulate_poses(robot, 12, 3)[0])
    assert np.abs(columns["robot.payload.mass"]).max() > 1e-6


def test_targets_stand_where_pinocchio_has_their_links(robot, simulated):
    model = robot.tree.model
    data = model.createData()
    rigid = replace(robot, parameters={n: p for n, p in robot.parameters.items() if "stiffness" not in n})
    _, (problem,) = placed(rigid, [simulated[0]])
    seen = problem.arm.at(problem.q, np.zeros_like(problem.q), {}, True)
    for name, mount in mounts(rigid).items():
        target = next(t for t in rigid.poses.targets if t.name == name)
        for k in (0, 7):
            pin.framesForwardKinematics(model, data, problem.q[k])
            there = data.oMf[robot.tree.frame_id(target.link)].act(np.zeros(3) if target.at is None else target.at)
            link, first = mount.on(seen), next(iter(mounts(rigid).values()))
            np.testing.assert_allclose(link.target[k] + link.turn[k] @ mount.away(first, {}), there, atol=1e-12)


def test_an_elbow_that_is_seen_tells_which_links_are_off(robot, simulated, result):
    truth = simulated[1]["parameters"]
    assert np.abs(off(result, truth, result.told)).max() < 3.5
    for name in ("elbow.lx", "arm.lx", "arm.lz", "joint3.mis_x", "joint2.stiffness"):
        assert abs(off(result, truth, [name])[0]) < 3.0, name
    assert abs(result.robot.parameters["arm.lx"].value - truth["arm.lx"]) < 2e-4 < 1e-2 < abs(truth["arm.lx"])
    alone = calibrate_poses(robot, [simulated[0].of_first])
    assert result.determined.rank > alone.determined.rank
    for name in ("joint2.mis_x", "joint3.mis_x", "joint4.mis_x", "joint3.stiffness"):
        assert result.robot.parameters[name].sigma < alone.robot.parameters[name].sigma, name


def test_poses_that_were_not_fitted_are_met_at_every_link(robot, result):
    other, _ = simulate_poses(robot, 40, 3, session="others")
    _, (problem,) = placed(result.robot, [other])
    each = tip_errors(problem).of_targets
    assert set(each) == {"reflector", "elbow", "arm"}
    assert all(errors.to_json()["p90_mm"] < 0.08 for errors in each.values())


def test_zeros_behind_the_only_target_stay_and_those_before_it_come_out(tmp_path):
    robot = on_third_link(tmp_path)
    poses, truth = simulate_poses(robot, 60, 3)
    found = calibrate_poses(robot, [poses])
    parameters, values = found.robot.parameters, truth["parameters"]
    for name in BEHIND:  # the little that the weight tells moves them by no more than it can
        p = parameters[name]
        share = p.sigma / p.prior_sigma
        assert share > 0.98 and abs(p.value) < 3.0 * p.prior_sigma * np.sqrt(1.0 - share**2), name
    assert not {*BEHIND} & {*found.told}
    assert np.abs(off(found, values, found.told)).max() < 3.5
    assert abs(parameters["joint2.stiffness"].value / values["joint2.stiffness"] - 1.0) < 0.1
    assert found.errors[0].to_json()["p90_mm"] < 0.08


@pytest.mark.slow
def test_sigmas_are_honest_in_twenty_arms_with_an_elbow_that_is_seen(robot):
    # what the priors of lengths share out among links that poses cannot tell apart says nothing of the sigmas
    names = (*WRIST, "joint1.mis_y", "joint1.mis_x", "joint2.mis_x", "joint3.mis_x", "joint3.stiffness")
    z = []
    for seed in range(20):
        poses, truth = simulate_poses(robot, 40, seed)
        z.append(off(calibrate_poses(robot, [poses]), truth["parameters"], names))
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.15 and np.mean(np.abs(z) < np.full(len(names), 2.0)) > 0.91


def test_a_target_that_slips_on_its_link_is_named_with_the_pose(robot, simulated):
    poses = simulated[0]
    _, (problem,) = placed(robot, [poses])
    tool = problem.arm.at(problem.q, np.zeros_like(problem.q), problem.values(Calibration.of(robot)), True)
    turn = mounts(robot)["elbow"].on(tool).turn
    shift = np.einsum("ij,mjk,k->mi", problem.tracker[:3, :3].T, turn, [0.0, 1e-3, 0.0])
    shift *= (np.arange(len(poses)) >= 35)[:, None]
    others = tuple(replace(s, place=s.place + shift) if s.name == "elbow" else s for s in poses.others)
    with pytest.raises(SolveError, match="From pose 35 of simulation on the target elbow is shifted on link3 by 1 mm"):
        calibrate_poses(robot, [replace(poses, others=others)])


def test_a_target_on_another_link_than_the_file_says_is_told_with_the_link(robot, tmp_path):
    poses, _ = simulate_poses(robot, 30, 3)
    wrong = tool_with(tmp_path, ELBOW.replace("link3", "link1"))
    with pytest.raises(RecordingError) as err:
        calibrate_poses(wrong, [poses])
    said = str(err.value)
    assert "the target elbow is not where tool.yaml has it on link1" in said and "the link that carries it" in said


@pytest.mark.parametrize(
    ("targets", "told"),
    [
        (
            "left: {link: base_link}",
            "base_link does not move with the arm; expected a link that joint1 or",
        ),
        ("left: {link: elbow}", "poses.targets.left.link: no link 'elbow'"),
    ],
)
def test_links_that_cannot_carry_a_target_are_told(tmp_path, targets, told):
    with pytest.raises(RobotError) as err:
        tool_with(tmp_path, targets)
    assert told in str(err.value) and "\n" not in str(err.value)


def free_tracker(folder, targets):
    """The arm with those targets, the place of whose tracker nothing says."""
    path = tool_with(folder, targets).path
    text = path.read_text(encoding="utf-8").replace("  tracker: ", "  # tracker: ", 1)
    path.write_text(text, encoding="utf-8")
    robot = load_robot(path)
    assert robot.poses.tracker is None
    return robot


@pytest.mark.parametrize(
    ("targets", "told"),
    [
        (
            "elbow: {link: link3, at: [100, 50, 20]}",
            r"target elbow is not where \S+ has it on link3, .*; at \[0\.\d+, 0\.\d+, 0\.\d+\] of link3 it fits to",
        ),
        ("elbow: {link: link4, at: [0.1, 0.05, 0.02]}", r"target elbow is not where \S+ has it on link4"),
    ],
)
def test_a_target_elsewhere_is_told_though_the_tracker_is_placed_by_it_too(robot, tmp_path, targets, told):
    poses = simulate_poses(tool_with(tmp_path, "elbow: {link: link3, at: [0.1, 0.05, 0.02]}"), 20, 3)[0]
    with pytest.raises(RecordingError, match=told):
        calibrate_poses(free_tracker(tmp_path, targets), [poses])


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("elbow",), "places of elbow are about 1000 times as far apart as those of the other targets, as in milli"),
        (("reflector", "elbow"), "targets are 1000 times as far apart as the arm puts them, as in millimetres; expec"),
    ],
)
def test_millimetres_of_some_targets_and_of_all_are_told_apart(tmp_path, names, told):
    robot = free_tracker(tmp_path, "elbow: {link: link3, at: [0.1, 0.05, 0.02]}")
    poses = simulate_poses(robot, 20, 3)[0]
    others = tuple(replace(s, place=s.place * (1e3 if s.name in names else 1.0)) for s in poses.others)
    target = poses.target * (1e3 if "reflector" in names else 1.0)
    with pytest.raises(RecordingError, match=told):
        calibrate_poses(robot, [replace(poses, target=target, others=others)])
