# SPDX-License-Identifier: BSD-3-Clause
"""How large the noises are that the residuals show.

In: problems and an estimate. Out: sigmas of sensors, densities of the process, floors, tests for whiteness.
"""
