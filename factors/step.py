# SPDX-License-Identifier: BSD-3-Clause
"""What the three dynamics factors share: the steps between ticks, their commands and their noise.

Variables: X(k), X(k+1), dynamics. Disturbances are torques: the link rows are turned from velocities into impulses by
the mass matrix at the measured angles (a known weight W, stated on the mean inertia of each joint so that it keeps the
unit of a velocity). The residual of step k has two halves: velocities d_v and positions. White noise W of density s on
the velocities leaves the defects

    d_v = s W(h),   d_q = s int W - (h/2) s W(h)   where positions follow the mean velocity of both ends,
                    d_q = s int W                  where they follow the velocity at the beginning (euler),

so int W - (h/2) W(h), which is independent of W(h), is the second half: d_q itself, and with Euler's rule
d_q - (h/2) d_v. Standard deviations are s sqrt(h) and s h sqrt(h/12); the positions follow from the velocities and need
no noise of their own. With `independent` position noise (eq. 36 of Schuethe et al. 2016) the second half is always d_q.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.factor import Samples
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Steps:
    """Steps between consecutive ticks.

    Attributes:
        h: length of each step, shape (m,) [s].
        u: command logged for each step, shape (m, n), SI unit of the command.
        noise: densities of the process noise.
        layout: of the states.
        weight: W of each step, shape (m, n_link, n_link); None for the identity.
        path: how the commands act, where effects change them; None where they act as logged.
        index: place of each step in the path, shape (m,).
        free: least density of the velocities in each step [rad/s/sqrt(s)], shape (m, k), where something acts that no
            law tells, such as a hand, or friction that holds; 0 where the equation binds, None where all do.
        sliding: how sharply the dry friction of each joint turns over at the beginning and the end of each step, as a
            part of what its law says, shape (m, 2, n); None where all is as it says.
        rise: by how much u rises over each step, shape (m, n), where no path says it; None where it is constant.
    """

    h: Array
    u: Array
    noise: ProcessNoise
    layout: StateLayout
    weight: Array | None = None
    path: CommandPath | None = None
    index: NDArray[np.intp] | None = None
    free: Array | None = None
    sliding: Array | None = None
    rise: Array | None = None

    def __len__(self) -> int:
        return len(self.h)

    def select(self, samples: Samples) -> Steps:
        """Some of the steps."""
        weight = None if self.weight is None else self.weight[samples]
        index = None if self.index is None else self.index[samples]
        free = None if self.free is None else self.free[samples]
        sliding = None if self.sliding is None else self.sliding[samples]
        part = replace(self, h=self.h[samples], u=self.u[samples], weight=weight, index=index)
        return replace(part, free=free, sliding=sliding, rise=None if self.rise is None else self.rise[samples])

    def halves(self, values: dict[str, float]) -> tuple[Steps, Steps]:
        """The first and the second half of each step, with what acts there at values of the robot's parameters."""
        (u, _), (rise, _), h = self.acting(values), self.rising(values), 0.5 * self.h
        plain = replace(self, h=h, u=u, path=None, index=None)
        if rise is None:
            return plain, plain
        first, second = (replace(plain, u=u + side * rise, rise=0.5 * rise) for side in (-0.25, 0.25))
        return first, second

    @property
    def begins(self) -> Array | None:
        """How sharply friction turns over where each step begins, shape (m, n)."""
        return None if self.sliding is None else self.sliding[:, 0]

    @property
    def ends(self) -> Array | None:
        """The same where it ends."""
        return None if self.sliding is None else self.sliding[:, 1]

    @property
    def throughout(self) -> Array | None:
        """The same of a whole step."""
        return None if self.sliding is None else self.sliding.min(axis=1)

    @property
    def at_ticks(self) -> Array | None:
        """The same at the ticks of steps side by side, shape (m + 1, n)."""
        return None if self.sliding is None else np.vstack([self.sliding[:, 0], self.sliding[-1:, 1]])

    def acting(self, values: dict[str, float]) -> tuple[Array, dict[str, Array]]:
        """Commands that act, shape (m, n), and their derivatives by parameters of effects, by full name.

        Args:
            values: parameters of the robot by full name.
        """
        if self.path is None:
            return self.u, {}
        u, slopes = self.path.acting(values)
        return u[self.index], {name: slope[self.index] for name, slope in slopes.items()}

    def rising(self, values: dict[str, float]) -> tuple[Array | None, dict[str, Array]]:
        """By how much what acts rises over each step, shape (m, n), with derivatives; None where commands are constant.

        Args:
            values: parameters of the robot by full name.
        """
        if self.path is None or not self.path.runs_on:
            return self.rise, {}
        u, slopes = self.path.acting(values)
        return self.path.rises(u)[self.index], {name: self.path.rises(own)[self.index] for name, own in slopes.items()}

    @property
    def integrated(self) -> bool:
        """Whether the position noise follows from the velocity noise."""
        return self.noise.model == "integrated"

    @property
    def sigmas(self) -> Array:
        """Standard deviations of the rows (velocities, memories, positions; link before motor), shape (m, d)."""
        h, root = self.h[:, None], np.sqrt(self.h)[:, None]
        rates, k = rate_sigmas(self.noise, h), len(self.layout.velocities)
        if self.free is not None:  # memories follow the motion, which the sensors see
            rates[:, :k] = np.maximum(rates[:, :k], self.free * root)
        positions = position_sigmas(self.noise, rates[:, :k], h)
        if self.free is not None and not self.integrated:
            positions = np.maximum(positions, self.free * root * h)
        return np.hstack([rates, positions])

    def combine(self, d_v: Array, d_q: Array, behind: float = 0.0) -> Array:
        """Stacks rate and position defects (axis 1) into the rows whose noise is independent.

        Where W is given, link rows become impulses on the mean inertia.
        `behind` is that of the rule; see `DynamicsFactor`.
        """
        if not self.integrated:
            return np.concatenate([d_v, d_q], axis=1)
        from jointscope.factors.step_kernel import combine  # numba takes half a second to import

        shape = (len(d_v), d_v.shape[1] + d_q.shape[1], *d_v.shape[2:])
        weight = np.zeros((len(d_v), 0, 0)) if self.weight is None else self.weight
        found = np.empty((*shape[:2], d_v[:1, 0].size))
        parts = (np.ascontiguousarray(d.reshape(*d.shape[:2], -1)) for d in (d_v, d_q))
        combine(np.ascontiguousarray(weight), 0.5 * behind * self.h, *parts, found)
        return found.reshape(shape)


def rate_sigmas(noise: ProcessNoise, h: Array) -> Array:
    """Standard deviations of velocity and memory defects over steps of length h, shape (m, 1) [s]; shape (m, r)."""
    return np.concatenate([noise.link_velocity, noise.motor_velocity, noise.memory]) * np.sqrt(h)


def position_sigmas(noise: ProcessNoise, velocity: Array, h: Array) -> Array:
    """Standard deviations of the position rows of these steps, shape (m, k), with those of their velocities."""
    if noise.model == "integrated":
        return velocity * (h / np.sqrt(12.0))
    return np.broadcast_to(noise.position * np.sqrt(h), velocity.shape)


def row_names(layout: StateLayout) -> tuple[str, ...]:
    """Names of the rows of a dynamics factor."""
    sides = [f"{name}.link" for name in layout.links] + [f"{joint}.motor" for joint in layout.motors]
    velocities = [f"{side}_velocity" for side in sides]
    return (*velocities, *layout.memories, *(f"{side}_position" for side in sides))


def selectors(layout: StateLayout) -> tuple[Array, Array]:
    """Matrices that pick all positions, and all velocities with memories, from a state: (k, d) and (r, d)."""
    eye = np.eye(layout.size)
    return eye[layout.positions], eye[layout.rates]
