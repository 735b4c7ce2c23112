# SPDX-License-Identifier: BSD-3-Clause
"""One robot: parameters with values, priors and sigmas, sensors, and where each stands in a state.

In: a tree, sensors and effects. Out: `Robot`, an immutable value that every floor above reads.
"""
