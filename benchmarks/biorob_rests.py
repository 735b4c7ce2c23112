# SPDX-License-Identifier: BSD-3-Clause
"""BioRob on its bench: weights and postures alone, with a motion in the same graph, and what each kind is worth."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader
from tables import Section, Table

from jointscope import calibrate
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.refits.validation import heldout_error
from jointscope.graphs.rests.calibrate_rests import RestCalibration, calibrate_rests
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.verb_parts.rest_runs import read_all_rests

Array = NDArray[np.float64]
MOST_LOAD = 0.2  # [N m] at a motor, up to which friction is compared
RADII = (0.0079, 0.0121, 0.0121, 0.0090)  # [m] of the motors' pulleys
SETTLED = 0.8  # [s] at the end of a rest
MASSES = {"1.2": "1.0", "0.9": "1.05", "0.13": "0.16", "0.2": "0.17"}  # [kg] of the URDF, and others
Found = CalibrationResult | RestCalibration


def _silent(text: str, share: float) -> None:
    """Progress that nobody sees."""


def rests_alone(data: Path) -> Section:
    """Nothing but rests: what moves only in motion stays where it was."""
    result, cpu, wall = _calibrated(data, motion=False)
    truth = _truth(data)
    rows = _statics(result, truth, _reach(data), 0.3, 5.0)
    weighed, *_ = _calibrated(data, motion=False, masses=False)
    rows.append(_gravity(weighed, truth))
    rows.append(("calibrated [CPU s; wall s]", "", f"{cpu:.0f}; {wall:.0f}"))
    return Section("BioRob, rests alone", "Four sets of weights and 25 postures.", tables=[_table("rests", rows)])


def together(data: Path) -> Section:
    """Rests and 20 s of motion in one graph, judged on other moves; then each kind is left out."""
    result, cpu, wall = _calibrated(data)
    truth, seconds = _truth(data), _seconds(data)
    rows = _statics(result, truth, _reach(data), 0.2, 1.0)
    weighed, *_ = _calibrated(data, masses=False)
    rows.append(_gravity(weighed, truth))
    off = {name: _off(result, name, value) for name, value in true_drives(truth).items()}
    inertia, damping = ([off[f"joint{i + 1}.{law}"] for i in range(4)] for law in ("inertia", "k_mi"))
    robot = load_robot("biorob")
    test = read_recording(next(iter(sorted((data / "clean").glob("test*")))), robot)
    held = heldout_error(result.robot, test) / heldout_error(_true_robot(truth), test)
    rows += [
        ("rotor inertias, largest error [%]", "1", f"{max(inertia):.2g}"),
        ("total damping of motors, largest error [%]", "0.3", f"{max(damping):.2g}"),
        ("held out, 0.1 s ahead, over that of the true parameters", "1.05", f"{held:.4g}"),
        ("calibrated [CPU s; wall s]; wall over the length of all recordings", "0.25", _cost(cpu, wall, seconds)),
    ]
    shared = Table("What each kind is worth", ("value", "sigma together", "without"), _sharing(data, result))
    title = "BioRob, rests and motion in one graph"
    return Section(title, "Calibrated with all, judged on `test`.", tables=[_table("together", rows), shared])


def _table(name: str, rows: Sequence[tuple[str, str, str]]) -> Table:
    return Table(name, ("what", "at most", "measured"), rows)


def _cost(cpu: float, wall: float, seconds: float) -> str:
    return f"{cpu:.0f}; {wall:.0f}; {wall / seconds:.2g}"


@cache
def _calibrated(data: Path, motion: bool = True, rests: bool = True, masses: bool = True) -> tuple[Found, float, float]:
    """The result, CPU and wall seconds."""
    sets = [*sorted((data / "static_spring").glob("spring?")), data / "static_gravity" / "gravity"]
    moves = sorted((data / "clean").glob("train*"))[:1]
    robot = load_robot("biorob") if masses else _of_unknown_masses()
    cpu, wall = time.process_time(), time.perf_counter()
    if motion:
        result = calibrate(robot, moves, rests=sets if rests else [])
    else:
        result = calibrate_rests(robot, read_all_rests(sets, robot, _silent), _silent)
    return result, time.process_time() - cpu, time.perf_counter() - wall


def _of_unknown_masses() -> Robot:
    """The ready robot with other masses in its URDF, and masses and first moments to be found."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "biorob"
        shutil.copytree(ready_robots()["biorob"].parent, folder)
        urdf = folder / "biorob.urdf"
        text = urdf.read_text(encoding="utf-8")
        for true, other in MASSES.items():
            assert text.count(f'mass value="{true}"') == 1
            text = text.replace(f'mass value="{true}"', f'mass value="{other}"')
        urdf.write_text(text, encoding="utf-8")
        robot = load_robot(str(folder / "biorob.yaml"))
        for i in range(4):
            robot = add_effect(robot, f"link_mass@joint{i + 1}")
        return robot


