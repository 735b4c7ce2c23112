# SPDX-License-Identifier: BSD-3-Clause
"""As much of rclpy and of its messages as the example needs: a node that keeps what it subscribes to and publishes."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import ClassVar


class Message(SimpleNamespace):
    """A message of any type, with header and layout as generated ones have."""

    def __init__(self, **fields):
        stamp = SimpleNamespace(sec=0, nanosec=0)
        super().__init__(**{"header": SimpleNamespace(stamp=stamp), "layout": SimpleNamespace(dim=[])} | fields)


class JointState(Message):
    pass


class Imu(Message):
    pass


class DiagnosticStatus(Message):
    OK, WARN = b"\0", b"\1"


class Node:
    """Keeps callbacks by topic, timers by period, and published messages by topic."""

    parameters: ClassVar[dict] = {}

    def __init__(self, name):
        self.name, self.heard, self.timers, self.published = name, {}, {}, {}

    def declare_parameter(self, name, default):
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_subscription(self, kind, topic, callback, qos):
        self.heard.setdefault(topic, []).append((kind, callback))

    def create_publisher(self, kind, topic, depth):
        messages = self.published.setdefault(topic, [])
        return SimpleNamespace(publish=messages.append)

    def create_timer(self, period, callback):
        self.timers[period] = callback

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: SimpleNamespace(sec=0, nanosec=0)))

    def destroy_node(self):
        pass


CALLED: list[str] = []
"""What a program did with rclpy itself."""


def _noted(name):
    return lambda *_: CALLED.append(name)


def install(monkeypatch):
    """Puts the stand-ins where the example imports them from."""
    contents = {
        "rclpy": {"init": _noted("init"), "spin": _noted("spin"), "try_shutdown": _noted("try_shutdown")},
        "rclpy.node": {"Node": Node},
        "rclpy.qos": {"qos_profile_sensor_data": 10},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"Imu": Imu, "JointState": JointState},
        "std_msgs": {},
        "std_msgs.msg": {"Float64MultiArray": Message, "MultiArrayDimension": Message},
        "diagnostic_msgs": {},
        "diagnostic_msgs.msg": {
            "DiagnosticArray": Message, "DiagnosticStatus": DiagnosticStatus, "KeyValue": Message,
        },
    }  # fmt: skip
    for name, values in contents.items():
        module = ModuleType(name)
        vars(module).update(values)
        monkeypatch.setitem(sys.modules, name, module)
