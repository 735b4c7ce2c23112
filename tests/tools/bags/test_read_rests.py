# SPDX-License-Identifier: BSD-3-Clause
"""Known loads of a bag that cannot hang on the robot are refused in a sentence."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.angle_units import check_angle_units
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.tools.bags.at_poses.load_table import check_loads
from jointscope.tools.bags.at_poses.read_rests import _must_be_of, read_rests
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

ROBOT = load_robot("biorob")
DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
needs_biorob = pytest.mark.skipif(not DATA.is_dir(), reason="shared/data/biorob is not beside the project")


def refused(forces, link):
    with pytest.raises(RecordingError) as err:
        check_loads("bench: topic /load", ROBOT, np.atleast_2d(forces), [link], "header.frame_id")
    return str(err.value)


def test_a_force_on_a_link_is_fine():
    check_loads("bench", ROBOT, np.array([[0.0, 3.0, -2.0]]), ["attachment"], "column link")


def test_a_frame_that_is_not_in_the_urdf_is_answered_with_the_right_one():
    assert refused([0.0, 1.0, 0.0], "atachment") == (
        "bench: topic /load: no link 'atachment' in biorob.urdf; did you mean 'attachment'?; header.frame_id names the "
        "link at whose origin the force acts"
    )


def test_grams_are_no_newtons():
    assert refused([0.0, 0.0, -1500.0], "attachment") == (
        "bench: topic /load: a force of 1500 N on a robot that weighs 23.8 N; expected newton: kilograms times 9.81, "
        "grams times 0.00981"
    )


def test_what_is_no_number_is_refused():
    assert "a force is no number; remove these messages" in refused([np.nan, 0.0, 0.0], "attachment")


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A bag without /load, whose weights somebody wrote down, and its recording."""
    told, bag = DATA / "static_gravity" / "gravity", tmp_path_factory.mktemp("bench") / "bench.mcap"
    write_bag(bag, read_recording(told, ROBOT), ROBOT)
    return bag, read_recording(bag, ROBOT)


def written(bench, *lines):
    bag = bench[0]
    bag.with_name("bench.loads.csv").write_text("\n".join(lines) + "\n")
    return read_rests(bag, ROBOT)


def refusal(bench, *lines):
    with pytest.raises(RecordingError) as err:
        written(bench, *lines)
    return str(err.value).split("bench.loads.csv: ", 1)[1]


@needs_biorob
def test_rows_hold_until_the_next(bench):
    rests = written(bench, "time,link,mass", "0,,0", "60,attachment,0.5", "120,attachment,0.0")
    begin = rests.times[:, 0]
    assert {*rests.links} == {"", "attachment"}
    for force, link, t in zip(rests.forces, rests.links, begin, strict=True):
        hangs = 60.0 <= t < 120.0
        assert link == ("attachment" if hangs else "")
        np.testing.assert_allclose(force, [0.0, 0.0, -0.5 * 9.81 * hangs], atol=1e-12)
    assert any("bench.loads.csv" in notice.text for notice in rests.notices)


@needs_biorob
def test_stamps_and_forces_are_understood(bench):
    start = bench[1].start_ns / 1e9
    rests = written(bench, "time,link,fx,fy,fz", f"{start + 60:.6f},attachment,1.5,-2,0")
    late = rests.times[:, 0] > 60.5
    np.testing.assert_allclose(rests.forces[late], [[1.5, -2.0, 0.0]] * int(late.sum()))
    assert not np.any(rests.forces[rests.times[:, 1] < 59.0])


@needs_biorob
@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (("time,link", "0,attachment"), "no column 'fx'; expected time, link, and mass [kg] or fx, fy, fz [N]"),
        (("t,link,mass", "0,attachment,1"), "no column 'time'; "),
        (("time,link,mass,fz", "0,attachment,1,-9.81"), "columns mass and fz both say what hangs there; expected mass"),
        (
            ("time,link,mass", "0,atachment,1"),
            "no link 'atachment' in biorob.urdf; did you mean 'attachment'?; column link names the",
        ),
        (("time,link,mass", "0,,1"), "line 2, column link: expected the link that the load hangs on"),
        (("time,link,mass", "0,attachment,500"), "line 2, column mass: 500 kg on a robot of 2.43 kg; expected"),
        (("time,link,mass", "0,attachment,-1"), "line 2, column mass: expected kilograms, got -1"),
        (("time,link,mass", "0,attachment,heavy"), "line 2, column mass: expected a number, got 'heavy'"),
        (("time,link,mass", "5e5,attachment,1"), "line 2: a load at 500000 s, but the recording lasts from 0 to"),
        (("time,link,mass", "1,attachment,1", "1,attachment,2"), "two loads at 1 s; one holds until the next"),
        (("time;link;mass", "0;attachment;1,5"), "semicolons stand between the cells; expected commas, and points"),
        (("time\tlink\tmass", "0\tattachment\t1"), "tabs stand between the cells; expected commas"),
        (("time,link,mass", "0,attachment,1,5"), "line 2 has 4 cells, the first line 3; expected as many, and points"),
        (("time,link,mass",), "expected a line with the names of the columns and one per load, got 1 lines"),
    ],
)
def test_what_a_table_lacks_is_told(bench, lines, said):
    assert refusal(bench, *lines).startswith(said)


