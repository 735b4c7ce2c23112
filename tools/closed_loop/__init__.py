# SPDX-License-Identifier: BSD-3-Clause
"""Ball hitting in the simulator: controllers beside each other, each fed by several ways of knowing the state."""
