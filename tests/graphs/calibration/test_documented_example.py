# SPDX-License-Identifier: BSD-3-Clause
"""The Python examples of README.md and docs/gtsam.md, run as they stand there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.tools.bags.write_bag import write_bag

ROOT = Path(__file__).parents[3]
BLOCK = re.compile(
    r"<!-- executed by tests/graphs/calibration/test_documented_example.py -->\n```python\n(.*?)```", re.DOTALL
)


@pytest.fixture
def run(simulated, doggy, tmp_path, monkeypatch):
    """Runs the example of a page beside recordings; its names and what it printed."""
    (tmp_path / "demo").mkdir()  # as the demo leaves it
    write_bag(tmp_path / "train.mcap", simulated.recording.between(4.0, 5.5), doggy)
    write_bag(tmp_path / "demo" / "train.mcap", simulated.recording.between(4.0, 5.5), doggy)
    write_bag(tmp_path / "demo" / "test.mcap", simulated.recording.between(5.5, 6.5), doggy)
    for name in ("found.yaml", "found.step0.yaml"):
        (tmp_path / "demo" / name).write_text(robot_text(doggy, tmp_path / "demo"))
    monkeypatch.chdir(tmp_path)

    def example(page, index=0):
        code = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))[index]
        names: dict = {}
        exec(compile(code, page, "exec"), names)
        return names

    return example


def test_the_example_of_the_readme_says_how_good_the_result_is_and_keeps_it(run, capsys, tmp_path):
    result = run("README.md")["result"]
    *answer, stiffness, errors = capsys.readouterr().out.splitlines()
    assert answer == result.answer().splitlines()
    assert re.match(r"joint2\.stiffness = 1\d\d\.\d+ ± [\d.]+ N m/rad, prior ", stiffness)
    before, after = map(float, re.findall(r"(?:before|after): ([\d.]+) sigma", errors))
    assert after < 0.5 * before
    assert load_robot(tmp_path / "doggy_calibrated.yaml").parameters["joint2.stiffness"].sigma > 0.0
    assert "<svg" in (tmp_path / "calibration.html").read_text(encoding="utf-8")


def test_a_data_sheet_as_a_factor_counts(run, capsys):
    names = run("docs/gtsam.md", 1)
    value, sigma = map(float, capsys.readouterr().out.splitlines()[-1].split())
    before = next(p for p in names["result"].parameters if p.name == "joint2.stiffness")
    assert min(before.value, 120.0) <= value <= max(before.value, 120.0)
    assert sigma <= 1.001 * before.sigma
    assert value == pytest.approx(120.0, rel=0.05)


def test_the_first_example_of_the_graph_prints_it_and_the_test_bench_counts(run, capsys):
    names = run("docs/gtsam.md")
    assert "rows: dynamics" in capsys.readouterr().out
    g, bench = names["g"], np.array([0.046, 0.0, -0.022])
    before, after = (values.atVector(g.keys["imu1.bias"]) for values in (g.values, names["values"]))
    assert np.linalg.norm(after - bench) < 0.1 * np.linalg.norm(before - bench)


def test_the_lines_with_the_users_factor_are_few():
    code = BLOCK.findall((ROOT / "docs/gtsam.md").read_text(encoding="utf-8"))[0]
    lines = [line for line in code.splitlines() if line.strip() and "import" not in line]
    assert len(lines) == 5
