# SPDX-License-Identifier: BSD-3-Clause
"""What is said of a topic on which several nodes publish: the rate of each, and only gaps that a node has itself."""

from __future__ import annotations

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.tools.bags.descriptions.describe_bag import describe_bag


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    urdf = write_urdf(tmp_path_factory.mktemp("urdf") / "arm.urdf", {"a": None, "b": "a", "hand": "b"})
    return ArmMotion(urdf, ("a", "b"), {"hand": 0.2})  # 6 s at 200 Hz


@pytest.mark.parametrize("late", [0, 1_300_000], ids=["at the same stamps", "between them"])
@pytest.mark.parametrize("every", [1, 4, 7])
def test_messages_of_one_node_are_no_gaps_and_no_rate_of_another(motion, tmp_path, every, late):
    hand = motion.states(["hand"]) | {"rows": range(0, len(motion.times), every), "stamped": lambda stamp: stamp + late}
    topics = {"/joint_states": motion.states(["a", "b"]), "/joint_states#hand": hand}
    (topic,) = describe_bag(write_arm_bag(tmp_path / "n.mcap", motion.times, topics)).topics
    assert topic.rate == pytest.approx(200.0, rel=1e-3) and topic.gaps == 0 and topic.jitter < 1e-6
    if every > 1 or late:
        (said,) = topic.remarks
        assert said.startswith(f"several nodes publish on it: a, b at 200.00 Hz; hand at {200.0 / every:.2f} Hz")


def test_a_gap_of_one_node_is_its_own(motion, tmp_path):
    count = len(motion.times)
    arm = motion.states(["a", "b"]) | {"rows": [k for k in range(count) if not 400 <= k < 500]}
    hand = motion.states(["hand"]) | {"rows": range(1, count, 4)}
    bag = write_arm_bag(tmp_path / "g.mcap", motion.times, {"/joint_states": arm, "/joint_states#hand": hand})
    (topic,) = describe_bag(bag).topics
    assert topic.gaps == 1 and topic.missing == 100
    assert topic.longest_gap == pytest.approx(0.505, abs=0.01)


def test_one_node_is_described_as_before(motion, tmp_path):
    bag = write_arm_bag(tmp_path / "o.mcap", motion.times, {"/joint_states": motion.states()})
    (topic,) = describe_bag(bag).topics
    assert topic.rate == pytest.approx(200.0, rel=1e-3) and topic.gaps == 0 and topic.remarks == ()
    assert np.isfinite(topic.jitter)
