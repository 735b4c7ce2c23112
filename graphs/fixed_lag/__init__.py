# SPDX-License-Identifier: BSD-3-Clause
"""The fixed-lag estimator for the control loop: iSAM2 over the last tenths of a second.

In: messages as they come. Out: the state now with its covariance.
Rooms: window, messages, the estimator, replay.
"""

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.estimator import FixedLagEstimator

__all__ = ["EstimatedState", "FixedLagEstimator"]
