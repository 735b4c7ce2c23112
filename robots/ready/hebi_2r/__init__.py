# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: a planar HEBI arm with two series-elastic modules."""