@needs_biorob
def test_a_table_beside_a_bag_with_loads_is_one_too_many(tmp_path):
    bag = tmp_path / "spring1"
    bag.symlink_to(DATA / "static_spring" / "spring1", target_is_directory=True)
    (tmp_path / "spring1.loads.csv").write_text("time,link,mass\n0,attachment,1\n")
    with pytest.raises(RecordingError, match=r"has the topic /load, and .*spring1\.loads\.csv says loads, too"):
        read_rests(bag, ROBOT)


@pytest.fixture(scope="module")
def in_degrees(tmp_path_factory):
    """Bags of the same rests with encoders in degrees: of both sides, of the links, of the motors."""
    folder = tmp_path_factory.mktemp("degrees")
    recording = read_recording(DATA / "static_gravity" / "gravity", ROBOT).between(0.0, 60.0)
    for name, sides in {
        "both": ("motor_encoder", "link_encoder"),
        "links": ("link_encoder",),
        "motors": ("motor_encoder",),
    }.items():
        turned = {side: replace(s, values=np.degrees(s.values)) for side in sides for s in [recording.streams[side]]}
        write_bag(folder / f"{name}.mcap", replace(recording, streams={**recording.streams, **turned}), ROBOT)
    return folder


@needs_biorob
@pytest.mark.parametrize(("name", "side"), [("both", "link"), ("links", "link"), ("motors", "motor")])
def test_angles_in_degrees_are_named_before_any_equilibrium_is_looked_for(in_degrees, name, side):
    with pytest.raises(RecordingError) as err:
        read_rests(in_degrees / f"{name}.mcap", ROBOT)
    said = str(err.value)
    assert "_position spans 1" in said and " rad; biorob.urdf allows " in said
    assert said.endswith(f"look like degrees: set `unit` of sensors.{side}_encoder in the robot file (now rad) to deg")


@needs_biorob
def test_without_limits_motors_and_links_tell_of_each_other(in_degrees, tmp_path):
    urdf = re.sub(r'type="revolute"', 'type="continuous"', ROBOT.tree.urdf.read_text(encoding="utf-8"))
    urdf = re.sub(r'lower="\S+" upper="\S+" ', "", urdf)
    (tmp_path / "free.urdf").write_text(urdf, encoding="utf-8")
    text = ROBOT.path.read_text(encoding="utf-8").replace("urdf: biorob.urdf", "urdf: free.urdf")
    (tmp_path / "free.yaml").write_text(text, encoding="utf-8")
    free = load_robot(tmp_path / "free.yaml")
    recording = read_recording(in_degrees / "motors.mcap", ROBOT)
    short = {name: replace(s, values=0.05 * s.values) for name, s in recording.streams.items()}  # within all turns
    with pytest.raises(
        RecordingError, match=r"motor_position moves 6\S+ times as far as joint\d.link_position, both as"
    ):
        check_angle_units(replace(recording, streams=short), free)
    check_angle_units(read_recording(DATA / "static_gravity" / "gravity", ROBOT), free)


def lasting(seconds):
    return SimpleNamespace(streams={"motor_angle": SimpleNamespace(times=np.array([0.0, seconds]))})


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (
            [-3600.0, -3590.0],
            "all 1 changes of the load are up to 3590 s before it begins; expected stamps on the clock",
        ),
        (
            [2.0, 3600.0],
            "1 loads are up to 3590 s after its end; expected stamps on the clock of the encoders, from 0 to 10",
        ),
    ],
)
def test_loads_on_another_clock_than_the_encoders_are_refused(times, said):
    loads = LoadHistory(np.array(times), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -9.81]]), ("", "hook"))
    with pytest.raises(RecordingError, match=f"bench: topic /load: by their header.stamp {said}"):
        _must_be_of(Path("bench"), lasting(10.0), loads)


@pytest.mark.parametrize("times", [[-1.0], [-1.0, 3.0], [0.0, 10.0]])
def test_a_load_that_was_said_before_the_recording_hangs_there(times):
    forces = np.arange(3.0 * len(times)).reshape(-1, 3)
    _must_be_of(Path("bench"), lasting(10.0), LoadHistory(np.array(times), forces, ("hook",) * len(times)))


@needs_biorob
def test_a_coupling_of_the_wrong_sign_is_named_beside_the_rests(tmp_path):
    text = ROBOT.path.read_text(encoding="utf-8").replace("joint3: 0.0120", "joint3: -0.0120")
    text = text.replace("urdf: biorob.urdf", f"urdf: {ROBOT.path.with_name('biorob.urdf')}")
    (tmp_path / "mirrored.yaml").write_text(text, encoding="utf-8")
    bag = DATA / "static_gravity" / "gravity"
    said = [notice.text for notice in read_rests(bag, load_robot(tmp_path / "mirrored.yaml")).notices]
    assert any("wrong sign in row 4, column 3" in text for text in said)
    assert not any("transmission" in notice.text for notice in read_rests(bag, ROBOT).notices)
