# SPDX-License-Identifier: BSD-3-Clause
"""A simulator on MuJoCo that shares no formula with the estimator: the engine integrates."""

from jointscope.tools.simulator.effects import simulated_effects
from jointscope.tools.simulator.simulation import DEFAULT_SECONDS, Simulation, simulate, simulate_under
from jointscope.tools.simulator.world.disturbance import Disturbance

__all__ = ["DEFAULT_SECONDS", "Disturbance", "Simulation", "simulate", "simulate_under", "simulated_effects"]
