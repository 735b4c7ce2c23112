# SPDX-License-Identifier: BSD-3-Clause
"""What drivers do to streams, found and mended: glitches, second publishers, repetitions.

In: samples in the order of the bag. Out: samples that can be trusted, and a notice for everything left out.
"""
