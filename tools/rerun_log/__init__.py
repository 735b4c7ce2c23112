# SPDX-License-Identifier: BSD-3-Clause
"""Recordings for the rerun viewer: one function per kind of result, each writes an .rrd file with its own layout."""

from jointscope.tools.rerun_log.log_calibration import log_calibration
from jointscope.tools.rerun_log.log_closed_loop import log_closed_loop
from jointscope.tools.rerun_log.log_comparison import log_comparison
from jointscope.tools.rerun_log.log_diagnosis import log_diagnosis
from jointscope.tools.rerun_log.log_discovery import log_discovery

__all__ = ["log_calibration", "log_closed_loop", "log_comparison", "log_diagnosis", "log_discovery"]
