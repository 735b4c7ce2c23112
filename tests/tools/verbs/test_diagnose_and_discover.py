# SPDX-License-Identifier: BSD-3-Clause
"""The verbs diagnose, discover, add and remove: what they write and say; the computation is made up."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest
from fake_diagnosis import BEARING, fake_diagnosis, fake_inputs, fake_steps

from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags import read_motion as read_module
from jointscope.tools.command_line import main
from jointscope.tools.notebook import calls
from jointscope.tools.verb_parts.discovery_state import DiscoveryState, hashes_of

DIAGNOSE = ["diagnose", "doggy", "a.mcap"]
DISCOVER = ["discover", "doggy", "a.mcap", "--holdout", "b.mcap", "-o", "found.yaml"]
KEPT = {"found.yaml", "found.step0.yaml", "found.step1.yaml", "found.discovery.json"}


class FakeDiscover:
    """Two steps, each saved; remembers what it was asked, and may break down before a step."""

    def __init__(self):
        self.resumed, self.asked, self.breaks_before, self.error = None, None, None, None

    def __call__(self, robot, recordings, holdout=None, *, save=None, resume=None, **options):
        self.resumed, self.asked = list(resume or []), options
        steps = []
        for k, step in enumerate(fake_steps(0.5, holdout is not None)):
            if self.breaks_before == k:
                raise self.error
            named = save(k, step) if k >= len(self.resumed) else self.resumed[k].robot_file
            steps.append(dataclasses.replace(step, robot_file=named))
        return Discovery(tuple(steps), "The model is adequate.", True, steps[-1].robot_file, holdout is not None)


@pytest.fixture(autouse=True)
def quick(tmp_path, monkeypatch):
    """An empty folder; recordings and diagnoses are made up."""
    monkeypatch.chdir(tmp_path)
    _, _, _, train, test, _ = fake_inputs(0.5)
    known = {"a.mcap": train, "b.mcap": test}
    monkeypatch.setattr(read_module, "read_motion", lambda path, robot, progress=None: known[Path(path).name])
    found = fake_diagnosis(0.5, held_out=False)
    monkeypatch.setattr(calls, "diagnose_motion", lambda robot, recordings, holdout, **_: found)


@pytest.fixture
def discover(monkeypatch):
    computation = FakeDiscover()
    monkeypatch.setattr(calls, "discover_motion", computation)
    return computation


def files():
    return {path.name for path in Path().iterdir()}


def complaint(capsys, *arguments):
    assert main(arguments) == 1
    err = capsys.readouterr().err
    assert err.startswith("jointscope: error: ") and err.count("\n") == 1
    return err.removeprefix("jointscope: error: ").rstrip("\n")


# diagnose


def test_diagnose_says_what_it_found_and_writes_every_file(capsys):
    assert main([*DIAGNOSE, "--holdout", "b.mcap", "--report", "r.html", "--rrd", "f.rrd", "--json", "d.json"]) == 0
    text = capsys.readouterr().out
    assert "it lacks bearing_flexibility@joint1" in text
    assert "on the held-out recording" in text  # the verb hands over which recording was held out
    assert text.endswith("Wrote r.html, f.rrd, d.json\n")
    assert files() == {"r.html", "f.rrd", "d.json"}
    content = json.loads(Path("d.json").read_text())
    first = content["candidates"][0]
    assert {"adequate", "unexplained_share", "candidates"} <= set(content)
    assert {"effect", "owner", "score", "dof", "p_value", "parameters", "heldout_error", "look_alikes"} <= set(first)
    assert first["parameters"]["compliance_x"] == {"value": 4.02e-4, "sigma": 6.1e-6, "unit": "rad/(N m)"}
    assert content["candidates"][3]["heldout_error"] is None


def test_a_held_out_bag_must_not_be_a_training_bag(capsys):
    told = (
        "--holdout runs/train <1>.mcap is also a training recording (runs/train <1>.mcap); hold out one that the model "
        "has not seen"
    )
    assert complaint(capsys, *DIAGNOSE, "--holdout", "a.mcap") == told


def test_inputs_are_never_overwritten(capsys, discover):
    told = "it is also an input; give it another name"
    assert complaint(capsys, *DIAGNOSE, "--holdout", "b.mcap", "--json", "b.mcap") == f"cannot write b.mcap: {told}"
    assert complaint(capsys, *DIAGNOSE, "--effects", "e.py", "--json", "e.py") == f"cannot write e.py: {told}"
    Path("found.step1.yaml").write_text("")
    arguments = ["discover", "found.step1.yaml", "a.mcap", "-o", "found.yaml"]
    assert complaint(capsys, *arguments) == f"cannot write found.step1.yaml: {told}"


@pytest.mark.parametrize("verb", ["diagnose", "compare", "calibrate", "info"])
def test_a_file_of_effects_that_is_not_there_is_one_line(verb, capsys):
    arguments = {
        "diagnose": DIAGNOSE,
        "compare": ["compare", "doggy", "a.mcap"],
        "calibrate": ["calibrate", "doggy", "a.mcap", "-o", "o.yaml"],
        "info": ["info", "a.mcap", "--robot", "doggy"],
    }[verb]
    assert "mine.py" in complaint(capsys, *arguments, "--effects", "mine.py")


# discover


def test_discover_keeps_every_step_and_writes_every_file(discover, capsys):
    assert main([*DISCOVER, "--report", "r.html", "--rrd", "f.rrd", "--json", "d.json"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("The model is adequate with bearing_flexibility@joint1.\n")
    assert "found.step1.yaml" in text
    assert "runs/test.mcap" in Path("r.html").read_text()
    assert files() == KEPT | {"r.html", "f.rrd", "d.json"}
    content = json.loads(Path("d.json").read_text())
    assert content["robot_file"] == "found.yaml"
    assert [step["added"] for step in content["steps"]] == [None, BEARING]
    origin = load_robot("found.yaml").document["calibration"]
    assert (origin["discovery_step"], origin["added"], origin["heldout_error"]) == (1, BEARING, 1.23)
    assert origin["bags"][0]["path"] == "runs/train <1>.mcap"


def test_a_second_run_continues_after_the_last_step(discover, capsys):
    discover.breaks_before, discover.error = 1, KeyboardInterrupt()
    assert complaint(capsys, *DISCOVER) == "interrupted after step 0; the same command continues there"
    assert files() == {"found.step0.yaml", "found.discovery.json"}
    discover.breaks_before = None
    assert main(DISCOVER) == 0
    assert capsys.readouterr().out.startswith("Continuing after step 0, found.step0.yaml; --restart starts anew.\n")
    (saved,) = discover.resumed
    assert (saved.train_error, saved.heldout_error, saved.floor, saved.added) == (12.3, 13.21, 1.2, None)
    assert saved.robot.name == "doggy" and saved.paragraph.startswith("The calibrated base model")
    assert files() == KEPT


def test_an_error_keeps_the_steps_too(discover, capsys):
    from jointscope.robots.errors import SolveError

    discover.breaks_before, discover.error = 1, SolveError("it does not converge")
    assert complaint(capsys, *DISCOVER) == "it does not converge"
    assert files() == {"found.step0.yaml", "found.discovery.json"}


def test_ctrl_c_before_the_first_step_leaves_nothing(discover, capsys):
    discover.breaks_before, discover.error = 0, KeyboardInterrupt()
    assert complaint(capsys, *DISCOVER) == "interrupted; nothing was written"
    assert files() == set()


def test_restart_ignores_the_steps_of_an_earlier_run(discover, capsys):
    assert main(DISCOVER) == 0
    assert main([*DISCOVER, "--restart"]) == 0
    assert discover.resumed == []
    assert "Continuing" not in capsys.readouterr().out


def test_other_inputs_do_not_continue_and_the_message_says_what_to_do(discover, capsys):
    assert main(DISCOVER) == 0
    told = "found.discovery.json holds a discovery from other inputs ({} differ); give -o another name, or start anew"
    assert complaint(capsys, *DISCOVER[:3], "-o", "found.yaml").startswith(told.format("holdout"))
    assert complaint(capsys, "discover", "doggy_paper", *DISCOVER[2:]).startswith(told.format("robot"))


def test_a_step_that_was_edited_since_is_not_used(discover, capsys):
    assert main(DISCOVER) == 0
    with Path("found.step1.yaml").open("a") as file:
        file.write("# mine\n")
    told = "found.step1.yaml is missing or was changed since it was saved; put it back, or start anew with --restart"
    assert complaint(capsys, *DISCOVER) == told


@pytest.mark.parametrize("content", ["", "[]", '{"format": 99}', '{"format": 1, "inputs": {}, "steps": [{}]}'])
def test_a_damaged_state_is_one_line(content, discover, capsys):
    Path("found.discovery.json").write_text(content)
    told = "found.discovery.json is not the state of a discovery that this version can continue; start anew with"
    assert complaint(capsys, *DISCOVER).startswith(told)


def test_a_step_is_saved_whole_or_not_at_all(tmp_path, monkeypatch):
    robot, _, _, train, _, _ = fake_inputs(0.5)
    state = DiscoveryState(tmp_path / "o.yaml", hashes_of(robot, [train], None, []), [train], "doggy.yaml")
    monkeypatch.setattr(
        "jointscope.tools.verb_parts.discovery_state.write_json", lambda *a: (_ for _ in ()).throw(OSError(28, "x"))
    )
    with pytest.raises(Exception, match="cannot write"):
        state.save(0, fake_steps(0.5)[0])
    assert list(tmp_path.iterdir()) == [] and state.count == 0


# add and remove


def test_an_effect_is_added_and_removed_and_comments_survive(capsys):
    text = Path(load_robot("doggy").path).read_text().replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    Path("my.yaml").write_text("# my own comment\n" + text)
    assert main(["add", "my.yaml", BEARING, "-o", "more.yaml", "--json", "a.json"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{BEARING} added to doggy\n")
    assert "joint1.bearing_flexibility.compliance_x" in said
    assert said.endswith(
        "Wrote more.yaml; jointscope calibrate more.yaml BAG -o more_calibrated.yaml finds the values\n"
    )
    assert Path("more.yaml").read_text().startswith("# my own comment\n")
    assert "joint1.bearing_flexibility.compliance_x" in json.loads(Path("a.json").read_text())["added"]
    assert main(["remove", "more.yaml", BEARING, "-o", "less.yaml"]) == 0
    assert f"{BEARING} removed from doggy: joint1.bearing_flexibility.compliance_x" in capsys.readouterr().out
    assert list(load_robot("less.yaml").parameters) == list(load_robot("doggy").parameters)


def test_an_effect_that_cannot_be_edited_is_one_line_and_writes_nothing(capsys):
    assert "banana" in complaint(capsys, "add", "doggy", "banana@joint1", "-o", "o.yaml")
    assert "it has none" in complaint(capsys, "remove", "doggy", BEARING, "-o", "o.yaml")
    assert files() == set()
    assert main(["add", "doggy", BEARING, "-o", "o.yaml"]) == 0
    assert main(["remove", "o.yaml", BEARING, "-o", "o.yaml"]) == 0
    told = "cannot write o.yaml: it is also an input; give it another name"
    assert complaint(capsys, "add", "o.yaml", BEARING, "-o", "p.yaml", "--json", "o.yaml") == told
    assert load_robot("o.yaml").effects == ()
