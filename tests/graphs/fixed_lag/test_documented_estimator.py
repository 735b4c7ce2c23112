# SPDX-License-Identifier: BSD-3-Clause
"""The Python lines of docs/estimator.md, run as they stand there: once before the loop, in it for every message."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.files.robot_writer import robot_text

PAGE = Path(__file__).parents[3] / "docs" / "estimator.md"
BLOCK = re.compile(
    r"<!-- executed by tests/graphs/fixed_lag/test_documented_estimator.py -->\n```python\n(.*?)```", re.DOTALL
)
LINES = {"motor_encoder": "est.encoder(", "imu1": "est.gyro(", "command": "est.command("}
BEGIN, END = 0.5, 0.7  # [s]


@pytest.fixture(scope="module")
def names(run, tmp_path_factory):
    """What the first block leaves, after each of its lines in the loop has had its messages."""
    folder = tmp_path_factory.mktemp("estimator")
    (folder / "doggy_calibrated.yaml").write_text(robot_text(run.robot, folder))
    loop, after = BLOCK.findall(PAGE.read_text(encoding="utf-8"))[0].split("# in the loop")[1].split("\n\n", 1)
    before = BLOCK.findall(PAGE.read_text(encoding="utf-8"))[0].split("# in the loop")[0]
    line = {name: next(one for one in loop.splitlines() if one.startswith(LINES[name])) for name in LINES}
    ask = next(one for one in loop.splitlines() if one.startswith("x = est.state("))
    found: dict = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec(before, found)
    for name, t, values in run.messages(BEGIN, END):
        found |= {"t": t, "q": values, "w": values, "u": values}
        exec(line[name] if name in line else "est.sample(name, t, q)", found | {"name": name})
    exec(ask, found)
    exec(after, found)
    return found


def test_the_loop_of_the_page_follows_the_robot(names, run):
    x = names["x"]
    assert names["est"].status.running
    assert np.abs(run.error(x)).max() < 5.0
    np.testing.assert_array_equal(x.mean[: len(x.q_link)], x.q_link)


def test_the_factor_of_the_page_counts(names, run):
    est, layout = names["est"], names["est"].layout
    t = names["t"]
    place = layout.joint_q[0]
    before = est.state(t)
    exec(BLOCK.findall(PAGE.read_text(encoding="utf-8"))[1], names)
    after = est.state(t)
    marked = 0.31
    assert abs(after.mean[place] - marked) < abs(before.mean[place] - marked)
    assert after.sigma[place] < before.sigma[place]
