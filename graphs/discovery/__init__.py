# SPDX-License-Identifier: BSD-3-Clause
"""Which effect is missing.

In: a robot, training recordings, one held out. Out: a ranking with verdicts that refits and validation blocks support,
and the model grown effect by effect.
"""
