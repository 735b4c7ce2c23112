# SPDX-License-Identifier: BSD-3-Clause
"""Commands of docs/workers.md, with the address of a cluster on this machine."""

from __future__ import annotations

import re

import numpy as np
import pytest
from page_commands import ROOT, lines_of, run, text_of

pytest.importorskip("mujoco", reason="the page's recordings are simulated")
distributed = pytest.importorskip("distributed", reason="clusters need the extra `cluster`")
pytestmark = pytest.mark.slow

BLOCKS = r"<!-- executed by tests/tools/verbs/test_workers_page.py -->\n```bash\n(.*?)```"


def test_the_commands_of_the_page_give_the_same_robot_on_processes_and_on_a_cluster(tmp_path):
    from jointscope.robots.files.robot_file import load_robot

    for command in (
        "jointscope simulate doggy -o moves.mcap --seconds 4 --seed 2 --friction smooth",
        "jointscope simulate doggy -o other_moves.mcap --motion moves --seconds 3 --seed 2 --friction smooth",
        "jointscope calibrate doggy moves.mcap other_moves.mcap -o alone.yaml",
    ):
        assert run(command, tmp_path).returncode == 0
    (on_processes, on_cluster) = re.findall(BLOCKS, text_of(ROOT / "docs" / "workers.md"), re.DOTALL)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        for block in (on_processes, on_cluster):
            for line in lines_of(block):
                done = run(line.replace("tcp://host:8786", cluster.scheduler_address), tmp_path)
                assert done.returncode == 0, done.stderr
            found, alone = load_robot(tmp_path / "arm.yaml"), load_robot(tmp_path / "alone.yaml")
            for name, parameter in alone.parameters.items():
                np.testing.assert_allclose(found.parameters[name].value, parameter.value, rtol=1e-9)
