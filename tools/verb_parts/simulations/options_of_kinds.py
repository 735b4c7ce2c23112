# SPDX-License-Identifier: BSD-3-Clause
"""Options of `simulate` that belong to some kinds of recordings: one that another kind would ignore is refused."""

from __future__ import annotations

import argparse

from jointscope.robots.errors import SimulationError

OF_KINDS = {
    "motion": ("motion",),
    "seconds": ("motion",),
    "weights": ("rests",),
    "at": ("rests",),
    "hold": ("rests",),
    "orientation": ("poses",),
    "pose": ("frequency",),
    "f0": ("frequency",),
    "share": ("frequency",),
    "count": ("rests", "poses", "frequency"),
}
"""Options that are empty unless somebody gives them, and the kinds that look at them."""


def refuse_other_options(args: argparse.Namespace, kind: str) -> None:
    """Refuses an option that this kind of recording has not.

    Raises:
        SimulationError: there is one.
    """
    for name, kinds in OF_KINDS.items():
        given = getattr(args, name)
        if kind not in kinds and given is not None and given is not False and given != []:
            wanted = " or ".join([", ".join(kinds[:-1]), kinds[-1]] if len(kinds) > 1 else kinds)
            raise SimulationError(f"--{name} is an option of --kind {wanted}; this is --kind {kind}: leave it out")
