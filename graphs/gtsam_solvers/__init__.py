# SPDX-License-Identifier: BSD-3-Clause
"""GTSAM's own solvers on the same factors: its optimizer with a factor per sample, iSAM2 stretch after stretch.

In: problems and an estimate. Out: the same `Solution` as from `solving`: one is the reference, the
other tells on its way.
"""
