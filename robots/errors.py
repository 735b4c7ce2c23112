# SPDX-License-Identifier: BSD-3-Clause
"""The errors a user can meet: one root, one child per thing that can be wrong.

A message says what is wrong, where, what was expected, what was got and what to do next, in one line.
"""


class JointscopeError(Exception):
    """Root of all errors of this package; the command line prints it as one line and exits with 1."""

    def _render_traceback_(self) -> list[str]:
        """A notebook, too, shows the one line that says what to do."""
        return [f"{type(self).__name__}: {self}"]


class RecordingError(JointscopeError):
    """A bag cannot be read or its content cannot be a measurement of this robot."""


class RobotError(JointscopeError):
    """A robot file is malformed or describes an impossible robot."""


class EffectError(JointscopeError):
    """A physical effect is unknown, acts on nothing, or was given an impossible value."""


class SolveError(JointscopeError):
    """An estimation did not reach a result that can be trusted."""


class SimulationError(JointscopeError):
    """A simulation was asked for something that it cannot do."""


class EstimatorError(JointscopeError):
    """The estimator for the control loop was called with something that it cannot be meant to take."""


class ClusterError(JointscopeError):
    """Workers of a cluster cannot be reached, are not what this process is, or have too little memory."""
