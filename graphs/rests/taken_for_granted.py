# SPDX-License-Identifier: BSD-3-Clause
"""What rests of rigid joints take for granted, and nothing contradicts: masses of links, sizes of loads, zeros.

Friction of a rigid joint holds what is left of the command when weight is taken off. A mass that is wrong is left over
as well, and the band has to be wider by it. So these enter with what is usually known of them, and friction has the
sigma that they leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis, hypotheses_of
from jointscope.robots.files.effect_editing import parameter_of
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests

UNSURE = ("link_mass", "load_scale", "encoder_offset")
MASS = 0.1  # share by which a mass from a drawing may be off, one sigma; typical values of the card of link_mass
LOAD = 0.03  # share by which all known loads may be
ZERO = 0.01  # [rad] by which the zero of an encoder may be


def at_null(robot: Robot, hypotheses: Sequence[EffectHypothesis]) -> Robot:
    """The robot with effects that do nothing yet; their sizes are free about their null values, shapes are held.

    It has no document, so that it cannot be written; labels must differ.
    """
    parameters = dict(robot.parameters)
    for h in hypotheses:
        for p in h.here.effect.parameters_at(robot, h.here.owner):
            value = h.shapes[p.name] if p.name in h.shapes else p.null
            parameter = parameter_of(h.here, p, value)
            parameters[parameter.name] = replace(parameter, positive=False, fixed=p.is_shape, prior=value)
    return replace(robot, parameters=parameters, effects=(*robot.effects, *(h.here for h in hypotheses)))


def all_rigid(robot: Robot) -> bool:
    """Whether every joint's motor carries its link's weight itself."""
    return not any(joint in robot.layout.motors for joint in robot.joints)


def unsure(robot: Robot, rests: Rests) -> Robot:
    """A robot whose masses and loads may be other ones, as values that stand behind its own.

    Links with springs have encoders that contradict them, motors that creep either way tell them from friction: with
    these the robot stays what it is.
    """
    if not all_rigid(robot) or np.any(rests.creep != 0.0):
        return robot
    tried = [h for h in hypotheses_of(robot, at_rest=True) if h.here.effect.id in UNSURE]
    wide = at_null(robot, tried)
    parameters = dict(wide.parameters)
    for h in tried:
        for size in h.sizes:
            name, tree = h.here.parameter(size.name), robot.tree.model
            if h.here.effect.id in ("load_scale", "encoder_offset"):
                sigma = LOAD if h.here.effect.id == "load_scale" else ZERO
                parameters[name] = replace(parameters[name], prior_sigma=sigma)
            elif size.name == "mass":
                mass = float(tree.inertias[tree.getJointId(h.here.owner)].mass)
                parameters[name] = replace(parameters[name], prior_sigma=max(MASS * mass, 1e-9))
            else:
                parameters[name] = replace(parameters[name], fixed=True)
    return replace(wide, parameters=parameters)
