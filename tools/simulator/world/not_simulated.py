# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the catalogue that cannot be switched on in a simulation, because the engine always has them or never.

They are candidates for a robot file that leaves them out, so that is how to simulate them.
"""

from __future__ import annotations

NOT_SIMULATED = {
    "coriolis": "every simulation contains the Coriolis terms; calibrate with 'coriolis: false' in the robot file",
    "load_scale": "no loads hang on a simulated arm in motion; simulate payload",
    "joint_elasticity": "a joint is simulated as its robot file has it; calibrate with a file that declares it rigid",
    **{
        f"spring_pieces_{pieces}": "a real spring has no knots; simulate spring_ropes, spring_curve or spring_limit"
        for pieces in (1, 2, 4)
    },
    "integration_error": "the engine integrates exactly; calibrate with 'integrator: euler' in the robot file",
}
