# SPDX-License-Identifier: BSD-3-Clause
"""Values that the recording tells: mountings, gears, signs, units, drives."""
