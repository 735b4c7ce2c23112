# SPDX-License-Identifier: BSD-3-Clause
"""The states of the last tenths of a second and their factors.

In: samples and commands by tick. Out: the window smoothed by iSAM2, the newest state, innovations.
"""
