# SPDX-License-Identifier: BSD-3-Clause
"""`simulate --kind rests`: the bag, its truth and the next step; values that `calibrate --rests` finds; refusals."""

from __future__ import annotations

import json

import pytest
from two_levers import URDF, YAML

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_rests import read_rests
from jointscope.tools.command_line import main

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

TRUE = ["--effect", "link_mass@b:mass=0.2", "--set", "a.coulomb_torque=0.6", "--set", "b.coulomb_torque=0.3"]


@pytest.fixture
def rods(tmp_path):
    """Two rods with finer encoders than those of the other tests."""
    (tmp_path / "two.urdf").write_text(URDF)
    (tmp_path / "two.yaml").write_text(YAML.replace("sigma: 2.0e-3", "sigma: 2.0e-4"))
    return tmp_path / "two.yaml"


def assert_found(said, truth, within):
    """Values that are known within 3 sigma of the truth, and by a share of it."""
    found, true = (json.loads(path.read_text())["parameters"] for path in (said, truth))
    for name, share in within.items():
        error = abs(found[name]["value"] - true[name])
        assert error < 3.0 * found[name]["sigma"] and error < share * true[name], name


@pytest.mark.parametrize("ending", [".mcap", ".bag"])
def test_the_bag_holds_rests_with_their_loads_and_the_screen_names_the_next_step(tmp_path, capsys, ending):
    bag, said = tmp_path / f"bench{ending}", tmp_path / "said.json"
    options = ["--count", "2", "--weights", "0.05,0", "--hold", "0.7", "--seed", "4", "--encoder-rate", "100"]
    assert main(["simulate", "xl330_pendulum", "--kind", "rests", "-o", str(bag), *options, "--json", str(said)]) == 0
    out = capsys.readouterr().out
    assert f"{bag}: 4 rests of xl330_pendulum in " in out and "0.05, 0 kg at pendulum, seed 4" in out
    next_step = f"jointscope calibrate xl330_pendulum --rests {bag} -o xl330_pendulum_calibrated.yaml"
    assert out.endswith(f"  next:    {next_step}\n")
    truth = json.loads((tmp_path / "bench.truth.json").read_text())
    assert json.loads(said.read_text())["truth"] == truth and truth["weights"] == [0.05, 0.0]
    assert truth["sampling"]["encoder_rate"] == 100.0 and truth["at"] == "pendulum" and truth["hold"] == 0.7
    rests = read_rests(bag, load_robot("xl330_pendulum"))
    hung = [round(float(-force[2]) / 9.81, 6) for force in rests.forces]
    assert [hung[0], hung[-1]] == [0.05, 0.05] and 0.0 in hung
    for rest in truth["rests"]:
        seen = [i for i, (t0, t1) in enumerate(rests.times) if t0 <= rest["begin"] + 0.4 <= t1]
        assert len(seen) == 1 and abs(hung[seen[0]] - rest["mass"]) < 1e-6


