# SPDX-License-Identifier: BSD-3-Clause
"""The example of docs/gtsam.md, run as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from jointscope.tools.bags.write_bag import write_bag

PAGE = Path(__file__).parents[3] / "docs" / "gtsam.md"


def test_the_example_runs_and_the_data_sheet_counts(simulated, doggy, tmp_path, monkeypatch, capsys):
    part = simulated.recording.between(4.0, 5.5)
    write_bag(tmp_path / "train.mcap", part, doggy)
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict = {}
    exec(compile(code, str(PAGE), "exec"), names)
    value, sigma = map(float, capsys.readouterr().out.splitlines()[-1].split())
    before = next(p for p in names["result"].parameters if p.name == "joint2.stiffness")
    assert min(before.value, 120.0) <= value <= max(before.value, 120.0)
    assert sigma <= 1.001 * before.sigma
    assert value == pytest.approx(120.0, rel=0.05)
