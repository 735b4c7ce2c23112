# SPDX-License-Identifier: BSD-3-Clause
"""The frame of every recording in the viewer: tabs over the whole window, panels folded away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import rerun.blueprint as rrb


def tabbed_blueprint(tabs: Sequence[rrb.View | rrb.Container]) -> rrb.Blueprint:
    """A blueprint that opens on the first of the tabs."""
    import rerun.blueprint as rrb

    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed"),
        auto_views=False,
    )
