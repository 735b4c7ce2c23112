#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# mcap-ros2-support 0.5.7, which writes ROS 2 messages into MCAP files without ROS, names types in two parts in its own example
# ("tf2_msgs/TFMessage"), reads them back, and so do viewers. rosbags 0.11.9 opens such a file, lists the topic and counts its
# messages, and then fails to decode the first one with a KeyError: it looks for "geometry_msgs/msg/Point".
# What helps: register the definition under the name in three parts; the bytes are the same. Bags written with it are read anywhere.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip --quiet --disable-pip-version-check install \
    "mcap==1.3.1" "mcap-ros2-support==0.5.7" "rosbags==0.11.9" "numpy==2.4.6"
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer
from rosbags.highlevel import AnyReader

for name in ("geometry_msgs/Point", "geometry_msgs/msg/Point"):
    path = Path(name.replace("/", "_") + ".mcap")
    with path.open("wb") as file:
        writer = Writer(file)
        schema = writer.register_msgdef(name, "float64 x\nfloat64 y\nfloat64 z\n")
        for k in range(3):
            writer.write_message("/tip", schema, {"x": 1.0 + k, "y": 0.0, "z": 0.0}, log_time=k, publish_time=k)
        writer.finish()
    own = [message.ros_msg.x for message in read_ros2_messages(str(path))]
    with AnyReader([path]) as bag:
        counted, listed = bag.message_count, [connection.msgtype for connection in bag.connections]
        try:
            read = [float(bag.deserialize(data, link.msgtype).x) for link, _, data in bag.messages()]
        except KeyError as err:
            read = err
    print(f"{name}: mcap-ros2-support {version('mcap-ros2-support')} {own}; rosbags {version('rosbags')} {counted} messages of {listed}, {read!r}")
    assert own == [1.0, 2.0, 3.0] and counted == 3 and listed == [name]
    assert read == own if name.count("/") == 2 else isinstance(read, KeyError)
PYTHON
