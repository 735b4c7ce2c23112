# SPDX-License-Identifier: BSD-3-Clause
"""The stages of a calibration on whole recordings, and what they ask of their solves.

In: problems, noise, and the values that windows found. Out: a solution whose noise agrees with its residuals, and parts
of it; or an error where its values must not be used.
"""
