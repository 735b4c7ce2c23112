# SPDX-License-Identifier: BSD-3-Clause
"""Rests, poses and frequency responses count once, also where a copy has another name; motion has its own refusal."""

from __future__ import annotations

import pytest

from jointscope.robots.errors import RecordingError
from jointscope.tools.verb_parts.pose_runs import check_one_kind


@pytest.mark.parametrize("kind", ["poses", "rests", "frequency"])
def test_a_copy_of_a_recording_is_refused(tmp_path, kind):
    one, copy, other = (tmp_path / name for name in ("one.csv", "copy.csv", "other.csv"))
    for path, text in ((one, "a"), (copy, "a"), (other, "b")):
        path.write_text(text)
    given = {"poses": (), "rests": (), "frequency": ()}
    check_one_kind((), **given | {kind: (one, other)}, options={})
    for twice in (copy, one):
        with pytest.raises(
            RecordingError, match=f"--{kind}: .* is the same recording as .*one.csv; give every recording"
        ):
            check_one_kind((), **given | {kind: (one, other, twice)}, options={})
    check_one_kind((), **given | {kind: (tmp_path / "nowhere", tmp_path / "nowhere")}, options={})  # told on reading
