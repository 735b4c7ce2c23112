# SPDX-License-Identifier: BSD-3-Clause
"""What moves a robot: motors, springs, friction and effects, put together to the rate of its state.

In: a robot, states, commands. Out: accelerations and rates with derivatives by state and parameters, for one state or
for thousands.
"""
