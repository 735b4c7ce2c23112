# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import errno
import json
import math
from contextlib import ExitStack

import numpy as np
import pytest

from jointscope.robots.errors import JointscopeError, RobotError
from jointscope.tools.writing.whole_file import whole_file, write_json


def names(folder) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_the_file_appears_when_the_block_ends(tmp_path):
    with whole_file(tmp_path / "a.yaml") as unfinished:
        unfinished.write_text("new")
        assert unfinished.parent == tmp_path
        assert unfinished.suffix == ".yaml"
        assert not (tmp_path / "a.yaml").exists()
    assert (tmp_path / "a.yaml").read_text() == "new"
    assert names(tmp_path) == {"a.yaml"}


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_any_interruption_keeps_the_old_file(error, tmp_path):
    (tmp_path / "a.yaml").write_text("old")
    with pytest.raises(error), whole_file(tmp_path / "a.yaml") as unfinished:
        unfinished.write_text("half")
        raise error
    assert (tmp_path / "a.yaml").read_text() == "old"
    assert names(tmp_path) == {"a.yaml"}


def test_a_full_disk_names_the_file_that_the_user_knows(tmp_path):
    with pytest.raises(JointscopeError) as told, whole_file(tmp_path / "a.yaml") as unfinished:
        raise OSError(errno.ENOSPC, "No space left on device", str(unfinished))
    assert str(told.value) == f"cannot write {tmp_path}/a.yaml: No space left on device"


def test_errors_of_writers_name_the_file_that_the_user_knows(tmp_path):
    with pytest.raises(RobotError) as told, whole_file(tmp_path / "a.yaml") as unfinished:
        raise RobotError(f"{unfinished} is odd")
    assert str(told.value) == f"{tmp_path}/a.yaml is odd"


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(JointscopeError) as told, whole_file(tmp_path / "no" / "a") as unfinished:
        unfinished.write_text("x")
    assert str(told.value) == f"cannot write {tmp_path}/no/a: No such file or directory"


def test_of_several_files_all_appear_or_none(tmp_path):
    with pytest.raises(JointscopeError), ExitStack() as stack:
        stack.enter_context(whole_file(tmp_path / "a")).write_text("a")
        stack.enter_context(whole_file(tmp_path / "no" / "b")).write_text("b")
    assert names(tmp_path) == set()


def test_json_is_plain_and_strict(tmp_path):
    write_json(tmp_path / "a.json", {"a": np.float64(1.5), "b": (1, math.nan), "c": {"d": math.inf, "e": True}})
    content = json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail)
    assert content == {"a": 1.5, "b": [1, None], "c": {"d": None, "e": True}}