def _statics(
    result: Found, truth: dict[str, Any], reach: Array, springs: float, friction: float
) -> list[tuple[str, str, str]]:
    """Rows of springs, friction and gravity, beside what is wanted in percent."""
    derived = {entry.name: entry for entry in result.derived}
    force = []
    for i, powers in enumerate(truth["spring_N_per_m_powers_1_2_3"]):
        x = np.linspace(*reach[i], 101)
        own = [derived.get(f"joint{i + 1}.spring.a{k}") for k in (1, 2, 3)]
        found = _polynomial([0.0 if entry is None else entry.value for entry in own])
        true = _polynomial(powers)
        force.append(100.0 * float(np.abs(found(x) - true(x)).max() / np.abs(true(x)).max()))
    rubbed = []
    for i, powers in enumerate(truth["friction_Nm_powers_0_1_2_of_abs_load"]):
        load = np.linspace(0.0, MOST_LOAD, 41)
        found, true = (
            c[0] + c[1] * load + c[2] * load**2
            for c in ([derived[f"motor{i + 1}.friction.c{k}"].value for k in range(3)], powers)
        )
        rubbed.append(100.0 * float(np.sqrt(np.mean((found / true - 1.0) ** 2))))
    return [
        ("spring forces over the measured range, of the largest [%]", f"{springs}", _each(force)),
        (f"friction up to a load of {MOST_LOAD} N m, rms [%]", f"{friction:.0f}", _each(rubbed)),
    ]


def _gravity(result: Found, truth: dict[str, Any]) -> tuple[str, str, str]:
    """A row of gravity from a model that knows no mass."""
    derived = {entry.name: entry.value for entry in result.derived}
    beta = [100.0 * abs(derived[f"gravity.beta{k + 1}"] / v - 1.0) for k, v in enumerate(truth["beta"])]
    return "gravity, beta 1 to 5, from masses that are 15 to 23 % off [%]", "1", _each(beta)


def _each(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2g}" for value in values)


def _polynomial(powers: Sequence[float]) -> Callable[[Array], Array]:
    return lambda x: sum((a * x ** (k + 1) for k, a in enumerate(powers)), np.zeros_like(x))


def _off(result: Found, name: str, true: float) -> float:
    return 100.0 * abs(result.robot.parameters[name].value / true - 1.0)


def _sharing(data: Path, both: Found) -> list[tuple[str, str, str]]:
    """Sigmas that grow when a kind is left out."""
    rows = []
    for name, kind in (
        ("joint1.stiffness", {"rests": False}),
        ("joint1.spring_curve.cubic", {"rests": False}),
        ("joint2.stiffness", {"rests": False}),
        ("joint1.coulomb_torque", {"motion": False}),
        ("joint2.weight_dependent_friction.coefficient", {"motion": False}),
    ):
        alone, *_ = _calibrated(data, **kind)
        grown = _sigma(alone, name) / _sigma(both, name)
        rows.append((name, f"{_sigma(both, name):.3g}", f"{next(iter(kind))}: {grown:.6g} times"))
    return rows


