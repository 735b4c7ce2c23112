# SPDX-License-Identifier: BSD-3-Clause
"""The parameters of a calibration: a tuple that is also asked by name, and prints a line for each."""

from __future__ import annotations

from typing import Any

from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.robots.errors import RobotError
from jointscope.robots.yaml_section import did_you_mean


class Parameters(tuple[ParameterEstimate, ...]):
    """`parameters[0]`, `parameters["joint1.stiffness"]`."""

    __slots__ = ()

    def __getitem__(self, key: Any) -> Any:
        """One by its place or name, or several by a slice.

        Raises:
            RobotError: there is none of that name.
        """
        if not isinstance(key, str):
            return super().__getitem__(key)
        found = {parameter.name: parameter for parameter in self}
        if key not in found:
            raise RobotError(f"there is no parameter {key!r}{did_you_mean(key, set(found))}")
        return found[key]

    def __repr__(self) -> str:
        """A line for each."""
        return "\n".join(map(repr, self))

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return "".join(f"<p>{parameter._repr_html_()}</p>" for parameter in self)
