# SPDX-License-Identifier: BSD-3-Clause
"""One residual per file: vectorised over samples, with analytic Jacobians, and wrapped as GTSAM custom factors."""
