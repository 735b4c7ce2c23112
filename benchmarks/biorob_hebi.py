# SPDX-License-Identifier: BSD-3-Clause
"""Spring curves of real series-elastic arms (HEBI) by the laws of this project, beside the maker's own calibration.

The modules report a torque that they compute from the deflection they measure, with the maker's stiffness. Motor and
link encoders tell the deflection independently, with steps of 0.6 to 3.9 mrad.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from patience import say
from tables import Section, Table

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.transmission.calibrate_links import calibrate_links
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

ARMS = (  # robot, recording, joints whose springs bend by several steps of their encoders: the maker's stiffness
    ("hebi_2r", "arm2_ps2_virtual_spring", {"joint1": 70.0}),
    ("hebi_2r", "arm2_ps2_grav_comp_bad", {"joint1": 70.0}),
    ("hebi_5r", "arm5_capstone_robot_data", {"joint1": 130.0, "joint2": 130.0, "joint4": 120.0}),
    ("hebi_5r", "arm5_milestone_repeat_waypoints", {"joint2": 120.0}),
)
SHARES = (0.25, 0.5, 1.0)  # of the largest torque
SURE = 3.0  # [sigma] from which a term is in the model
CUBIC, GAP = "spring_cubic.stiffness", "backlash.half_gap"
HEAD = ("recording, joint", "torque [N m]", "deflection found [mrad]", "maker's [mrad]", "apart [sigma]", "law")


def hebi(real: Path) -> Section:
    """Each spring's curve: straight, with a cubic term or a gap before it where the recording shows them."""
    section = Section(
        "HEBI arms, spring curves",
        "Deflection of a spring at some torques, with one sigma, beside the torque over the maker's stiffness. A cubic "
        f"term and a gap before the spring are in the model where they are {SURE:g} sigma from zero; deflections are "
        "those beyond the gap.",
    )
    rows = []
    for name, bag, makers in ARMS:
        say(f"hebi: {bag}")
        base = load_robot(name)
        recording = read_recording(real / "hebi_arms_mit" / bag, base)
        for joint, stiffness in makers.items():
            rows += _rows(base, recording, bag, joint, stiffness)
    section.tables.append(Table("Springs", HEAD, rows))
    return section


def _rows(base: Robot, recording: Recording, bag: str, joint: str, stiffness: float) -> list[tuple[str, ...]]:
    """One spring at some torques."""
    found, terms = _told(base, recording, joint)
    names = [f"{joint}.joint_elasticity.compliance", *([f"{joint}.{CUBIC}"] if CUBIC in terms else [])]
    index = [found.names.index(name) for name in names]
    own = [found.robot.parameters[name] for name in names]
    sigmas = np.array([parameter.sigma for parameter in own])
    covariance = found.correlation[np.ix_(index, index)] * np.outer(sigmas, sigmas)
    c, k3 = own[0].value, own[1].value if len(own) > 1 else 0.0
    sensor, law = base.torque_sensor, "cubic" if CUBIC in terms else "straight"
    if GAP in terms:
        law += f", {1e3 * found.robot.parameters[f'{joint}.{GAP}'].value:.1f} mrad of half a gap"
    assert sensor is not None
    most = float(np.abs(recording.streams[sensor.name].values[:, base.joints.index(joint)]).max())
    rows = []
    for tau in (share * most for share in SHARES):
        deflection, makers = c * tau - k3 * c**4 * tau**3, tau / stiffness
        by = np.array([tau - 4.0 * k3 * c**3 * tau**3, -(c**4) * tau**3])[: len(own)]
        sigma = float(np.sqrt(by @ covariance @ by))
        cells = (f"{tau:.2f}", f"{1e3 * deflection:.2f} +- {1e3 * sigma:.2f}", f"{1e3 * makers:.2f}")
        rows.append((f"{bag}, {joint}", *cells, f"{(deflection - makers) / sigma:+.1f}", law))
    return rows


def _told(base: Robot, recording: Recording, joint: str) -> tuple[CalibrationResult, list[str]]:
    """A calibration with those terms of the spring that the recording shows, and these terms."""
    terms = [CUBIC, GAP]
    while True:
        robot = add_effect(base, f"joint_elasticity@{joint}")
        for term in terms:
            robot = add_effect(robot, f"{term.split('.')[0]}@{joint}")
        try:
            found = calibrate_links(robot, [recording])
        except SolveError:
            terms.pop()
            continue
        own = {term: found.robot.parameters[f"{joint}.{term}"] for term in terms}
        faint = {term: abs(p.value) / (p.sigma or np.inf) for term, p in own.items()}
        least = min(terms, key=lambda term: faint[term], default=None)
        if least is None or faint[least] >= SURE:
            return found, terms
        terms.remove(least)
