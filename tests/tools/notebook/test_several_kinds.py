# SPDX-License-Identifier: BSD-3-Clause
"""`js.diagnose` and `js.discover` with several kinds of recordings of a lever: answers, files, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from lever_bench import hanging, lever, lever_in_sight

import jointscope as js
from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.tools.notebook.given import robot_of
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

DRIFT = "tracker_drift@robot:x=1e-4,z=0"


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """The rigid lever with a target."""
    return lever_in_sight(tmp_path_factory.mktemp("seen"))


@pytest.fixture(scope="module")
def given(seen):
    """Rests with loads that are a tenth smaller than they were, and poses with a tracker that drifts."""
    rests = hanging(40, 3, rigid=True)
    (poses, others) = (
        simulate_poses(seen, n, 3, PoseConditions(effects=[DRIFT], perfect=True), name)[0]
        for n, name in ((40, "poses"), (20, "others"))
    )
    return {
        "rests": [replace(rests, forces=0.9 * rests.forces)],
        "poses": [replace(poses, sha256="a")],
        "holdout_poses": [replace(others, sha256="b")],
    }


def test_rests_and_poses_are_diagnosed_in_one_call(seen, given, tmp_path):
    found = js.diagnose(seen, [], **given)
    missing = {row["effect"]: row["shown_by"] for row in found.rows() if row["verdict"] == "missing"}
    assert missing == {"load_scale@robot": "rests", "tracker_drift@robot": "poses"}
    assert "load_scale@robot, shown by rests" in found.answer() and "tracker_drift@robot, shown by" in repr(found)
    found.save(json=tmp_path / "found.json")
    content = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert not content["adequate"] and content["by_graph"]["arm"]["heldout_error"] > 1.5  # the drift is not there yet
    with pytest.raises(RobotError, match="without motion, `diagnose` of several kinds has text and --json"):
        found.save(report=tmp_path / "found.html")


@pytest.mark.slow
def test_one_model_is_grown_in_one_call_and_saved(seen, given, tmp_path):
    found = js.discover(seen, [], **given)
    steps = [row["step"] for row in found.rows()]
    assert steps[0] == "base model" and set(steps[1:]) == {"+ load_scale@robot", "+ tracker_drift@robot"}
    assert found.rows()[-1]["heldout_poses"] < 1.3 < found.rows()[0]["heldout_poses"]
    assert "Nothing of the catalogue is missing in rests and poses" in found.answer() or found.adequate
    drift = found.robot.parameters["tracker.tracker_drift.x"]
    assert abs(drift.value - 1e-4) < 3.0 * drift.sigma and drift.sigma < 2e-5
    files = {"json": tmp_path / "found.json", "report": tmp_path / "found.html"}
    found.save(seen.path.with_name("found.yaml"), **files)
    again = js.load_robot(seen.path.with_name("found.yaml"))
    assert again.parameters[drift.name].value == pytest.approx(drift.value)
    content = json.loads(files["json"].read_text(encoding="utf-8"))
    # rests of motors alone have an error in parts of the friction, whose floor is zero
    assert content["steps"][-1]["floor"] == pytest.approx(0.5**0.5) and content["adequate"]
    assert "What was missing" in files["report"].read_text(encoding="utf-8")
    assert isinstance(found, KindsDiscovery) and robot_of(found) is found.robot


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"rests": ["w.mcap"]}, "expected two or all of motion, rests, and poses or frequency responses; rests alone"),
        ({"poses": ["p.csv"], "rests": "w.mcap"}, "rests: expected a list of paths or recordings, got str"),
        ({"poses": [3], "rests": []}, "expected two or all of motion"),
        (
            {"poses": ["p.csv"], "rests": ["w.mcap"], "holdout": "m.mcap"},
            "holdout and leave_out are of motion",
        ),
        ({"poses": ["p.csv"], "rests": [3]}, "rests: expected a path or Rests, got int"),
    ],
)
def test_what_is_not_enough_or_no_recording_is_refused(seen, words, told):
    for verb in (js.diagnose, js.discover):
        with pytest.raises(RecordingError) as error:
            verb(seen, [], **words)
        assert str(error.value).startswith(told)


def test_what_is_learnt_from_is_not_held_out(seen, given):
    twice = given | {"holdout_poses": given["poses"]}
    with pytest.raises(RecordingError, match=r"simulation is held out and also learnt from \(simulation\)"):
        js.discover(seen, [], **twice)
    alone = given | {"poses": [], "holdout_rests": given["rests"]}
    with pytest.raises(RecordingError, match="expected two or all of motion, rests"):
        js.discover(seen, [], **alone)


def test_options_of_motion_alone_are_refused(seen, given):
    with pytest.raises(RecordingError, match="save, resume: a search over several kinds keeps no steps"):
        js.discover(seen, [], **given, resume=[])
    with pytest.raises(RobotError, match=r"lever.yaml has no section `?poses"):
        js.diagnose(lever(seen.path.parent / "..", rigid=True), [], **given)
