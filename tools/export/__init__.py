# SPDX-License-Identifier: BSD-3-Clause
"""A calibrated robot for other programs.

In: a robot. Out: the text of a URDF or of a MuJoCo model, and what that format cannot hold, in words.
"""
