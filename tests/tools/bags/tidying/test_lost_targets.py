# SPDX-License-Identifier: BSD-3-Clause
"""A tracker that loses its target: what it sends then is left out and counted, and nothing else is."""

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.lost_targets import without_lost

T = np.arange(2000) / 200.0  # [s]


def moving(step=0.0):
    """Ten seconds of a target that swings through half a metre, stands, and swings again."""
    rng = np.random.default_rng(3)
    t = np.minimum(T, 4.0) + np.maximum(T - 6.0, 0.0)
    values = np.column_stack([0.5 * np.sin(2.0 * t), 0.3 * np.cos(3.0 * t), 1.0 + 0.1 * t])
    values += 5e-4 * rng.normal(size=values.shape)
    return np.round(values / step) * step if step else values


def tidied(values):
    stamps = (T * 1e9).astype(np.int64)
    kept, notices = without_lost("marker", TimedSamples(stamps, stamps, values))
    return np.isin(stamps, kept.stamps), [notice.text for notice in notices]


@pytest.mark.parametrize("step", [0.0, 1e-3, 0.02])
def test_motion_and_rest_of_fine_and_coarse_trackers_stay(step):
    kept, texts = tidied(moving(step))
    assert kept.all() and not texts


@pytest.mark.parametrize(
    ("spoil", "kind"),
    [
        (lambda part: 0.0 * part, "60 zeros"),
        (lambda part: part + np.array([0.4, 0.0, 0.0]), "60 of a jump away and back"),
        (lambda part: np.repeat(part[:1], len(part), axis=0), "59 repetitions of one position"),
    ],
)
def test_a_lost_target_is_left_out_with_its_count(spoil, kind):
    values = moving()
    values[300:360] = spoil(values[300:360])
    kept, texts = tidied(values)
    assert np.flatnonzero(~kept).tolist() in (list(range(300, 360)), list(range(301, 360)))
    assert len(texts) == 1 and kind in texts[0] and "marker: left out" in texts[0] and "of 2000" in texts[0]


def test_a_lost_target_at_the_beginning_and_at_the_end_is_left_out():
    values = moving()
    values[:40], values[1950:] = 0.0, values[1950:] + 0.5
    kept, _ = tidied(values)
    assert np.flatnonzero(kept).tolist() == list(range(40, 1950))


def test_a_hole_in_which_the_target_moves_on_is_no_jump():
    values = moving()
    values[500:560] = 0.0
    kept, texts = tidied(values)
    assert kept[560:].all() and "60 zeros" in texts[0] and "jump" not in texts[0]


def test_a_tracker_that_sees_nothing_most_of_the_time_is_refused():
    values = moving()
    values[700:] = 0.0
    with pytest.raises(RecordingError, match=r"1300 samples of 2000 without its target .* expected at most 50 %"):
        tidied(values)
