# SPDX-License-Identifier: BSD-3-Clause
"""M(q) a + c(q, v) + g(q) = tau of a tree of bodies: for many samples, and for one at a time.

Accelerations of many samples and their derivatives are those of tree_recursion.py, all else is pinocchio's. Where
coordinates are coupled,
q_model = G q + offset, the same laws hold for what is left,

    M = G' M_model G,    tau = G' tau_model,    a = M^-1 (tau - c - g),
    da/dq = -M^-1 G' (dtau_model/dq_model at q, v, a) G,    likewise by v.

pinocchio returns windows into its `data`, which its next call overwrites: everything that leaves here is a copy.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.coupling import Coupling
from jointscope.robots.bodies.joint_table import JointTable

Array = NDArray[np.float64]
Derivatives = tuple[Array, Array, Array, Array]


class OwnData(threading.local):
    """Where pinocchio computes: of each thread its own, as results stand there until they are copied.

    Args:
        model: of pinocchio.

    Attributes:
        data: for its functions.
        pool: for those of many samples.
    """

    def __init__(self, model: pin.Model):
        self.model, self.data, self.pool = model, model.createData(), pin.ModelPool(model, 1)

    def __reduce__(self) -> tuple[type[OwnData], tuple[pin.Model]]:
        """Pinocchio cannot pickle a pool; a copy makes its own."""
        return OwnData, (self.model,)


class FreeEquations:
    """Equations of a model whose coordinates are all free.

    Args:
        model: pinocchio model with one-axis joints.
    """

    def __init__(self, model: pin.Model):
        self._model, self._own = model, OwnData(model)

    @cached_property
    def _table(self) -> JointTable:
        return JointTable.of(self._model)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """Accelerations of many samples; arguments and result of shape (m, n)."""
        if len(q) == 1:
            return self.acceleration_at(q[0], v[0], tau[0])[None]
        return self._recursion(q, v, tau, wanted=0)[0]

    def derivatives(self, q: Array, v: Array, tau: Array) -> Derivatives:
        """Accelerations, shape (m, n), and their derivatives by q, v and tau, each of shape (m, n, n)."""
        return self._recursion(q, v, tau, wanted=len(q))

    def _recursion(self, q: Array, v: Array, tau: Array, wanted: int) -> Derivatives:
        from jointscope.robots.bodies.tree_recursion import accelerations  # numba takes half a second to import

        m, n = q.shape
        a, by_q, by_v, M_inverse = np.empty((m, n)), *np.empty((3, wanted, n, n))
        motion = (np.ascontiguousarray(x, dtype=np.float64) for x in (q, v, tau))
        table = self._table
        accelerations(table.parents, table.rows, table.gravity, *motion, a, by_q, by_v, M_inverse)
        return a, by_q, by_v, M_inverse

    def acceleration_at(self, q: Array, v: Array, tau: Array) -> Array:
        """Accelerations at one state, shape (n,)."""
        return np.array(pin.aba(self._model, self._own.data, q, v, tau))

    def derivatives_at(self, q: Array, v: Array, tau: Array) -> Derivatives:
        """As `derivatives`, at one state."""
        by_q, by_v, M_inverse = pin.computeABADerivatives(self._model, self._own.data, q, v, tau)
        return self._own.data.ddq.copy(), by_q.copy(), by_v.copy(), M_inverse.copy()

    def torque(self, q: Array, v: Array, a: Array) -> Array:
        """Torques of given motion; arguments and result of shape (m, n)."""
        tau = np.empty(q.shape[::-1], order="F")
        columns = (np.asfortranarray(part.T) for part in (q, v, a))
        pin.rneaInParallel(1, self._own.pool, *columns, tau)
        return np.ascontiguousarray(tau.T)

    def body_torques(self, joints: Sequence[int], parameters: Array, q: Array, v: Array, a: Array) -> Array:
        """Torques that bodies ask for, each alone, shape (c, m, n): they are linear in its parameters.

        Args:
            joints: index in pinocchio's model of the joint that moves each body.
            parameters: dynamic parameters of each, or changes of them, shape (c, 10).
            q: positions, shape (m, n), as v and a.
            v: velocities.
            a: accelerations.
        """
        from jointscope.robots.bodies.body_torques import body_torques  # numba takes half a second to import

        table, tau = self._table, np.zeros((len(joints), *q.shape))
        motion = (np.ascontiguousarray(x, dtype=np.float64) for x in (q, v, a))
        body_torques(table.parents, table.rows, table.gravity, *table.rows_of_bodies(joints, parameters), *motion, tau)
        return tau

    def gravity_derivatives(self, q: Array) -> Array:
        """Derivatives of the torques of gravity by q, shape (m, n, n)."""
        by_q = np.empty((len(q), self._model.nv, self._model.nv))
        for k in range(len(q)):
            by_q[k] = pin.computeGeneralizedGravityDerivatives(self._model, self._own.data, q[k])
        return by_q

    def mass_matrix(self, q: Array) -> Array:
        """M(q), shape (m, n, n)."""
        M = np.empty((len(q), self._model.nv, self._model.nv))
        for k in range(len(q)):
            M[k] = pin.crba(self._model, self._own.data, q[k])
        return M


class CoupledEquations:
    """Equations of a model whose coordinates follow fewer joints, or are in another order.

    Args:
        model: pinocchio model with one-axis joints.
        coupling: its coordinates from those of the joints.
    """

    def __init__(self, model: pin.Model, coupling: Coupling):
        self._model, self._own = model, OwnData(model)
        self._coupling, self._G = coupling, coupling.G
        self._free = FreeEquations(model)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """As `FreeEquations.acceleration`."""
        bias = self.torque(q, v, np.zeros_like(q))
        return np.asarray(np.linalg.solve(self.mass_matrix(q), (tau - bias)[:, :, None])[:, :, 0], float)

    def derivatives(self, q: Array, v: Array, tau: Array) -> Derivatives:
        """As `FreeEquations.derivatives`."""
        coupling, G = self._coupling, self._G
        M_inverse = np.asarray(np.linalg.inv(self.mass_matrix(q)), dtype=np.float64)
        a = (M_inverse @ (tau - self.torque(q, v, np.zeros_like(q)))[:, :, None])[:, :, 0]
        by_q, by_v = np.empty((2, len(q), len(G), len(G)))
        motion = coupling.positions(q), coupling.rates(v), coupling.rates(a)
        model, data, derivatives = self._model, self._own.data, pin.computeRNEADerivatives
        for k, (q_model, v_model, a_model) in enumerate(zip(*motion, strict=True)):
            by_q[k], by_v[k], _ = derivatives(model, data, q_model, v_model, a_model)
        return a, -M_inverse @ (G.T @ by_q @ G), -M_inverse @ (G.T @ by_v @ G), M_inverse

    def acceleration_at(self, q: Array, v: Array, tau: Array) -> Array:
        """As `FreeEquations.acceleration_at`."""
        q_model, G = self._coupling.positions(q), self._G
        bias = G.T @ pin.nonLinearEffects(self._model, self._own.data, q_model, self._coupling.rates(v))
        return np.asarray(np.linalg.solve(G.T @ pin.crba(self._model, self._own.data, q_model) @ G, tau - bias), float)

    def derivatives_at(self, q: Array, v: Array, tau: Array) -> Derivatives:
        """As `FreeEquations.derivatives_at`."""
        q_model, v_model, G = self._coupling.positions(q), self._coupling.rates(v), self._G
        bias = G.T @ pin.nonLinearEffects(self._model, self._own.data, q_model, v_model)
        M_inverse = np.linalg.inv(G.T @ pin.crba(self._model, self._own.data, q_model) @ G)
        a = M_inverse @ (tau - bias)
        by_q, by_v, _ = pin.computeRNEADerivatives(self._model, self._own.data, q_model, v_model, G @ a)
        return a, -M_inverse @ (G.T @ by_q @ G), -M_inverse @ (G.T @ by_v @ G), M_inverse

    def torque(self, q: Array, v: Array, a: Array) -> Array:
        """As `FreeEquations.torque`."""
        coupling = self._coupling
        return coupling.torques(self._free.torque(coupling.positions(q), coupling.rates(v), coupling.rates(a)))

    def body_torques(self, joints: Sequence[int], parameters: Array, q: Array, v: Array, a: Array) -> Array:
        """As `FreeEquations.body_torques`."""
        coupling = self._coupling
        motion = coupling.positions(q), coupling.rates(v), coupling.rates(a)
        return np.array([coupling.torques(tau) for tau in self._free.body_torques(joints, parameters, *motion)])

    def gravity_derivatives(self, q: Array) -> Array:
        """As `FreeEquations.gravity_derivatives`."""
        return self._G.T @ self._free.gravity_derivatives(self._coupling.positions(q)) @ self._G

    def mass_matrix(self, q: Array) -> Array:
        """As `FreeEquations.mass_matrix`."""
        return self._G.T @ self._free.mass_matrix(self._coupling.positions(q)) @ self._G


Equations = FreeEquations | CoupledEquations


def equations_of(model: pin.Model, coupling: Coupling | None) -> Equations:
    """The equations of a model."""
    return FreeEquations(model) if coupling is None else CoupledEquations(model, coupling)
