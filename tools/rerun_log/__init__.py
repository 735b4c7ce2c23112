# SPDX-License-Identifier: BSD-3-Clause
"""Recordings for the rerun viewer: log_calibration and log_comparison write an .rrd file with its own layout."""

from jointscope.tools.rerun_log.log_calibration import log_calibration
from jointscope.tools.rerun_log.log_comparison import log_comparison

__all__ = ["log_calibration", "log_comparison"]
