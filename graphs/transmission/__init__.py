# SPDX-License-Identifier: BSD-3-Clause
"""Robots without equations for their links (`link_dynamics: free`): what lies between motor and joint.

In: motor and joint angles. Out: stiffness, ripples and friction of each transmission.
"""
