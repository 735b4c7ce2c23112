# SPDX-License-Identifier: BSD-3-Clause
"""An arm whose dry friction truly holds a joint that stands: MuJoCo's own engine with `frictionloss`.

As MuJoCo comes, such a joint creeps by 1 ms times the acceleration that it is kept from. With the solver's reference
stiff and its impedance next to one that becomes 1e-7 s, far below what any encoder sees.
"""

from __future__ import annotations

import mujoco
import numpy as np
from arm_bodies import ArmBodies
from arm_drives import Drives
from numpy.typing import NDArray

Array = NDArray[np.float64]
LONGEST_STEP = 2.5e-4  # [s]
STIFF = (0.002, 1.0)  # [s], damping ratio
NEXT_TO_ONE = (0.9999, 0.9999, 0.001, 0.5, 2.0)


class StickingArm:
    """Moves an arm under torques that hold.

    Args:
        bodies: of an arm without joints that follow others.
        drives: rotors, friction.
    """

    def __init__(self, bodies: ArmBodies, drives: Drives):
        if len(bodies.moving) != len(bodies.joints):
            raise ValueError("the friction of a joint that others follow cannot be given to MuJoCo")
        model = bodies.engine
        self._joint = np.array([bodies.joints.index(name) for name in bodies.moving])
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        model.opt.tolerance, model.opt.iterations = 1e-12, 50
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_REFSAFE
        model.dof_armature[:] = drives.inertia[self._joint]
        model.dof_damping[:] = drives.viscous[self._joint]
        model.dof_frictionloss[:] = drives.coulomb[self._joint]
        model.dof_solref[:], model.dof_solimp[:] = STIFF, NEXT_TO_ONE
        M = bodies.mass_matrix(np.zeros(len(bodies.joints))) + np.diag(drives.inertia)
        # masses were put in after the compiler had worked this out
        model.dof_invweight0[:] = np.diag(np.linalg.inv(M))[self._joint]
        self._model, self._data = model, mujoco.MjData(model)

    def advance(self, q: Array, v: Array, tau: Array, duration: float) -> tuple[Array, Array]:
        """State after a time [s] under a torque, each of shape (n,)."""
        if duration <= 0.0:
            return q, v
        model, data = self._model, self._data
        steps = int(np.ceil(duration / LONGEST_STEP))
        model.opt.timestep = duration / steps
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[self._joint], v[self._joint], tau[self._joint]
        for _ in range(steps):
            mujoco.mj_step(model, data)
        q, v = np.empty_like(q), np.empty_like(v)
        q[self._joint], v[self._joint] = data.qpos, data.qvel
        return q, v
