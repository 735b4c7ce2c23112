# SPDX-License-Identifier: BSD-3-Clause
"""Bags in and out: ROS 1 .bag, ROS 2 sqlite3 and mcap, as a folder or as a bare file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jointscope.tools.bags.bag_description import BagDescription
from jointscope.tools.bags.describe_bag import describe_bag
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

if TYPE_CHECKING:
    from jointscope.tools.bags.read_arrivals import ArrivalReader

__all__ = ["ArrivalReader", "BagDescription", "describe_bag", "read_recording", "write_bag"]


def __getattr__(name: str) -> Any:
    """Imports the reader of a replay when somebody asks for it: it brings the estimator along."""
    if name != "ArrivalReader":
        raise AttributeError(f"module {__name__} has no attribute {name}")
    from jointscope.tools.bags.read_arrivals import ArrivalReader

    return ArrivalReader
