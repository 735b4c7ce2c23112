# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo is an optional extra: it is imported when the first simulation is built, not before."""

from __future__ import annotations

from typing import Any

from jointscope.robots.errors import JointscopeError, SimulationError
from jointscope.robots.outside_modules import need_module


def load_mujoco() -> Any:
    """The module `mujoco`.

    Raises:
        SimulationError: it is not installed, or another thing under its name.
    """
    try:
        return need_module("mujoco")
    except JointscopeError as err:
        if isinstance(err.__cause__, ModuleNotFoundError) and err.__cause__.name == "mujoco":
            raise SimulationError(
                "simulating needs MuJoCo, which is not installed: pip install 'jointscope[sim]'"
            ) from err
        raise SimulationError(str(err)) from err
