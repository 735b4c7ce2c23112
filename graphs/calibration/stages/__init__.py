# SPDX-License-Identifier: BSD-3-Clause
"""What the stages of a calibration ask of their solves.

In: a solution. Out: an error where its values must not be used.
"""
