# SPDX-License-Identifier: BSD-3-Clause
"""Reports as one HTML file without outside references: one function per kind of result."""

from jointscope.tools.report.calibration_report import calibration_report
from jointscope.tools.report.closed_loop_report import closed_loop_report
from jointscope.tools.report.comparison_report import comparison_report
from jointscope.tools.report.diagnosis_report import diagnosis_report
from jointscope.tools.report.discovery_report import discovery_report

__all__ = [
    "calibration_report",
    "closed_loop_report",
    "comparison_report",
    "diagnosis_report",
    "discovery_report",
]
