# SPDX-License-Identifier: BSD-3-Clause
"""What a robot file says of values that the regression does not give."""

import pytest

from jointscope.graphs.starts.drive_regression import Value
from jointscope.tools.init.text.drive_table import _cell
from jointscope.tools.init.text.drive_text import _why_lost


class Drive:
    unknown_scale = False


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (Value(-0.019, 0.0007), "below zero, which cannot be"),
        (Value(-0.001, 0.0007), "lost in its uncertainty: the regression says -0.001 +- 0.0007"),
        (Value(0.001, 0.0007), "lost in its uncertainty"),
        (None, "too short, or moves too little"),
    ],
)
def test_a_value_far_below_zero_is_not_called_uncertain(found, words):
    assert words in _why_lost(Drive(), found)


def test_a_friction_below_zero_is_marked_as_no_result():
    assert _cell(Value(-2.2, 0.5), positive=True) == "-2.2 +- 0.5 (!)"
    assert _cell(Value(-0.6, 0.5), positive=True) == "-0.6 +- 0.5" and _cell(Value(-2.2, 0.5)) == "-2.2 +- 0.5"
