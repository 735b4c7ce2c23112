# SPDX-License-Identifier: BSD-3-Clause
"""States that name no joint: what to do is said, also where each joint has its own topic."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.tools.init.streams.roles import _need_joints


@pytest.mark.parametrize(
    ("columns", "said"), [(1, "let the driver fill `name`"), (2, "choose 2 of them with --joints")]
)
def test_states_without_names_are_told_with_the_way_out(columns, said):
    signal = SimpleNamespace(topic="/elbow/state", times=np.arange(500.0), values=np.zeros((500, columns)), names=())
    motors = SimpleNamespace(signal=signal, unclear="", names=())
    with pytest.raises(RecordingError) as error:
        _need_joints(motors, ("pan", "lift", "elbow"), {})
    assert str(error.value).endswith(said)
