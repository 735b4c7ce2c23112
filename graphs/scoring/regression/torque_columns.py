# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the catalogue as columns of the regression of one rigid joint's drive: what a unit of each size adds.

The regression has u = (M a + c + g + b a + d v + mu sign(v) - law) / k. Neither states nor process noise stand between
a recording and these columns, and no other joint's missing torque, so that they tell what a joint lacks, also where
process noise of a calibration has taken it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.column import STEP, null_values
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.starts.motion_cells import MotionCells
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import InertiaChange, inertia_torques, tilt_torques

Array = NDArray[np.float64]

TURN = "encoder_offset"  # the effect of readings that columns tell: all torques are those of another posture
ANGLE = "angle"  # shape of its hypothesis: where its secant is taken [rad]
SLOPE = 1e-3  # [rad] of the angle where none is given


@dataclass(frozen=True)
class TorqueColumns:
    """The motion of one recording, and what effects would add to it.

    Attributes:
        robot: the model in the posture of the recording.
        cells: motion and commands.
    """

    robot: Robot
    cells: MotionCells
    _by_label: dict[str, Array] = field(default_factory=dict, repr=False)

    def alone(self, joint: int) -> MotionCells:
        """The cells of one joint, as far as their flags go."""
        return replace(self.cells, known=self.cells.known[:, [joint]])

    def of(self, hypothesis: EffectHypothesis, joint: int) -> list[Array] | None:
        """What a unit of each size adds to u (of commands) or to k u (of torques), shape (m,) each.

        None where an effect does not act on a joint, or no column of one joint tells it.
        """
        effect, owner = hypothesis.here.effect, hypothesis.here.owner
        own = owner == self.robot.joints[joint]
        if isinstance(effect, JointTorque):
            return self._torques(hypothesis, joint) if own and _is_plain(effect) else None
        if isinstance(effect, CommandEffect):
            slopes = effect.law(self.cells.edges, self.cells.u[:, joint], null_values(hypothesis))[1]
            return [-slopes[size.name] for size in hypothesis.sizes] if own else None
        if isinstance(effect, InertiaEffect):
            parts = [part[:, joint] for part in self._inertias(hypothesis)]
            return parts if any(part.any() for part in parts) else None
        if isinstance(effect, Structure) and effect.form == "gravity":
            return [tilt[:, joint] for tilt in self._tilts]
        if effect.id == TURN and owner in self.robot.joints:
            secant = self._secant(self.robot.joints.index(owner), hypothesis.shapes.get(ANGLE, 0.0) or SLOPE)[:, joint]
            return [secant] if secant.any() else None
        return None

    def _torques(self, hypothesis: EffectHypothesis, joint: int) -> list[Array]:
        effect, q, v = hypothesis.here.effect, self.cells.q[:, joint], self._v[:, joint]
        assert isinstance(effect, JointTorque)
        sharpness = self.robot.sharpness_of(self.robot.joints[joint])
        signals = JointSignals(q, v, q, v, self.weight[:, joint], 1.0, sharpness)
        p = null_values(hypothesis)
        steps = [{**p, size.name: p[size.name] + 1j * STEP} for size in hypothesis.sizes]
        return [np.broadcast_to(-np.imag(effect.law(signals, step)) / STEP, q.shape) for step in steps]

    @cached_property
    def _v(self) -> Array:
        return np.asarray(0.5 * (self.cells.v_smooth[1:] + self.cells.v_smooth[:-1]))

    @cached_property
    def weight(self) -> Array:
        """Torque that holds every joint against gravity, shape (m, n) [N m]."""
        still = np.zeros_like(self._v)
        return self.robot.tree.torque(self.cells.q, still, still)

    def _inertias(self, hypothesis: EffectHypothesis) -> Array:
        """Torques that a unit of each size asks for at all joints, shape (sizes, m, n)."""
        label, effect, tree = hypothesis.label, hypothesis.here.effect, self.robot.tree
        assert isinstance(effect, InertiaEffect)
        if label not in self._by_label:
            owner = hypothesis.here.owner
            body = tree.model.getJointId(effect.joint_of(self.robot, owner))
            directions = effect.change_at(self.robot, owner, tree.model.inertias[body].toDynamicParameters())
            changes = [InertiaChange(s.name, body, np.asarray(directions[s.name], float)) for s in hypothesis.sizes]
            self._by_label[label] = inertia_torques(tree, changes, self.cells.q, self._v, self.cells.a, 1.0)
        return self._by_label[label]

    def _secant(self, turned: int, angle: float) -> Array:
        """Change of all torques with a joint's encoder that reads an angle [rad] too much, over it, shape (m, n)."""
        key = f"{turned} {angle!r}"
        if key not in self._by_label:
            q, v, a, tree = self.cells.q, self._v, self.cells.a, self.robot.tree
            changed = tree.torque(q - angle * np.eye(q.shape[1])[turned], v, a) - tree.torque(q, v, a)
            some = np.abs(changed) > np.finfo(float).eps * 1e3 * np.max(np.abs(changed), initial=1.0)
            self._by_label[key] = np.where(some, changed, 0.0) / angle
        return self._by_label[key]

    @cached_property
    def _tilts(self) -> list[Array]:
        return tilt_torques(self.robot.tree, self.robot.tree, self.cells.q, np.zeros(2))


def has_columns(effect: Effect) -> bool:
    """Whether an effect acts on rigid joints only in ways that columns tell."""
    if isinstance(effect, JointTorque):
        return _is_plain(effect)
    gravity = isinstance(effect, Structure) and effect.form == "gravity"
    return gravity or effect.id == TURN or isinstance(effect, CommandEffect | InertiaEffect)


def _is_plain(effect: JointTorque) -> bool:
    """Whether a law has a meaning without a spring and a state of its own."""
    return effect.side != "spring" and effect.memory is None and not effect.gap
