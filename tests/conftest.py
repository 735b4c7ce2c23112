# SPDX-License-Identifier: BSD-3-Clause
"""Recordings for all tests: some that no code of this project made, some from the simulator."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[1].parent / "shared"


@pytest.fixture(scope="session")
def doggy_data() -> Path:
    """Folder with recordings of a Doggy-like robot made elsewhere."""
    folder = SHARED / "data" / "doggy"
    if not folder.is_dir():
        pytest.skip("shared/data/doggy is not beside the project: recordings made elsewhere cannot be tested")
    return folder


@pytest.fixture(scope="session")
def doggy():
    """The ready robot."""
    from jointscope.robots.files.robot_file import load_robot

    return load_robot("doggy")


@pytest.fixture(scope="session")
def simulated():
    """Eight seconds of calibration motion with smooth friction, with its truth."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.simulator import simulate

    return simulate(load_robot("doggy"), "calibration", 8.0, seed=5, friction="smooth")
