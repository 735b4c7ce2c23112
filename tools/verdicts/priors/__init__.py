# SPDX-License-Identifier: BSD-3-Clause
"""Values against their priors.

In: a calibration. Out: a level and a sentence on values that only their priors hold, and on those that contradict them.
"""
