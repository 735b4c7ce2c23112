# SPDX-License-Identifier: BSD-3-Clause
"""Bags in and out: ROS 1 .bag, ROS 2 sqlite3 and mcap, as a folder or as a bare file."""

from jointscope.tools.bags.describe_bag import BagDescription, describe_bag
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

__all__ = ["ArrivalReader", "BagDescription", "describe_bag", "read_recording", "write_bag"]
