# SPDX-License-Identifier: BSD-3-Clause
"""What a joint with one axis does when it moves."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray


def motion_axis(joint: pin.JointModel) -> NDArray[np.float64]:
    """What a joint does at unit velocity, in its own frame: linear, then angular, shape (6,).

    It is asked as the only joint of a model: pinocchio has no other way to it, and the data of a large model take a
    tenth of a second to make.
    """
    alone = pin.Model()
    alone.addJoint(0, joint, pin.SE3.Identity(), "alone")
    jacobian = pin.computeJointJacobian(alone, alone.createData(), pin.neutral(alone), 1)
    # a single column comes back as a vector
    return np.array(jacobian.reshape(6, alone.nv)[:, 0])
