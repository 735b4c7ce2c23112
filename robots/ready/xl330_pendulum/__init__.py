# SPDX-License-Identifier: BSD-3-Clause
"""Ready robot: a Dynamixel XL330-288-T with a pendulum."""
