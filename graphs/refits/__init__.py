# SPDX-License-Identifier: BSD-3-Clause
"""A model with one more effect, fitted for real.

In: a calibrated base model and an effect. Out: the robot with the sizes found on pieces of the recordings, and its
error on the pieces between, where it has not been.
"""
