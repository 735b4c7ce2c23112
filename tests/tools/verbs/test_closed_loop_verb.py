# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope closed-loop` as a user meets it: screen, JSON, report, viewer's file, bag, and errors in one line."""

import json

import numpy as np
import pytest
from holding_estimator import HoldingEstimator
from result_page import ResultPage

from jointscope.graphs.fixed_lag import estimator as estimator_module
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main, verbs
from jointscope.tools.report.sections.closed_loop.loop_answer import loop_judgement

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

SHORT = ["closed-loop", "doggy", "--seconds", "3", "--seed", "3"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """One run of the verb with all files and an estimator for tests: its folder and what was on the screen."""
    import contextlib
    import io

    folder, screen = tmp_path_factory.mktemp("loop"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(screen):
        patch.setattr(estimator_module, "FixedLagEstimator", HoldingEstimator)
        files = [f"--{name}={folder / f'loop.{name}'}" for name in ("json", "rrd")]
        arguments = [*SHORT, *files, f"--report={folder / 'loop.html'}", "-o", str(folder / "loop.mcap")]
        assert main([*arguments, "--effect", "bearing_flexibility@joint1"]) == 0
    return folder, screen.getvalue()


def test_the_verb_is_listed_with_a_hyphen():
    assert verbs()["closed-loop"] == "runs controllers in the simulator, with and without the estimator"


def test_the_screen_shows_every_controller_with_every_source(written):
    folder, screen = written
    assert "hidden effects: bearing_flexibility@joint1" in screen
    for controller in ("P", "state feedback"):
        for source in ("true state", "estimator", "encoders"):
            assert any(
                line.split()[: len(f"{controller} {source}".split())] == f"{controller} {source}".split()
                for line in screen.splitlines()
            ), (controller, source)
    assert "holds the run of state feedback, estimator" in screen
    assert "alarms: imu1.x" in screen
    for file in ("loop.json", "loop.rrd", "loop.html", "loop.mcap", "loop.truth.json"):
        assert file in screen
        assert (folder / file).stat().st_size > 1000


def test_the_json_says_the_same_for_machines(written):
    content = json.loads((written[0] / "loop.json").read_text())
    runs = {(run["controller"], run["source"]): run for run in content["runs"]}
    assert len(runs) == 6
    feedback, p = runs["state_feedback", "true"], runs["p", "true"]
    assert feedback["hit_position_rms"] < 0.1 * p["hit_position_rms"]
    assert feedback["estimation_rms"]["v_link"] == 0.0
    assert len(feedback["hits"]) == len(content["hits"]) >= 1
    account = runs["p", "estimator"]["estimator"]
    assert set(account["update_ms"]) == {"p50", "p99", "max"}
    assert account["alarms"] == ["imu1.x"]
    assert account["dropped"] == {"imu1": {"late": 2}}
    assert content["truth"]["effects"][0]["effect"] == "bearing_flexibility"


def test_the_report_is_a_whole_page_with_all_numbers(written):
    page = ResultPage((written[0] / "loop.html").read_text())
    page.check()
    assert page.ids[:1] != []
    for section in ("answer", "scores", "hits", "errors", "knowledge", "commands", "setup", "provenance"):
        assert section in page.ids
    content = json.loads((written[0] / "loop.json").read_text())
    best = next(r for r in content["runs"] if (r["controller"], r["source"]) == ("state_feedback", "true"))
    assert f"{1e3 * best['hit_position_rms']:.3g}" in page.text
    assert "joint1.bearing_flexibility.compliance_x" in page.text
    assert "2.5 times the full command per rad" in page.text
    assert "larger innovations than its model allows in imu1.x" in page.text


def test_the_bag_can_be_read_and_holds_the_commands_of_the_loop(written):
    robot = load_robot("doggy")
    recording = read_recording(written[0] / "loop.mcap", robot)
    assert set(recording.streams) == {"command", *robot.sensors}
    assert len(recording.command) == 3000
    assert np.abs(recording.command.values).max() > 0.1
    truth = json.loads((written[0] / "loop.truth.json").read_text())
    assert truth["motion"] == "hits"


def test_the_viewers_file_has_errors_commands_and_heads(written):
    from rerun.chunk import RrdReader

    paths = set(map(str, RrdReader(str(written[0] / "loop.rrd")).store().schema().entity_paths()))
    for path in (
        "/findings",
        "/loops/p/head/true",
        "/loops/state_feedback/joint2/link_error/estimator",
        "/loops/state_feedback/joint3/command/encoders",
        "/robot/heads/state_feedback/estimator/now",
        "/robot/hits",
    ):
        assert path in paths, path


def test_a_poor_estimator_is_called_poor(written):
    """The estimator for tests holds links still; the answer must not praise it."""
    page = ResultPage((written[0] / "loop.html").read_text())
    assert "no closer than with differentiated encoders" in page.text
    assert 'class="verdict bad"' in page.html


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--seconds", "1.2"], "seconds: one hit takes"),
        (["--sources", "oracle"], "unknown source 'oracle'; expected true, estimator, encoders"),
        (["--controllers", "p,p"], "p,p: expected different names separated by commas"),
        (["--lag", "-1"], "lag: expected 0.001 to 10, got -1"),
        (["--model", "nowhere.yaml"], "no robot 'nowhere.yaml'"),
        (["--effect", "ghost@joint1"], "effect 'ghost' cannot be simulated"),
        (["--seed", "-1"], "seed: expected a number of 0 or more, got -1"),
        (["--report", "missing/loop.html"], "the folder missing does not exist"),
        (["--drop", "2"], "drop: expected a probability"),
    ],
)
def test_bad_input_is_one_line(arguments, text, capsys):
    assert main([*SHORT, "--sources=true", *arguments]) == 1
    error = capsys.readouterr().err
    assert text in error
    assert error.count("\n") == 1


