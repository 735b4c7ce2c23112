# SPDX-License-Identifier: BSD-3-Clause
"""The rests of a recording as the solver sees them: rests in; equilibria, what friction held, and errors out."""
