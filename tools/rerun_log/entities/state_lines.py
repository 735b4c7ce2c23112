# SPDX-License-Identifier: BSD-3-Clause
"""Smoothed states with their +-3 sigma bands, joint by joint, with the measured motor position beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.calibration.calibration_result import BagFit
from jointscope.robots.model.robot import Robot
from jointscope.tools.rerun_log.entities.columns import GREY, JOINT_COLOURS, send_band, send_lines
from jointscope.tools.rerun_log.entities.viewer_text import entity, viewer_text

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

PLOTS = (("position", "rad"), ("deflection", "rad"), ("v_link", "rad/s"), ("v_motor", "rad/s"))


def send_states(stream: rr.RecordingStream, robot: Robot, fit: BagFit, root: str) -> None:
    """Entities states/JOINT/QUANTITY below `root`."""
    n, t = robot.n, fit.ticks
    states, sigmas = robot.layout.by_joint(fit.states), robot.layout.by_joint(fit.sigmas)
    encoder = fit.residuals.get(robot.motor_encoder.name)
    for i, joint in enumerate(robot.joints):
        path, colour = entity(root, "states", joint), JOINT_COLOURS[i % 6]
        q_link, v_link, q_motor, v_motor = (states[:, k * n + i] for k in range(4))
        s_q_link, s_v_link, _, s_v_motor = (sigmas[:, k * n + i] for k in range(4))
        if encoder is not None:
            measured = encoder.measured[:, i : i + 1]
            send_lines(stream, f"{path}/position/measured", encoder.times, measured, ["measured"], [GREY], 2.5)
        both = np.column_stack([q_link, q_motor])
        dim = (colour[0] // 2 + 60, colour[1] // 2 + 60, colour[2] // 2 + 60)
        send_lines(stream, f"{path}/position/estimated", t, both, ["q_link", "q_motor"], [colour, dim])
        for name, value, sigma in (
            ("deflection", q_link - q_motor, s_q_link),
            ("v_link", v_link, s_v_link),
            ("v_motor", v_motor, s_v_motor),
        ):
            send_lines(stream, f"{path}/{name}/value", t, value[:, None], [name], [colour])
            send_band(stream, f"{path}/{name}/band", t, value[:, None], 3.0 * sigma[:, None], [colour])


def state_views(robot: Robot, root: str) -> rrb.Horizontal:
    """One column per joint, one row per quantity."""
    import rerun.blueprint as rrb

    return rrb.Horizontal(
        *(
            rrb.Vertical(
                *(
                    rrb.TimeSeriesView(
                        origin="/" + entity(root, "states", joint, name),
                        name=viewer_text(f"{joint} {name} [{robot.unit_at(joint, unit)}]"),
                    )
                    for name, unit in PLOTS
                )
            )
            for joint in robot.joints
        ),
        name="states",
    )
