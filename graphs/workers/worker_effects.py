# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the user's own on the workers of a cluster, which do not see the user's files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from distributed import WorkerPlugin

from jointscope.robots.files.effect_catalogue import add_user_effects


class WorkerEffects(WorkerPlugin):
    """Adds effects to every worker, those that come later included.

    Args:
        texts: content of each file, by its path here.
    """

    def __init__(self, texts: Mapping[str, str]):
        self.name = "jointscope-effects"
        self._texts = dict(texts)

    def setup(self, worker: Any) -> None:
        """Writes the files into the worker's own folder, and reads them."""
        for i, (path, text) in enumerate(self._texts.items()):
            file = Path(worker.local_directory) / f"effects_{i}_{Path(path).name}"
            file.write_text(text, encoding="utf-8")
            add_user_effects(file)
