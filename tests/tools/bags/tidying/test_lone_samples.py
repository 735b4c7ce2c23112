# SPDX-License-Identifier: BSD-3-Clause
"""A wild stamp stretches no recording over years; recordings that were interrupted keep both sides."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.tools.bags.clocks.timed_samples import TimedSamples
from jointscope.tools.bags.tidying.lone_samples import without_lone_samples

NOW = 1_700_000_000 * 10**9
YEAR = 365 * 24 * 3600 * 10**9


def samples(stamps):
    stamps = np.array(stamps, dtype=np.int64)
    return TimedSamples(stamps, stamps, np.arange(len(stamps), dtype=float)[:, None])


def regular(n=200, offset=0):
    return NOW + offset + 10_000_000 * np.arange(n)


@pytest.mark.parametrize(("far", "where"), [(-54 * YEAR, "before"), (3 * YEAR, "after")])
def test_a_wild_stamp_is_left_out_and_said(far, where):
    times = np.sort(np.append(regular(offset=3_000_000), NOW + far))
    kept, (notice,) = without_lone_samples({"command": samples(regular()), "encoder": samples(times)})
    np.testing.assert_array_equal(kept["encoder"].stamps, regular(offset=3_000_000))
    assert len(kept["command"]) == 200
    assert notice.stream == "encoder" and notice.kind == "dropped" and notice.count == 1
    assert f"{where} all others" in notice.text and "years" in notice.text


def test_wild_stamps_on_both_sides_and_of_two_streams():
    times = np.concatenate([[NOW - 54 * YEAR], regular(), [NOW + 2 * YEAR]])
    other = np.concatenate([[NOW - 20 * YEAR], regular(offset=2_000_000)])
    kept, notices = without_lone_samples({"command": samples(times), "encoder": samples(other)})
    assert len(kept["command"]) == len(kept["encoder"]) == 200
    assert sorted((n.stream, n.count) for n in notices) == [("command", 1), ("command", 1), ("encoder", 1)]


def test_both_sides_of_an_interruption_stay():
    times = np.concatenate([regular(), regular(offset=YEAR)])
    streams = {"command": samples(times), "encoder": samples(times + 2_000_000)}
    kept, notices = without_lone_samples(streams)
    assert not notices and all(len(kept[name]) == 400 for name in streams)


def test_a_stream_of_another_time_stays_whole_and_is_somebody_elses_error():
    streams = {"command": samples(regular()), "encoder": samples(regular(offset=YEAR))}
    kept, notices = without_lone_samples(streams)
    assert not notices and len(kept["encoder"]) == 200
