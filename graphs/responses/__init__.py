# SPDX-License-Identifier: BSD-3-Clause
"""Frequency responses of any system: signals in; response matrix with noise and total covariance out."""
