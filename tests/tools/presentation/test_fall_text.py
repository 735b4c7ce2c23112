# SPDX-License-Identifier: BSD-3-Clause
"""By how much chi-square falls, in words."""

from __future__ import annotations

import pytest

from jointscope.tools.presentation.numbers import fall_text


@pytest.mark.parametrize(
    ("fall", "said"), [(-3e-21, "no change"), (0.0, "no change"), (9e-3, "no change"), (0.02, "0.0200"), (153.4, "153")]
)
def test_what_rounding_makes_of_nothing_is_no_change(fall, said):
    assert fall_text(fall) == said
