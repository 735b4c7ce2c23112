# SPDX-License-Identifier: BSD-3-Clause
"""What goes in and out of the simulated robot: sensors at their rates, motions, controllers."""
