# SPDX-License-Identifier: BSD-3-Clause
"""The names of geometric errors and of what sags, as they stand in robot files.

Of every joint: where it is mounted (`lx ly lz` in the axes of the link before it), how its axis is tilted (`mis_y`,
then `mis_x`), the zero of its encoder (`offset`); of the tracker and of the target where they are. Neubauer et al.
(2015), Sec. 3, count them so. All are zero on a nominal arm.
"""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS, misplacement_names
from jointscope.robots.parts.parameter import Parameter

TRACKER, TOOL = "tracker", "tool"
BACKLASH = "backlash"  # w of Neubauer et al. (2015), eq. 18: minus half of the gap
HALF_GAP = "backlash.half_gap"  # the same gap as motion has it, -w
WAVES = ("encoder_eccentricity.cos", "encoder_eccentricity.sin")  # of what an encoder reads too much
WAVES_ORDER = "encoder_eccentricity.order"  # periods per turn of the joint; one where it is no parameter
RIPPLE = ("gear_ripple.cos", "gear_ripple.sin", "gear_ripple.order")  # of a gear's error, `order` times per turn
STIFFNESS = "stiffness"  # of a drive
CUBIC = "spring_cubic.stiffness"  # of a drive that hardens
BEARING = ("bearing.stiffness_x", "bearing.stiffness_y")
DAMPING = "damping"  # of a drive
TILT_DAMPING = ("bearing.damping_x", "bearing.damping_y")
PAYLOAD = "robot.payload.mass"  # a point at the target, which the URDF does not know
LINK_MASS = "link_mass.mass"  # what the link behind a joint weighs more than in the URDF, of its own material
LINK_MOMENTS = tuple(f"link_mass.{axis}" for axis in "xyz")  # first moments more than that, in the axes of the link
LINK_INERTIA = "inertia_error.about_axis"  # of the link behind a joint, more than in the URDF, about the joint's axis
TORQUE_SHARE = "torque_constant_error.share"  # motors make 1 + share of the torque that they say
TORQUE_DELAY = "robot.torque_delay.seconds"  # by which torques are said too late
VISCOUS = "motor_viscous.coefficient"  # of a motor that is shaken
STRIBECK = "motor_stribeck.torque"  # of the breakaway of a motor's dry friction over that while it turns
LOAD_FRICTION = "load_dependent_friction.coefficient"  # of the torque that a drive passes on


def error_names(joints: Sequence[str], others: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of all geometric errors along a chain of joints, from the tracker to the target, and further targets."""
    return (*(f"{TRACKER}.{part}" for part in LENGTHS), *misplacement_names([*joints, TOOL, *others]))


def is_geometry(name: str) -> bool:
    """Whether a parameter is a geometric error: priors share out combinations of them that move no target."""
    owner, _, part = name.partition(".")
    return bool(owner) and part in (*LENGTHS, *ANGLES)


def is_length(name: str) -> bool:
    """Whether an error is a length [m]; the others are angles [rad]."""
    return name.rpartition(".")[2] in LENGTHS


def error_parameters(
    joints: Sequence[str], length_sigma: float, angle_sigma: float, others: Sequence[str] = ()
) -> dict[str, Parameter]:
    """All errors at zero, with the sizes that they may have as standard deviations of their priors [m], [rad]."""
    found = {}
    for name in error_names(joints, others):
        unit, sigma = ("m", length_sigma) if is_length(name) else ("rad", angle_sigma)
        found[name] = Parameter(name, 0.0, unit, 0.0, sigma, positive=False)
    return found


def pose_units(joints: Sequence[str], others: Sequence[str] = ()) -> dict[str, str]:
    """Units of all parameters that poses may tell, by name."""
    units = {name: "m" if is_length(name) else "rad" for name in error_names(joints, others)}
    for joint in joints:
        units |= {f"{joint}.{BACKLASH}": "rad", f"{joint}.{STIFFNESS}": "N m/rad"}
        units |= {f"{joint}.{part}": "N m/rad" for part in BEARING} | {f"{joint}.{part}": "rad" for part in WAVES}
    return units
