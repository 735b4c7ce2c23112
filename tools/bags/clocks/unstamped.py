# SPDX-License-Identifier: BSD-3-Clause
"""Messages without stamps: when they were sent follows from when they came in, and from how long messages take.

    sent = received - smallest typical latency of other messages (received - stamp), on the same way to the recorder

Without it a command would seem to act before it was sent, which no model explains; what is left is a delay, which
`command_delay` finds.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointscope.robots.recordings.recording import Notice
from jointscope.tools.bags.clocks.durations import duration
from jointscope.tools.bags.clocks.timed_samples import TimedSamples

NO_STAMP = "its messages carry no stamp"
LONGEST = 0.05  # [s] a longer latency is that of a driver, not of the transport, or of another clock


def sent_earlier(
    name: str, samples: TimedSamples, stamped: Mapping[str, TimedSamples], why: str = NO_STAMP
) -> tuple[TimedSamples, Notice]:
    """The samples of a stream without stamps at the times at which they were sent.

    Args:
        name: of the stream.
        samples: stamped by their reception.
        stamped: the streams that carry stamps.
        why: it counts as one without.
    """
    latencies = [float(np.median(s.latency)) for s in stamped.values() if len(s) and s.reception_tells]
    usual = min(latencies, default=0.0)
    shift = usual if 0.0 < usual < LONGEST else 0.0
    less = f", less the {duration(shift)} that other messages take" if shift else ""
    text = (
        f"{name}: {why}; the time of reception stands in for it{less}; if the model does not "
        "fit, look for a delay: jointscope add ROBOT command_delay@robot -o ROBOT_command_delay.yaml"
    )
    if name != "command":
        text = text.partition("; if")[0]
    return samples.stamped(samples.stamps - round(1e9 * shift)), Notice(name, "info", len(samples), text)
