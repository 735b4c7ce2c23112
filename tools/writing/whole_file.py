# SPDX-License-Identifier: BSD-3-Clause
"""Files that are written whole or not at all, and checked before the long computation that fills them.

A file is written beside its place under a hidden name and moved there at the end; whatever goes wrong in between
(an error, a full disk, Ctrl-C) leaves the old file as it was and nothing else behind. Several files in one
`contextlib.ExitStack` are moved only after all of them are complete.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from jointscope.robots.errors import JointscopeError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Gives a path in the same folder to write to, and moves it to `path` when the block ends well.

    Args:
        path: file to write; an existing one is replaced.

    Yields:
        Where to write; same folder (relative references stay right) and same suffix.

    Raises:
        JointscopeError: the file cannot be written: no such folder, no permission, disk full.
    """
    target = _final_target(Path(path))
    unfinished = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
    try:
        yield unfinished
        os.replace(unfinished, target)
    except OSError as err:
        raise JointscopeError(_cannot_write(target, err)) from err
    except JointscopeError as err:
        if str(unfinished) not in str(err):
            raise
        # the user knows nothing of the hidden name
        raise type(err)(str(err).replace(str(unfinished), str(target))) from err
    finally:
        _remove(unfinished)


def write_json(path: str | Path, content: Any) -> None:
    """Writes JSON that every reader accepts (NaN and infinity become null), whole or not at all.

    Args:
        path: file to write.
        content: dictionaries, lists, texts and numbers.

    Raises:
        JointscopeError: the file cannot be written.
    """
    with whole_file(path) as unfinished:
        unfinished.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def check_outputs(outputs: Iterable[Path | None], inputs: Iterable[str | Path] = ()) -> None:
    """Finds out before the work whether its results can be written after it.

    Args:
        outputs: files to be written; None for one that nobody asked for.
        inputs: files that must not be overwritten.

    Raises:
        JointscopeError: a folder is missing or not writable, a file is a folder, or two files are the same.
    """
    taken = {Path(file).resolve(): "is also an input" for file in inputs}
    for path in outputs:
        if path is None:
            continue
        place = path.resolve()
        if place in taken:
            raise JointscopeError(f"cannot write {path}: it {taken[place]}; give it another name")
        taken[place] = "is named for two outputs"
        _final_target(path)
        if path.is_dir():
            raise JointscopeError(f"cannot write {path}: it is a folder; expected the name of a file")
        if not path.parent.is_dir():
            raise JointscopeError(f"cannot write {path}: the folder {path.parent} does not exist; create it first")
        try:
            with tempfile.TemporaryFile(dir=path.parent):
                pass
        except OSError as err:
            raise JointscopeError(_cannot_write(path, err)) from err


def _final_target(path: Path) -> Path:
    """The file behind a link; devices and pipes are refused, because moving a file there would replace them."""
    target = path.resolve() if path.is_symlink() else path
    if target.exists() and not target.is_file() and not target.is_dir():
        raise JointscopeError(f"cannot write {path}: it is a device or a pipe; expected the name of a file")
    return target


def _plain(content: Any) -> Any:
    if isinstance(content, Mapping):
        return {str(key): _plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_plain(value) for value in content]
    if isinstance(content, Real) and not isinstance(content, Integral):
        return float(content) if math.isfinite(content) else None
    return content


def _cannot_write(path: Path, err: OSError) -> str:
    return f"cannot write {path}: {err.strerror or err}"


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        pass  # its folder is gone or is a file: then there is nothing to remove, and the first error counts
