# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: a HEBI arm with five series-elastic modules."""
