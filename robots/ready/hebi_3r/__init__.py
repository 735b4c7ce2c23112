# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: a planar HEBI arm with three series-elastic modules."""
