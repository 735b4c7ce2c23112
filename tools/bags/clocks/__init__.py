# SPDX-License-Identifier: BSD-3-Clause
"""When samples were taken, where the stamps in a bag do not say so.

In: stamps, times of reception, values, in the order of the bag. Out: samples in order of time, all on one clock, and
notices of what was mended.
"""
