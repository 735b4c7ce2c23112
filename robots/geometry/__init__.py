# SPDX-License-Identifier: BSD-3-Clause
"""Where a target on an arm is, with errors of its geometry and the sag of its drives and bearings.

In: a chain of joints with masses, values of error parameters and stiffnesses. Out: points and their derivatives.
"""
