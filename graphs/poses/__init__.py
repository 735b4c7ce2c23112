# SPDX-License-Identifier: BSD-3-Clause
"""Arms at rest with a measured target: geometry and sag in one estimate.

In: angles and target positions of poses. Out: errors of geometry and stiffnesses with sigmas, errors of the tip in mm.
"""
