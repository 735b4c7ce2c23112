# SPDX-License-Identifier: BSD-3-Clause
"""Several targets on the tool of an arm in MuJoCo: right values, one state for each pose, targets that are not seen."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice

import numpy as np
import pinocchio as pin
import pytest
from slopes_of_rows import checked_slopes
from tools_with_targets import tool_with

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import _estimate, calibrate_poses
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.graphs.poses.tracker_start import placed
from jointscope.graphs.poses.trimmed_poses import with_fitted
from jointscope.graphs.poses.what_moved import what_moved
from jointscope.graphs.rest_sets.independent_states import reduced
from jointscope.graphs.solving.batch_solver import solve
from jointscope.robots.errors import RecordingError, SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
WRIST = ("joint4.mis_x", "joint5.lx", "joint5.mis_x", "joint6.mis_x")


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return tool_with(tmp_path_factory.mktemp("tool"))


@pytest.fixture(scope="module")
def simulated(robot):
    return simulate_poses(robot, 30, 3)


@pytest.fixture(scope="module")
def oriented(robot):
    return simulate_poses(robot, 12, 3, PoseConditions(orientation=True))[0]


@pytest.fixture(scope="module")
def result(robot, simulated):
    return calibrate_poses(robot, [simulated[0]])


def with_holes(poses, seed=1):
    """Each target hidden in a third of the poses, but never all of them."""
    rng = np.random.default_rng(seed)
    hidden = rng.integers(0, 3, len(poses))
    place, others = poses.target.copy(), list(poses.others)
    place[hidden == 0] = np.nan
    turn = None if poses.turn is None else np.where((hidden == 0)[:, None, None], np.nan, poses.turn)
    for k, other in enumerate(others):
        seen = np.where((hidden == k + 1)[:, None], np.nan, other.place)
        turned = None if other.turn is None else np.where((hidden == k + 1)[:, None, None], np.nan, other.turn)
        others[k] = replace(other, place=seen, turn=turned)
    return replace(poses, target=place, turn=turn, others=tuple(others))


def test_derivatives_of_all_rows_are_those_of_what_is_missed(robot, oriented):
    problem, columns, missed = checked_slopes(robot, with_holes(oriented))
    unseen = ~problem.targets.there
    assert not any(np.any(column[unseen]) for column in columns.values()) and not np.any(missed[unseen])


def test_rows_of_one_pose_share_what_its_transmissions_do(robot, oriented):
    """Eliminating the states of a pose is the same as weighting its rows by their full covariance."""
    robot, (problem,) = placed(robot, [with_holes(oriented)])
    e, calibration = problem.start(Calibration.of(robot))
    H, g = reduced(problem.linearize(e, calibration))
    point = problem.point(calibration)
    J, r, C = problem.columns(point, calibration), problem.misses(point, calibration), problem.covariances(point)
    expected = sum(a.T @ np.linalg.solve(c, a) for a, c in zip(J, C, strict=True))
    slope = sum(a.T @ np.linalg.solve(c, b) for a, b, c in zip(J, r, C, strict=True))
    np.testing.assert_allclose(H, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(g, slope, atol=1e-9 * np.abs(slope).max())


def test_places_on_the_tool_are_found_also_where_nobody_gives_them(result, simulated):
    truth, parameters = simulated[1]["parameters"], result.robot.parameters
    for name in ("left.lx", "left.ly", "left.lz", "right.lx", "right.ly", "right.lz", *WRIST):
        assert abs(parameters[name].value - truth[name]) < 3.0 * parameters[name].sigma, name
    assert abs(truth["right.lx"]) > 0.01
    assert tip_errors(result.problems[0], result.calibrations[0]).to_json()["rms_mm"] < 0.06
    assert list(tip_errors(result.problems[0], result.calibrations[0]).of_targets) == ["reflector", "left", "right"]


def test_poses_that_were_not_fitted_are_met_as_well_as_the_result_says(result, robot):
    """By their whitened distance: noise, transmissions and the covariance of the result together."""
    others, _ = simulate_poses(robot, 60, 3, session="others")
    robot, (problem,) = placed(result.robot, [others])
    _, calibration = problem.start(Calibration.of(robot))
    point = problem.point(calibration)
    J, r = problem.columns(point, calibration), problem.misses(point, calibration)
    told = problem.covariances(point) + J @ result.covariance @ np.swapaxes(J, 1, 2)
    squares = np.einsum("mi,mi->m", r, np.linalg.solve(told, r[:, :, None])[:, :, 0])
    assert 0.85 < squares.mean() / 9.0 < 1.15
    assert tip_errors(problem).to_json()["rms_mm"] < 0.05


def test_more_targets_tell_more_of_the_wrist(result, simulated):
    one = calibrate_poses(load_robot("tx90l"), [replace(simulated[0], others=())])
    for name in WRIST:
        assert result.robot.parameters[name].sigma < 0.9 * one.robot.parameters[name].sigma


def test_targets_need_not_be_seen_in_every_pose(robot, simulated):
    poses = with_holes(simulated[0])
    found = calibrate_poses(robot, [poses])
    assert found.problems[0].measured == 6 * len(poses) and len(found.left_out) == 0
    truth = simulated[1]["parameters"]
    for name in ("left.lx", "right.ly", *WRIST):
        p = found.robot.parameters[name]
        assert abs(p.value - truth[name]) < 3.5 * p.sigma, name


def test_the_tracker_is_placed_by_whatever_target_is_known(tmp_path, simulated):
    robot = tool_with(tmp_path)
    open_robot = replace(robot, poses=replace(robot.poses, tracker=None, tracker_link=None))
    hidden = replace(simulated[0], target=np.full_like(simulated[0].target, np.nan))
    found = calibrate_poses(open_robot, [hidden])
    assert tip_errors(found.problems[0], found.calibrations[0]).to_json()["rms_mm"] < 0.06
    nothing_known = replace(hidden, others=hidden.others[1:])
    with pytest.raises(RecordingError, match="no target is seen whose place on the tool is known"):
        calibrate_poses(open_robot, [nothing_known])


def elsewhere(poses):
    """What a tracker sees that stands somewhere else."""
    T = pin.SE3(pin.exp3(np.array([0.3, -0.8, 0.5])), np.array([0.4, -0.2, 0.1]))
    R, t = T.rotation, T.translation
    return replace(
        poses,
        target=poses.target @ R.T + t,
        turn=None if poses.turn is None else R @ poses.turn,
        others=tuple(
            replace(o, place=o.place @ R.T + t, turn=None if o.turn is None else R @ o.turn) for o in poses.others
        ),
    )


def test_a_tracker_that_was_moved_between_sessions_is_estimated_with_the_arm(robot, simulated):
    """The first fit of the nominal arm places it within a tenth of a millimetre only."""
    open_robot = replace(robot, poses=replace(robot.poses, tracker=None, tracker_link=None))
    other = elsewhere(simulate_poses(robot, 30, 3, PoseConditions(orientation=True), session="others")[0])
    found = calibrate_poses(open_robot, [simulated[0], other])
    assert [problem.own_tracker for problem in found.problems] == [True, True]
    assert len(found.left_out) < 3 and found.repeatability < 1.5
    assert all(errors.to_json()["rms_mm"] < 0.06 for errors in found.errors)
    truth = simulated[1]["parameters"]
    for name in ("left.lx", "right.ly", *WRIST):
        p = found.robot.parameters[name]
        assert abs(p.value - truth[name]) < 3.5 * p.sigma, name


def test_derivatives_by_the_pose_of_a_tracker_are_those_of_what_is_missed(robot, oriented):
    open_robot = replace(robot, poses=replace(robot.poses, tracker=None, tracker_link=None))
    open_robot, (_, problem) = placed(open_robot, [oriented, elsewhere(with_holes(oriented))])
    _, calibration = problem.start(Calibration.of(open_robot))
    J = problem.columns(problem.point(calibration), calibration)[:, :, calibration.columns["tracker_pose"]]

    def missed(step):
        at = calibration.retract({"tracker_pose": step})
        return problem.misses(problem.point(at), at)

    for i in range(6):
        d = 1e-6 * np.eye(6)[i]
        np.testing.assert_allclose(J[:, :, i], (missed(d) - missed(-d)) / 2e-6, atol=1e-6)


def test_one_target_alone_is_computed_as_ever(robot, simulated):
    """To the last bit: a robot with further targets and poses that show the first one only, and the ready robot."""
    alone = replace(simulated[0], others=())
    plain, wide = (PoseSet(r, alone, r.poses.tracker) for r in (load_robot("tx90l"), robot))
    systems = []
    for problem in (plain, wide):
        e, calibration = problem.start(Calibration.of(problem.robot))
        mine = [calibration.names.index(n) for n in Calibration.of(plain.robot).names]
        system = problem.linearize(e, calibration)
        systems.append((system.D, system.g_x, system.B[:, :, mine], system.g_p[mine], np.array(system.cost)))
    for one, other in zip(*systems, strict=True):
        np.testing.assert_array_equal(one, other)


def test_sigmas_are_honest_in_twenty_arms(robot):
    z = []
    for seed in range(20):
        poses, truth = simulate_poses(robot, 25, seed, PoseConditions(orientation=seed % 2 == 1))
        found = calibrate_poses(robot, [with_holes(poses, seed)])
        for name in (*WRIST, "joint3.mis_x", "joint3.lz", "joint1.mis_y", "joint1.mis_x", "joint2.mis_x"):
            p = found.robot.parameters[name]
            z.append((p.value - truth["parameters"][name]) / p.sigma)
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.15 and np.mean(np.abs(z) < 2.0) > 0.91


def test_exchanged_names_and_lost_targets_are_told(robot, simulated):
    poses = simulated[0]
    left, right = poses.others
    exchanged = replace(poses, target=left.place, others=(replace(left, place=poses.target), right))
    with pytest.raises(RecordingError, match="the targets reflector and left seem to be exchanged"):
        calibrate_poses(robot, [exchanged])
    lost = replace(right, place=np.where(np.arange(30)[:, None] == 7, 0.0, right.place))
    with pytest.raises(RecordingError, match="the target right is at exactly zero in pose 7: the tracker had lost it"):
        calibrate_poses(robot, [replace(poses, others=(left, lost))])
    with pytest.raises(
        RecordingError, match=r"the target 'top' is none of tool.yaml, which has reflector, left, right"
    ):
        calibrate_poses(robot, [replace(poses, others=(replace(left, name="top"), right))])


def test_rows_of_several_targets_that_nothing_names_are_told(tmp_path, simulated):
    wide = tool_with(tmp_path, "left: {at: [0.2, 0.0, 0.03]}")
    poses = simulate_poses(wide, 20, 3)[0]
    every_other = np.where(np.arange(20)[:, None] % 2 == 0, poses.target, poses.others[0].place)
    with pytest.raises(RecordingError, match=r"has the targets reflector, left, but all rows count as reflector: say"):
        calibrate_poses(wide, [replace(poses, target=every_other, others=())])


def test_a_target_in_another_place_on_the_tool_is_told_with_the_place(tmp_path, simulated):
    wrong = tool_with(tmp_path, "left: {at: [0.2, 0.0, 0.03]}")
    with pytest.raises(RecordingError, match=r"left is not where tool.yaml has it on the tool.*at \[0.0794, .* leave"):
        calibrate_poses(wrong, [replace(simulated[0], others=simulated[0].others[:1])])


@pytest.mark.parametrize("size", [1e-3, 3e-3])
def test_a_target_that_a_reflection_moved_is_left_out_alone(robot, simulated, size):
    left, right = simulated[0].others
    place = left.place.copy()
    place[[4, 11]] += [0.0, size, 0.0]
    found = calibrate_poses(robot, [replace(simulated[0], others=(replace(left, place=place), right))])
    assert sorted(each.name for each in found.left_out) == ["11 (left)", "4 (left)"]
    assert found.count == 30 and found.problems[0].measured == 3 * (90 - 2)
    truth = simulated[1]["parameters"]
    for name in ("left.lx", "left.ly", *WRIST):
        assert abs(found.robot.parameters[name].value - truth[name]) < 3.5 * found.robot.parameters[name].sigma, name


def test_angles_that_are_off_take_the_whole_pose_with_them(robot, simulated):
    q = simulated[0].q.copy()
    q[11, 1] += 3e-3
    assert [each.name for each in calibrate_poses(robot, [replace(simulated[0], q=q)]).left_out] == ["11"]


def test_a_target_that_comes_loose_is_named_as_the_one(robot, simulated):
    left, right = simulated[0].others
    place = left.place + 2e-3 * np.random.default_rng(1).standard_normal((30, 3))
    with pytest.raises(
        SolveError, match=r"left does not fit in .* of the 30 poses that show it, while other targets do, as"
    ):
        calibrate_poses(robot, [replace(simulated[0], others=(replace(left, place=place), right))])


def test_targets_that_are_wrong_in_some_poses_are_told_with_these_poses(robot, simulated):
    poses = simulated[0]
    left, right = poses.others
    some = np.isin(np.arange(30), [3, 9, 20])[:, None]
    exchanged = replace(
        poses,
        target=np.where(some, left.place, poses.target),
        others=(replace(left, place=np.where(some, poses.target, left.place)), right),
    )
    with pytest.raises(RecordingError, match="targets reflector and left seem to be exchanged in pose 3, 9, 20: the"):
        calibrate_poses(robot, [exchanged])
    for k, other in enumerate((left, right)):
        far = replace(other, place=other.place + 0.6 * (np.arange(30) == 7)[:, None])
        others = (far, right) if k == 0 else (left, far)
        with pytest.raises(RecordingError, match=f"target {other.name} is off by up to .* mm in pose 7 and fits in"):
            calibrate_poses(robot, [replace(poses, others=others)])
        milli = (
            (replace(left, place=1e3 * left.place), right)
            if k == 0
            else (left, replace(right, place=1e3 * right.place))
        )
        with pytest.raises(RecordingError, match=f"places of {other.name} are about 1000 times as far apart as those"):
            calibrate_poses(robot, [replace(poses, others=milli)])


@pytest.mark.parametrize("size", [3e-4, 1e-3])
def test_a_target_that_slips_on_the_tool_is_named_with_the_pose_from_which_on(robot, simulated, size):
    """Its shift on the tool, in axes that the kinematics of pinocchio turn."""
    poses = simulated[0]
    R, late = robot.tree.body_poses("reflector", poses.q)[0], np.arange(30) >= 13
    left, right = poses.others
    slipped = replace(left, place=left.place + late[:, None] * (R @ [0.6 * size, 0.0, 0.8 * size]))
    step = step_of(robot, replace(poses, others=(slipped, right)))
    assert (step.target, step.turned, step.before, step.after) == ("left", False, "12", "13")
    assert abs(step.size - size) < 0.2 * size


def test_a_target_that_turns_on_the_tool_is_named_and_so_is_a_tracker_that_moves(robot):
    poses = simulate_poses(robot, 30, 3, PoseConditions(orientation=True))[0]
    left, right = poses.others
    late = (np.arange(30) >= 13)[:, None, None]
    turned = replace(left, turn=np.where(late, left.turn @ pin.exp3(np.array([0.0, 2e-3, 0.0])), left.turn))
    step = step_of(robot, replace(poses, others=(turned, right)))
    assert (step.target, step.turned, step.after) == ("left", True, "13") and abs(step.size - 2e-3) < 4e-4
    shift = late[:, 0] * np.array([3e-4, 0.0, 4e-4])
    others = tuple(replace(other, place=other.place + shift) for other in poses.others)
    step = step_of(robot, replace(poses, target=poses.target + shift, others=others))
    assert (step.target, step.after) == ("", "13") and abs(step.size - 5e-4) < 1e-4
    assert step_of(robot, poses) is None


def step_of(robot, poses):
    """What moved, as a calibration from these poses or its refusal says."""
    try:
        found = calibrate_poses(robot, [poses])
    except SolveError as err:
        robot, problems = placed(robot, [poses])
        known = solve(problems, _estimate(problems, (), ()), max_iterations=400, progress=None).estimate.calibrations
        step = what_moved(LinearPoses.at(with_fitted(robot, known), problems, known), problems, known)
        assert step.text in str(err)
        return step
    return what_moved(LinearPoses.of(found), found.problems, found.calibrations)


def test_balls_in_sockets_may_be_several_and_each_is_found_on_the_tool(tmp_path):
    """Angles from the kinematics of pinocchio, turned until the ball that is named is in its socket."""
    robot = tool_with(tmp_path, "low: {}", "  tool_sigma: 0.15\n  contact_distance: 0.05\n")
    tree, rng = robot.tree, np.random.default_rng(4)
    at = {"": np.array([0.01, -0.02, 0.03]), "low": np.array([0.09, 0.02, -0.04])}
    q, contacts, held, places = [], [], [], []
    for i, place in enumerate(("left", "right", "high", "far")):
        corner = np.array([0.5, 0.4 - 0.3 * i, 0.3 + 0.2 * (i % 2)])
        for k in (0, 1):
            socket, name = corner + 0.05 * k * np.eye(3)[i % 3], f"{place}{k}"
            places.append((name, place))
            for ball in ("", "low"):
                tried = (in_socket(tree, at[ball], socket, rng) for _ in range(60))
                found = list(islice((angles for angles in tried if angles is not None), 4))
                q += found
                contacts += [name] * len(found)
                held += [ball or "reflector"] * len(found)
    q = np.array(q) + 2e-5 * rng.standard_normal((len(q), 6))
    names = tuple(map(str, range(len(q))))
    poses = Poses("sockets", "", names, q, None, tuple(contacts), tuple(places), held=tuple(held))
    rigid = {n: p for n, p in robot.parameters.items() if "stiffness" not in n and "backlash" not in n}
    found = calibrate_poses(replace(robot, parameters=rigid), [poses])
    for owner, place in (("tool", at[""]), ("low", at["low"])):
        for part, value in zip(("lx", "ly", "lz"), place, strict=True):
            p = found.robot.parameters[f"{owner}.{part}"]
            assert abs(p.value - value) < 3.5 * p.sigma < 4e-3, p.name
    errors = tip_errors(found.problems[0], found.calibrations[0])
    assert set(errors.of_targets) == {"reflector", "low"} and errors.to_json()["rms_mm"] < 0.1


def in_socket(tree, ball, socket, rng):
    """Angles that bring a point of the tool into a socket, from anywhere; None where that does not end."""
    q = rng.uniform(-1.5, 1.5, 6)
    for _ in range(40):
        ends = [tree.body_poses("reflector", (q + d)[None]) for d in (*(1e-6 * np.eye(6)), np.zeros(6))]
        points = np.array([R[0] @ ball + p[0] for R, p in ends])
        J = (points[:6] - points[6]).T / 1e-6
        q = q - np.clip(np.linalg.pinv(J) @ (points[6] - socket), -0.5, 0.5)
    R, p = tree.body_poses("reflector", q[None])
    return q if np.linalg.norm(R[0] @ ball + p[0] - socket) < 1e-9 and np.abs(q).max() < 2.2 else None


@pytest.mark.parametrize("anew", [False, True])
def test_two_balls_without_names_are_told_with_their_places_and_poses(tmp_path, anew):
    """On an arm whose errors are as large as those of real ones: their places come out to some millimetres."""
    more = "  tool_sigma: 0.15\n  contact_distance: 0.05\n"
    robot, single = tool_with(tmp_path / "two", "low: {}", more), tool_with(tmp_path / "one", "", more)
    at, rng = (
        {"reflector": np.array([0.01, -0.02, 0.03]), "low": np.array([0.06, 0.02, 0.01])},
        np.random.default_rng(4),
    )
    q, contacts, held = [], [], []
    for i in range(6):
        for ball in at if not anew else (list(at)[i // 3],):
            socket = np.array([0.5, 0.4 - 0.15 * i, 0.3 + 0.2 * (i % 2)])
            tried = (in_socket(robot.tree, at[ball], socket, rng) for _ in range(90))
            found = list(islice((angles for angles in tried if angles is not None), 6))
            q += found
            contacts += [f"socket{i}"] * len(found)
            held += [ball] * len(found)
    names = tuple(map(str, range(len(q))))
    poses = Poses(
        "sockets", "", names, np.array(q), None, tuple(contacts), tuple((c, c) for c in dict.fromkeys(contacts))
    )
    for each in (robot, single):
        errors = {
            n: p.prior_sigma * rng.standard_normal() for n, p in each.parameters.items() if ".l" in n and n[0] == "j"
        }
        with pytest.raises(RecordingError) as told:
            calibrate_poses(each.with_values(errors), [poses])
        text = str(told.value)
        found = [np.array(s.split(","), float) for s in re.findall(r"at \[(.*?)\]", text)]
        assert np.linalg.norm(np.array(found) - np.array(list(at.values())), axis=1).max() < 0.02
        assert ("in contact socket0, socket1, socket2, at" in text) is anew
        assert ("add a column `target`" in text) is (each is robot) and "two different targets" in text
    named = replace(poses, held=tuple(held))
    rigid = {n: p for n, p in robot.parameters.items() if "stiffness" not in n and "backlash" not in n}
    assert calibrate_poses(replace(robot, parameters=rigid), [named]).count == len(q)
