# SPDX-License-Identifier: BSD-3-Clause
"""A URDF as a tree of elements to be changed and written again, comments and undeclared prefixes included."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

from jointscope.robots.errors import RobotError


def read_urdf(urdf: Path) -> ET.Element:
    """The root of a URDF.

    Raises:
        RobotError: the file cannot be read or is no XML.
    """
    builder = ET.TreeBuilder(insert_comments=True)
    parser = expat.ParserCreate()  # of ElementTree's own, prefixes that nothing declares are refused
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler, parser.CommentHandler = builder.data, builder.comment
    try:
        parser.Parse(urdf.read_bytes(), True)
    except (OSError, expat.ExpatError) as err:
        raise RobotError(f"{urdf}: cannot be read to be written again: {err}") from err
    return builder.close()


def urdf_text(root: ET.Element) -> str:
    """The text of a file, indented; the tree is."""
    ET.indent(root)
    stream = io.BytesIO()
    ET.ElementTree(root).write(stream, encoding="utf-8", xml_declaration=True)
    return stream.getvalue().decode() + "\n"
