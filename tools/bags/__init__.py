# SPDX-License-Identifier: BSD-3-Clause
"""Bags in and out: ROS 1 .bag, ROS 2 sqlite3 and mcap, as a folder or as a bare file."""
