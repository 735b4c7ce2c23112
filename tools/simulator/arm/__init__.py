# SPDX-License-Identifier: BSD-3-Clause
"""Arms with geometric errors, elastic drives and bearings as MuJoCo bodies, and what shakes them."""