def test_effects_of_the_file_that_are_not_in_the_truth_are_named(tmp_path, capsys):
    arm, out = str(tmp_path / "arm.yaml"), tmp_path / "loop.json"
    assert main(["add", "doggy", "motor_viscous@joint2", "spring_pieces_1@joint1", "-o", arm]) == 0
    capsys.readouterr()
    short = ["--seconds", "4", "--controllers", "p", "--sources", "true", "--json", str(out)]
    assert main(["closed-loop", arm, *short]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = (
        "not simulated, although in the robot file: motor_viscous@joint2, spring_pieces_1@joint1; name them: --effect "
    )
    assert lines[1].strip() == f"{told}motor_viscous@joint2:coefficient=0.5"
    assert lines[2].strip().startswith("cannot be simulated: spring_pieces_1@joint1: ")
    assert json.loads(out.read_text())["not_simulated"] == ["motor_viscous@joint2", "spring_pieces_1@joint1"]


def test_without_the_estimator_the_answer_names_the_best(doggy):
    from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop

    result = run_closed_loop(doggy, None, 3.0, 3, options=LoopOptions(("state_feedback",), ("true",)))
    answer = loop_judgement(result)
    assert answer.headline.startswith("Best: state feedback, true state, ")
    assert answer.level == "info"


def test_where_the_true_state_does_not_help_the_model_is_blamed(doggy):
    """A model with a third of the back-EMF plans wrong commands, whatever is known of the state."""
    from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
    from jointscope.tools.simulator.truth import true_robot

    truth = true_robot(doggy, {})
    wrong = truth.with_values({"motor.k_mi": 0.3 * truth.parameter("motor.k_mi").value})
    options = LoopOptions(("state_feedback",), make_estimator=HoldingEstimator)
    answer = loop_judgement(run_closed_loop(doggy, wrong, 3.0, 3, options=options))
    assert answer.headline.startswith("The state is not the limit: even with the true state the head is ")
    assert answer.level == "bad"
    assert "diagnose says what it lacks" in answer.why
