# SPDX-License-Identifier: BSD-3-Clause
"""A robot file from a URDF and a recording: what `jointscope init` finds out.

In: everything numeric in a bag. Out: which topic means what, units, signs, noise, start values, each with
its reason.
"""