def test_an_option_of_another_kind_and_what_cannot_be_is_refused_in_one_line(tmp_path, capsys):
    rests, bag = ["--kind", "rests"], str(tmp_path / "a.mcap")
    for robot, options, text in (
        (
            "biorob",
            [*rests, "--seconds", "3"],
            "--seconds is an option of --kind motion; this is --kind rests: leave it",
        ),
        ("biorob", [*rests, "--motion", "moves"], "--motion is an option of --kind motion; this is --kind rests"),
        ("biorob", [*rests, "--pose", "0,0,0,0"], "--pose is an option of --kind frequency; this is --kind rests"),
        ("biorob", ["--weights", "1"], "--weights is an option of --kind rests; this is --kind motion"),
        ("biorob", ["--count", "3"], "--count is an option of --kind rests, poses or frequency; this is --kind motion"),
        ("tx90l", ["--hold", "2"], "--hold is an option of --kind rests; this is --kind poses"),
        ("biorob", [*rests, "--weights", "light"], "--weights light: expected kilograms, for example 0,0.5,1"),
        ("biorob", [*rests, "--at", "attachmant"], "did you mean 'attachment'?"),
        ("biorob", [*rests, "--weights", "500"], "give lighter --weights, another --at, or a smaller --count"),
        ("biorob", [*rests, "--friction", "smooth"], "motors would slide for ever; expected dry"),
        ("doggy", [*rests, "--weights", "1"], "doggy has no gravity, so weights pull at nothing; leave out --weights"),
        ("tx90l", rests, "tx90l.yaml has no `command` and no `sensors`"),
        ("kr300", rests, "link_dynamics: free"),
    ):
        assert main(["simulate", robot, "-o", bag, *options]) == 1
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and text in error
    assert main(["simulate", "biorob", *rests, "-o", str(tmp_path / "a.csv")]) == 1
    assert "rests are a bag; expected .bag, .mcap, .db3 or a folder" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_rests_alone_and_beside_motion_give_springs_friction_and_weight_back(rods, capsys):
    folder, rests, moves = rods.parent, str(rods.parent / "rests.mcap"), str(rods.parent / "moves.mcap")
    bench = ["--kind", "rests", "--count", "15", "--weights", "0,0.5", "--seed", "1"]
    assert main(["simulate", str(rods), "-o", rests, *bench, *TRUE]) == 0
    assert (
        main(["simulate", str(rods), "-o", moves, "--seconds", "5", "--seed", "1", "--friction", "smooth", *TRUE]) == 0
    )
    files = ["-o", str(folder / "a.yaml"), "--json", str(folder / "a.json")]
    capsys.readouterr()
    assert main(["calibrate", str(rods), "--rests", rests, *files]) == 0
    assert "Yes, the model holds at these rests" in capsys.readouterr().out
    springs = {"a.stiffness": 2e-3, "b.stiffness": 2e-3, "b.link_mass.mass": 0.02}
    truth = folder / "rests.truth.json"
    assert_found(folder / "a.json", truth, springs | {"a.coulomb_torque": 0.05, "b.coulomb_torque": 0.15})
    files = ["-o", str(folder / "b.yaml"), "--json", str(folder / "b.json")]
    assert main(["calibrate", str(rods), moves, "--rests", rests, *files]) == 0
    sharp = {"a.stiffness": 1e-4, "b.stiffness": 1e-4, "a.coulomb_torque": 2e-3, "b.coulomb_torque": 2e-3}
    assert_found(folder / "b.json", truth, sharp | {"b.link_mass.mass": 1e-3})


@pytest.mark.slow
def test_a_rigid_ready_robot_gets_its_friction_and_gain_back(tmp_path):
    bag, said = tmp_path / "bench.mcap", tmp_path / "said.json"
    bench = ["--kind", "rests", "--weights", "0,0.1", "--seed", "1", "--set", "servo.coulomb_torque=0.035"]
    assert main(["simulate", "xl330_pendulum", "-o", str(bag), *bench]) == 0
    files = ["-o", str(tmp_path / "a.yaml"), "--json", str(said)]
    assert main(["calibrate", "xl330_pendulum", "--rests", str(bag), *files]) == 0
    assert_found(said, tmp_path / "bench.truth.json", {"motor.k_pwm": 0.03, "servo.coulomb_torque": 0.2})


@pytest.mark.slow
def test_a_spring_that_hardens_is_discovered_at_rest(rods, capsys):
    rests, said = str(rods.parent / "rests.mcap"), rods.parent / "found.json"
    bench = ["--kind", "rests", "--count", "12", "--weights", "0,0.5", "--seed", "5", *TRUE]
    assert main(["simulate", str(rods), "-o", rests, *bench, "--effect", "spring_cubic@a:stiffness=3000"]) == 0
    found = ["discover", str(rods), "--rests", rests, "-o", str(rods.parent / "found.yaml"), "--json", str(said)]
    assert main(found) == 0
    robot = load_robot(rods.parent / "found.yaml")
    assert "spring_cubic@a" in [here.label for here in robot.effects] and not robot.has_effect("spring_cubic", "b")
    assert robot.parameter("a.spring_cubic.stiffness").value == pytest.approx(3000.0, rel=0.02)
