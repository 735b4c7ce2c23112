# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo is an optional extra: it is imported when the first simulation is built, not before."""

from __future__ import annotations

import importlib
from typing import Any

from jointscope.robots.errors import SimulationError


def load_mujoco() -> Any:
    """The module `mujoco`.

    Raises:
        SimulationError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as err:
        raise SimulationError("simulating needs MuJoCo, which is not installed: pip install 'jointscope[sim]'") from err
