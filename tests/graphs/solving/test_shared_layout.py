# SPDX-License-Identifier: BSD-3-Clause
"""Recordings with different blocks in one vector."""

from __future__ import annotations

import numpy as np

from jointscope.factors.block import VECTOR, Block
from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.shared_layout import SharedLayout


def test_recordings_of_one_robot_stand_in_the_order_shared_then_bag_after_bag(doggy):
    calibration = Calibration.of(doggy)
    p, shared = len(calibration.names), SharedLayout.of(calibration, 2)
    assert shared.size == p + 6 + 12
    assert np.array_equal(shared.indices(0), np.arange(p + 12))
    assert np.array_equal(shared.indices(1), np.r_[: p + 6, p + 12 : p + 18])


def test_pieces_of_a_recording_share_what_is_its_own(doggy):
    shared = SharedLayout.of(Calibration.of(doggy), (0, 1, 0))
    assert np.array_equal(shared.indices(0), shared.indices(2))
    assert shared.size == SharedLayout.of(Calibration.of(doggy), 2).size


def test_recordings_see_only_the_blocks_that_they_touch(doggy):
    motion = Calibration.of(doggy)
    rests = motion.only(["dynamics"]).with_blocks([(Block("rests.zero", VECTOR, "recording", 2, "z"), np.zeros(2))])
    shared = SharedLayout.of([motion, rests], 2)
    assert shared.size == motion.size + 2
    assert shared.places[1]["dynamics"] == shared.places[0]["dynamics"]
    assert set(shared.indices(0)) & set(shared.indices(1)) == set(range(len(motion.names)))
    step = shared.step(np.arange(float(shared.size)), 1)
    assert list(step) == ["dynamics", "rests.zero"] and list(step["rests.zero"]) == [motion.size, motion.size + 1]
