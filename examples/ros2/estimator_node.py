# SPDX-License-Identifier: BSD-3-Clause
"""A ROS 2 node around the fixed-lag estimator: joint states, IMUs and commands in; state with covariance out.

    python estimator_node.py --ros-args -p robot:=arm_calibrated.yaml

It subscribes to the topics that the robot file names, and publishes
  ~/joint_states  sensor_msgs/JointState         positions and velocities of the links
  ~/state         std_msgs/Float64MultiArray     mean of the whole state, shape (d,)
  ~/covariance    std_msgs/Float64MultiArray     its covariance, shape (d, d)
  /diagnostics    diagnostic_msgs/DiagnosticArray  what was dropped, which channels the model does not explain
"""

from __future__ import annotations

from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

import jointscope as js
from jointscope.tools.bags.needed_streams import StreamSource, needed_streams

TYPES = {"sensor_msgs/msg/JointState": JointState, "sensor_msgs/msg/Imu": Imu}
DIAGNOSTICS = 1.0  # [s]


class EstimatorNode(Node):
    """Feeds the estimator with messages as they come; answers at a fixed rate."""

    def __init__(self) -> None:
        super().__init__("jointscope_estimator")
        robot = js.load_robot(self.declare_parameter("robot", "doggy").value)
        self.estimator = js.FixedLagEstimator(robot, lag=self.declare_parameter("lag", 0.1).value)
        self.joints = list(robot.joints)
        self.start: int | None = None  # [ns] stamp of time zero
        self.newest: Any = None  # newest stamp
        for stream in needed_streams(robot):
            if stream.source.msgtype not in TYPES:
                raise js.errors.RobotError(f"{stream.source.topic}: expected one of {', '.join(TYPES)}")
            take, kind = partial(self.take, stream), TYPES[stream.source.msgtype]
            for topic in map(str.strip, stream.source.topic.split("+")):  # one for each joint: /a/states + /b/states
                self.create_subscription(kind, topic, take, qos_profile_sensor_data)
        self.states = self.create_publisher(JointState, "~/joint_states", 10)
        self.means = self.create_publisher(Float64MultiArray, "~/state", 10)
        self.covariances = self.create_publisher(Float64MultiArray, "~/covariance", 10)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(1.0 / self.declare_parameter("rate", 200.0).value, self.tell_state)
        self.create_timer(DIAGNOSTICS, self.tell_diagnostics)

    def take(self, stream: StreamSource, message: Any) -> None:
        """One message, in SI units and in the order of the robot's joints."""
        stamp = message.header.stamp
        nanoseconds = stamp.sec * 10**9 + stamp.nanosec
        self.start = nanoseconds if self.start is None else self.start
        value = attrgetter(stream.source.field)(message)
        if stream.source.msgtype.endswith("Imu"):
            values = np.array([value.x, value.y, value.z])
        else:
            by_name = dict(zip(message.name, value, strict=False))
            names = stream.source.names or self.joints
            values = np.array([by_name.get(name, np.nan) for name in names])  # NaN: this channel is missing
            if not np.isfinite(values).any():
                return  # a message for other joints
        self.estimator.sample(stream.name, 1e-9 * (nanoseconds - self.start), values * stream.source.factor)
        if self.newest is None or (stamp.sec, stamp.nanosec) > (self.newest.sec, self.newest.nanosec):
            self.newest = stamp

    def tell_state(self) -> None:
        """Publishes the state at the newest stamp; nothing before the estimator knows one."""
        if not self.estimator.status.running:
            return
        x = self.estimator.state(1e-9 * (self.newest.sec * 10**9 + self.newest.nanosec - self.start))
        message = JointState(name=self.joints, position=x.q_link.tolist(), velocity=x.v_link.tolist())
        message.header.stamp = self.newest
        self.states.publish(message)
        self.means.publish(array(x.mean))
        self.covariances.publish(array(x.covariance))

    def tell_diagnostics(self) -> None:
        """Publishes counters; a warning where residuals are larger than the model allows, or a stream is lost."""
        status = self.estimator.status
        trouble = [f"not explained: {name}" for name in status.alarms] + [f"lost: {name}" for name in status.lost]
        level = DiagnosticStatus.OK if status.running and not trouble else DiagnosticStatus.WARN
        values = {f"NIS {name}": f"{nis:.2f}" for name, nis in status.nis.items()}
        values |= {f"dropped {name}": str(dict(kinds)) for name, kinds in status.dropped.items()}
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        message.status = [
            DiagnosticStatus(
                level=level,
                name="jointscope: estimator",
                message="; ".join(trouble) or ("running" if status.running else "waiting for samples"),
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        ]
        self.diagnostics.publish(message)


def array(values: np.ndarray) -> Float64MultiArray:
    """An array with its shape."""
    message = Float64MultiArray(data=values.ravel().tolist())
    message.layout.dim = [MultiArrayDimension(size=size) for size in values.shape]
    return message


def main() -> None:
    """Spins until it is stopped."""
    rclpy.init()
    node = EstimatorNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
