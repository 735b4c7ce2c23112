# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file about a gyroscope."""

from __future__ import annotations

from jointscope.tools.init.estimates.gyro_mount import Mount
from jointscope.tools.init.estimates.joint_signs import SignGuess
from jointscope.tools.init.robot_guess import GuessedGyro
from jointscope.tools.init.text.robot_line import as_list, line, plain
from jointscope.tools.init.text.source_text import sigma_line, source_lines


def gyro_lines(gyro: GuessedGyro, signs: SignGuess) -> list[str]:
    """Its section; `signs` are those of the encoders."""
    mount = gyro.mount
    R = [[round(float(x), 4) + 0.0 for x in row] for row in mount.R_imu_body]
    return [
        f"  {gyro.name}:",
        "    kind: gyro",
        *source_lines(gyro.signal, mount.unit),
        line(f"body: {plain(mount.body)}", _seat(mount), False, 4),
        "    form: full",
        sigma_line(gyro.noise, mount.unit),
        "    bias: {value: [0.0, 0.0, 0.0], prior_sigma: 0.1}",
        *_handed(mount, signs),
        line("R_imu_body:", _turned(mount), False, 4),
        f"      value: [{', '.join(as_list(row) for row in R)}]",
        "      prior_sigma: 0.1",
    ]


def _handed(mount: Mount, signs: SignGuess) -> list[str]:
    if not mount.left_handed:
        return []
    text = "only a reflection explains it; x is turned, then R_imu_body holds"
    if signs.others:
        others = " or ".join(as_list(other) for other in signs.others)
        text += f"; as well: no reflection, but `scale: {others}` of command and encoder, joints that count backwards"
    return [line("left_handed: true", text, False, 4)]


def _seat(mount: Mount) -> str:
    text = f"the encoders explain {100 * (1 - mount.left):.1f} % of its motion if it sits there"
    return f"{text}, and about as much on {', '.join(mount.others)}" if mount.others else text


def _turned(mount: Mount) -> str:
    text = "right angles" if mount.square else "not in right angles"
    return f"{text}; the link turns about one axis only, the rotation about it is open" if mount.open_axis else text
