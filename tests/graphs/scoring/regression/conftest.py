# SPDX-License-Identifier: BSD-3-Clause
"""A rigid arm whose commands are torques, and the same with currents."""

import pytest
from simulated_arm import Arm, robot_file

from jointscope.robots.files.robot_file import load_robot


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    """The robot with commands in N m, and in A."""
    arm = Arm()
    path = robot_file(arm, tmp_path_factory.mktemp("arm"))
    constants = "".join(f"\n  {joint}.torque_constant: {{value: 4.0, unit: N m/A}}" for joint in arm.joints)
    amperes = path.with_name("amperes.yaml")
    text = path.read_text(encoding="utf-8").replace("field: effort, unit: N m}", "field: effort, unit: A}")
    amperes.write_text(text + constants.lstrip("\n") + "\n", encoding="utf-8")
    return {"N m": load_robot(path), "A": load_robot(amperes)}
