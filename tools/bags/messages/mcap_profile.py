# SPDX-License-Identifier: BSD-3-Clause
"""Which messages an MCAP file holds, by its first record: the format carries more than those of ROS 2."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
HEADER = 0x01  # opcode of the record that begins a file
LONGEST = 200  # [bytes] of a name that is worth a sentence


def other_profile(path: Path) -> str | None:
    """What to say of an MCAP file whose messages are not those of ROS 2.

    Args:
        path: the file.

    Returns:
        A sentence without its end; None for files of ROS 2, damaged ones, and everything else.

    Source: specification of MCAP, records "Header" and "well-known profiles".
    """
    profile, library = None, ""
    if path.suffix == ".mcap" and path.is_file():
        with suppress(OSError, struct.error, UnicodeDecodeError):  # damaged: the reader has the words for it
            profile, library = _header(path)
    if profile is None or profile == "ros2":
        return None
    written = f", written by {library}" if library else ""
    if profile == "ros1":
        return f"it holds messages of ROS 1{written}; give the .bag that it was made of"
    named = f"its profile is {profile!r}" if profile else "it names no profile"
    return f"it holds no messages of ROS 2, {named}{written}; write them as ROS 2 messages, with rosbags for example"


def _header(path: Path) -> tuple[str | None, str]:
    """Profile and library; no profile where the file is no MCAP."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC or file.read(1) != bytes([HEADER]):
            return None, ""
        file.read(8)  # length of the record
        texts = []
        for _ in range(2):
            (length,) = struct.unpack("<I", file.read(4))
            text = file.read(min(length, LONGEST))
            file.seek(length - len(text), 1)
            texts.append(text.decode())
    return texts[0], texts[1]
