# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate --incremental` and `--solver samples` on the command line."""

from __future__ import annotations

import json

import pytest

from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main


@pytest.fixture(scope="module")
def bag(simulated, doggy, tmp_path_factory):
    """A second and a half in motion."""
    path = tmp_path_factory.mktemp("ways") / "train.mcap"
    write_bag(path, simulated.recording.between(4.0, 5.5), doggy)
    return path


def test_incremental_says_what_is_known_after_each_stretch_and_writes_the_same_file(bag, tmp_path, capsys):
    found = {}
    for way in ([], ["--incremental"]):
        out, told = tmp_path / f"{len(way)}.yaml", tmp_path / f"{len(way)}.json"
        assert main(["calibrate", "doggy", str(bag), "-o", str(out), "--json", str(told), *way]) == 0
        found[len(way)] = json.loads(told.read_text(encoding="utf-8"))["parameters"]
        text = capsys.readouterr().out
        assert out.is_file()
    assert "after 0.2 s of train.mcap (stretch 1 of 8)" in text
    assert "after 1.5 s of train.mcap (stretch 8 of 8)" in text
    assert text.index("stretch 8 of 8") < text.index("calibrated in")
    assert text.count("motor.k_pwm") == 9
    for name, batch in found[0].items():
        if isinstance(batch["value"], float):
            assert found[1][name]["value"] == pytest.approx(batch["value"], abs=1e-3 * batch["sigma"]), name


@pytest.mark.parametrize(
    ("robot", "ways", "wanted"),
    [
        ("doggy", ["--incremental", "--solver", "samples"], "leave out `--solver samples`"),
        ("hebi_3r", ["--incremental"], "its links are free, so there are no states to estimate one by one; leave out"),
        ("hebi_3r", ["--solver", "samples"], "leave out `--solver samples`"),
        ("doggy", ["--solver", "samples"], "1,500 states and 6,0"),
    ],
)
def test_what_does_not_go_together_is_one_line(bag, tmp_path, capsys, monkeypatch, robot, ways, wanted):
    monkeypatch.setattr("jointscope.graphs.gtsam_solvers.samples_solver.LONGEST", 5.0)
    out = tmp_path / "out.yaml"
    assert main(["calibrate", robot, str(bag), "-o", str(out), *ways]) == 1
    told = capsys.readouterr().err.strip()
    assert wanted in told
    assert len(told.splitlines()) == 1
    assert not out.exists()
