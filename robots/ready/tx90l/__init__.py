# SPDX-License-Identifier: BSD-3-Clause
"""The ready robot TX90L, after Neubauer, Gattringer, Mueller, Steinhauser and Hoebarth (2015)."""
