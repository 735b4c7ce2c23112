# SPDX-License-Identifier: BSD-3-Clause
"""From recordings to a calibrated robot.

In: a robot and recordings. Out: `CalibrationResult`: values with sigmas, residuals, findings, weak directions.
"""
