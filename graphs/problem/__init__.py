# SPDX-License-Identifier: BSD-3-Clause
"""From a recording to factors on a chain of states.

In: a robot and a recording. Out: `BagProblem`: the ticks, the factors placed on them, the noise of each.
"""
