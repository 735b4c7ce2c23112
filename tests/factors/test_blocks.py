# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of shared values: their manifolds, and what a calibration does with blocks of other kinds of recordings."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jointscope.factors.block import POINT, POSE3, ROT3, VECTOR, Block, BlockKind
from jointscope.factors.calibration import Calibration
from jointscope.factors.single import extract_calibration, insert_calibration

TURN = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
POSE = np.block([[TURN, np.array([[1.0], [2.0], [3.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])
MANIFOLDS = [(VECTOR, 2, np.array([1.0, -2.0])), (POINT, 3, np.arange(3.0)), (ROT3, 3, TURN), (POSE3, 6, POSE)]


@pytest.mark.parametrize(("kind", "size", "value"), MANIFOLDS, ids=lambda v: v.name if isinstance(v, BlockKind) else "")
def test_every_kind_moves_as_gtsam_moves_it(kind: BlockKind, size: int, value):
    step = np.random.default_rng(0).normal(size=size) * 0.3
    values = gtsam.Values()
    values.insert(7, kind.to_gtsam(value))
    delta = gtsam.VectorValues()
    delta.insert(7, step)
    moved = kind.from_gtsam(values.retract(delta), 7)
    assert moved == pytest.approx(kind.retract(value, step), abs=1e-12)
    assert kind.local(value, moved) == pytest.approx(step, abs=1e-12)


def test_blocks_of_other_kinds_stand_beside_those_of_the_robot(doggy):
    tracker = Block("tracker", POSE3, "session", 6, "t")
    offset = Block("rests.zero", VECTOR, "recording", 2, "z")
    plain = Calibration.of(doggy)
    more = plain.with_blocks([(offset, np.zeros(2)), (tracker, POSE)])
    # what each recording has for itself stays last
    assert more.blocks == (
        "dynamics",
        "imu1.rotation",
        "imu2.rotation",
        "tracker",
        "imu1.bias",
        "imu2.bias",
        "rests.zero",
    )
    assert more.size == plain.size + 8 and more.columns["rests.zero"].stop == more.size
    values = gtsam.Values()
    for recording in (0, 1):
        insert_calibration(values, more.with_points({"rests.zero": np.full(2, float(recording))}), recording)
    assert values.size() == 4 + 2 * 3
    assert np.array_equal(extract_calibration(values, more, bag=1)["rests.zero"], [1.0, 1.0])


def test_a_block_that_is_not_there_cannot_get_a_value(doggy):
    with pytest.raises(KeyError, match=r"no block imu3\.bias; there are dynamics"):
        Calibration.of(doggy).with_points({"imu3.bias": np.zeros(3)})
