# SPDX-License-Identifier: BSD-3-Clause
"""The ready robot panda: an arm by Franka Emika with a ball on its flange, after Franzese et al. (2025)."""
