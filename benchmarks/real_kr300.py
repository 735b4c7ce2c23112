# SPDX-License-Identifier: BSD-3-Clause
"""KR300: what bends between the encoders of motors and links, and what is only time."""

from __future__ import annotations

from real_recordings import left, recording, waterfall
from tables import Section

from jointscope.graphs.transmission.discover_links import discover_links
from jointscope.robots.files.robot_file import load_robot

STATED = (8.4, 11.8, 7.5)  # [%]
DELAY = 3.0e-3  # [s]


def run() -> Section:
    """Trajectories A and B for training, C held out, as the source has it."""
    robot = load_robot("kr300")
    a, b, c = (recording(robot, f"kr300/traj_{name}") for name in "ABC")
    result = discover_links(robot, [a, b], c)
    section = Section(
        "KR300, axes 1 to 3",
        "`discover` on trajectories A and B, C held out. Relative error: rms of what is left of motor encoder - link "
        "encoder over its rms, both without their means.",
    )
    for j, stated in enumerate(STATED):
        name = f"joint_a{j + 1}.gear"
        share = 100 * left(result, name, -1) / left(result, name, 0)
        section.promise(f"relative error of axis {j + 1}", f"{stated} %", f"{share:.1f} %", share <= stated)
    late = [c for step in result.steps if step.diagnosis for c in step.diagnosis.candidates[:1]]
    late = [c for c in late if c.label == "encoder_delay@link_encoder" and c.verdict == "missing"]
    delay = result.robot.parameters.get("link_encoder.encoder_delay.delay")
    found, sigma = (delay.value, delay.sigma or 0.0) if delay is not None else (float("nan"), 0.0)
    said = bool(late) and bool(late[0].look_alikes) and "say that it is time" in late[0].reasons[0]
    section.promise(
        "time offset of the encoders",
        "3.0 ms, named as time, friction as its look-alike",
        f"{1e3 * found:.2f} +- {1e3 * sigma:.2f} ms",
        said and abs(found - DELAY) < 2e-4,
    )
    section.notes += [c.reasons[0] for c in late]
    section.tables.append(waterfall("Held-out recording C, step by step", result))
    section.numbers["kr300"] = result.to_json()
    return section