def _sigma(result: Found, name: str) -> float:
    return next(estimate.sigma for estimate in result.parameters if estimate.name == name)


def true_drives(true: dict[str, Any]) -> dict[str, float]:
    """Friction, rotors, total damping of motors and damping of links, by the names of the robot file."""
    found = {}
    for i in range(4):
        joint, friction = f"joint{i + 1}", true["friction_Nm_powers_0_1_2_of_abs_load"][i]
        found[f"{joint}.coulomb_torque"] = friction[0]
        found[f"{joint}.weight_dependent_friction.coefficient"] = friction[1]
        found[f"{joint}.weight_dependent_friction.quadratic"] = friction[2]
        found[f"{joint}.inertia"] = true["motor_inertia_pulley_kgm2"][i]
        back, own = (true[f"{name}_pulley_Nms_per_rad"][i] for name in ("back_emf_damping", "motor_viscous"))
        found[f"{joint}.k_mi"] = back + own
        found[f"{joint}.link_viscous.coefficient"] = true["link_damping_Nms_per_rad"][i]
    return found


def _true_robot(true: dict[str, Any]) -> Robot:
    """The ready robot with the true values."""
    values = true_drives(true)
    for i, r in enumerate(RADII):
        joint, spring = f"joint{i + 1}", true["spring_N_per_m_powers_1_2_3"][i]
        values[f"{joint}.stiffness"] = spring[0] * r**2
        values[f"{joint}.damping"] = true["spring_damping_Ns_per_m"][i] * r**2
        if any(spring[1:]):
            values[f"{joint}.spring_curve.quadratic"] = -spring[1] * r**3
            values[f"{joint}.spring_curve.cubic"] = spring[2] * r**4
    return load_robot("biorob").with_values(values)


def _truth(data: Path) -> dict[str, Any]:
    truth = json.loads((data / "clean" / "truth.json").read_text(encoding="utf-8"))
    return dict(truth["train"]["true"])


def _reach(data: Path) -> Array:
    """Least and largest extension of each spring at rest, shape (4, 2) [m]: x = r (theta - J_t^-1 q)."""
    found = []
    for folder, name in (("static_spring", "spring?"), ("static_gravity", "gravity")):
        truth = json.loads((data / folder / "truth.json").read_text(encoding="utf-8"))
        for bag in sorted((data / folder).glob(name)):
            own = truth[bag.name]
            streams = _positions(bag)
            for rest in own["rests"]:
                motor, joint = (_mean(*streams[topic], rest["t1"]) for topic in ("/motor_states", "/joint_states"))
                found.append(np.array(own["base"]["r"]) * (motor - np.linalg.solve(own["base"]["J_t"], joint)))
    return np.column_stack([np.min(found, axis=0), np.max(found, axis=0)])


def _positions(bag: Path) -> dict[str, tuple[Array, Array]]:
    rows: dict[str, list[tuple[float, Array]]] = {"/motor_states": [], "/joint_states": []}
    with AnyReader([bag]) as reader:
        first = None
        for connection, _, raw in reader.messages([c for c in reader.connections if c.topic in rows]):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            first = stamp if first is None else first
            rows[connection.topic].append((stamp - first, np.array(message.position)))
    return {topic: (np.array([t for t, _ in own]), np.array([q for _, q in own])) for topic, own in rows.items()}


def _mean(times: Array, values: Array, end: float) -> Array:
    return np.asarray(values[(times > end - SETTLED) & (times <= end)].mean(axis=0))


def _seconds(data: Path) -> float:
    """Length of all recordings together."""
    bags = [*(data / "static_spring").glob("spring?"), data / "static_gravity" / "gravity"]
    bags += sorted((data / "clean").glob("train*"))[:1]
    found = 0.0
    for bag in bags:
        with AnyReader([bag]) as reader:
            found += 1e-9 * reader.duration
    return found
