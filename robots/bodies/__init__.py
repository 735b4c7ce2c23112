# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints as rigid bodies.

In: a URDF. Out: a tree with its equations of motion and their derivatives (pinocchio behind it), joints that follow
others folded in, bodies on soft bearings added.
"""
