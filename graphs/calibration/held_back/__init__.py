# SPDX-License-Identifier: BSD-3-Clause
"""Values that a calibration holds back until the rest is found, or in the end.

In: stages of a calibration and what they solved. Out: a solution with these values.
"""
