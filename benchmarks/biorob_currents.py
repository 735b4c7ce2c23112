# SPDX-License-Identifier: BSD-3-Clause
"""BioRob with the currents of its motors as a sensor beside volts: what they tell, and what they are worth."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.read_recording import read_recording

SENSOR = """  current:
    kind: motor_current
    topic: /motor_states
    type: sensor_msgs/msg/JointState
    field: effort
    names: [motor1, motor2, motor3, motor4]
    unit: A
    sigma: 0.02

effects:
"""
START = 0.5  # [N m/A] of all joints; the true ones lie between 0.44 and 0.60


def currents(data: Path) -> Section:
    """Torque of one ampere, back-EMF and friction of the bearings by the currents of `train`."""
    robot = _with_currents()
    recording = read_recording(next(iter(sorted((data / "clean").glob("train*")))), robot)
    truth = json.loads((data / "clean" / "truth.json").read_text(encoding="utf-8"))["train"]["true"]
    found = calibrate(robot, [recording]).robot
    sensor = robot.motor_current
    assert sensor is not None
    alone = calibrate(robot.without([sensor]), [recording]).robot
    rows = []
    for j, joint in enumerate(robot.joints):
        k = found.parameters[sensor.torque_per_ampere(joint)]
        gain, damping = (found.parameters[f"{joint}.{name}"] for name in ("k_pwm", "k_mi"))
        back_emf, viscous = k.value * gain.value, damping.value - k.value * gain.value
        wanted = (truth["back_emf_damping_pulley_Nms_per_rad"][j], truth["motor_viscous_pulley_Nms_per_rad"][j])
        inertia = f"{joint}.inertia"
        worth = (alone.parameters[inertia].sigma or np.nan) / (found.parameters[inertia].sigma or np.nan)
        rows.append(
            (
                joint,
                f"{k.value:.5f} +- {k.sigma or np.nan:.5f}",
                f"{100.0 * (back_emf / wanted[0] - 1.0):+.3f} %",
                f"{viscous:.5f} ({wanted[1]:.3f})",
                f"{worth:.2f}",
            )
        )
    delay = found.motor_current
    assert delay is not None
    rows.append(("delay [ms]", f"{1e3 * delay.delay:.4f} +- {1e3 * (delay.delay_sigma or np.nan):.4f} (0)", "", "", ""))
    titles = (
        "joint",
        "torque per ampere [N m/A]",
        "back-EMF against the truth",
        "viscous friction of the motor [N m s/rad] (true)",
        "sigma of the rotor's inertia without them",
    )
    text = "`train` of `clean`, with the currents of its motors beside the volts; every constant begins at 0.5 N m/A."
    return Section("BioRob, currents beside volts", text, tables=[Table("currents", titles, rows)])


def _with_currents() -> Robot:
    """The ready robot with the sensor."""
    text = (
        ready_robots()["biorob"]
        .read_text(encoding="utf-8")
        .replace("urdf: biorob.urdf ", "urdf: ready:biorob/biorob.urdf ")
    )
    own = "".join(
        f"  current.torque_per_ampere_joint{j}: {{value: {START}, unit: N m/A, prior_sigma: {START}}}\n"
        for j in range(1, 5)
    )
    text = text.replace("effects:\n", SENSOR, 1).replace("  joint1.k_pwm", f"{own}  joint1.k_pwm", 1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "biorob.yaml"
        path.write_text(text, encoding="utf-8")
        return load_robot(str(path))
