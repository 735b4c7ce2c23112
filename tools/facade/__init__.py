# SPDX-License-Identifier: BSD-3-Clause
"""Jointscope: calibrate flexible-joint robots from recordings and see what the model cannot explain.

The names below are what programs build on; modules may move. They are imported when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jointscope.graphs.calibration.calibration_graph import CalibrationGraph
    from jointscope.graphs.fixed_lag.estimator import FixedLagEstimator
    from jointscope.robots import errors
    from jointscope.robots.errors import JointscopeError
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.robots.files.robot_writer import robot_text
    from jointscope.tools.bags.read_recording import read_recording
    from jointscope.tools.notebook.calls import calibrate, compare, diagnose, discover, graph
    from jointscope.tools.notebook.linear_model import linear_model
    from jointscope.tools.notebook.models import add, export, info, remove
    from jointscope.tools.notebook.recordings import read, replay, simulate

__version__: str
__all__ = [
    "CalibrationGraph",
    "FixedLagEstimator",
    "JointscopeError",
    "add",
    "calibrate",
    "compare",
    "diagnose",
    "discover",
    "errors",
    "export",
    "graph",
    "info",
    "linear_model",
    "load_robot",
    "read",
    "read_recording",
    "remove",
    "replay",
    "robot_text",
    "simulate",
]

_MODULES = {
    **dict.fromkeys(("calibrate", "compare", "diagnose", "discover", "graph"), "tools.notebook.calls"),
    **dict.fromkeys(("read", "replay", "simulate"), "tools.notebook.recordings"),
    **dict.fromkeys(("add", "export", "info", "remove"), "tools.notebook.models"),
    "CalibrationGraph": "graphs.calibration.calibration_graph",
    "FixedLagEstimator": "graphs.fixed_lag.estimator",
    "JointscopeError": "robots.errors",
    "linear_model": "tools.notebook.linear_model",
    "load_robot": "robots.files.robot_file",
    "read_recording": "tools.bags.read_recording",  # the older name of `read`, with its own arguments
    "robot_text": "robots.files.robot_writer",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version  # brings a parser of mails along

        return version("jointscope")
    if name == "errors":
        return importlib.import_module("jointscope.robots.errors")
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"jointscope.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
