# SPDX-License-Identifier: BSD-3-Clause
"""Whether the bounds of limits are in units of what they limit, before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.tools.acceptance.limits import Limit


def check_units(limits: Sequence[Limit], robots: Iterable[Robot]) -> None:
    """Complains about the first bound that is in no unit of a parameter or channel that it is for.

    Raises:
        RobotError: a unit does not fit, or a bound has none where the quantity has a dimension.
    """
    for robot in robots:
        for limit in limits:
            for name, unit in _own_units(limit, robot):
                if fnmatchcase(name, limit.pattern) and limit.factor_from(unit) is None:
                    raise RobotError(limit.misfit(unit, name))


def _own_units(limit: Limit, robot: Robot) -> Iterator[tuple[str, str]]:
    """Names and units of all that a limit may be about; nothing where its quantity says its unit."""
    if limit.in_own_unit:
        return
    if limit.subject == "parameter":
        yield from ((name, parameter.unit) for name, parameter in robot.parameters.items())
        yield from ((derived.name, derived.unit) for derived in robot.derived)
    if limit.subject == "channel":
        for sensor in robot.sensors.values():
            yield from zip(sensor.channels, sensor.units, strict=True)
