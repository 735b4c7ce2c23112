# SPDX-License-Identifier: BSD-3-Clause
"""What programs import from `jointscope` is there, and costs nothing until it is used."""

from __future__ import annotations

import subprocess
import sys

import jointscope


def test_every_public_name_is_what_its_module_holds():
    assert jointscope.errors.RobotError
    for name in set(jointscope.__all__) - {"errors"}:
        assert getattr(jointscope, name).__module__.startswith("jointscope.")
        assert getattr(jointscope, name).__name__ == name


def test_an_unknown_name_is_an_attribute_error():
    assert not hasattr(jointscope, "calibrator")
    assert set(jointscope.__all__) <= set(dir(jointscope))


def test_importing_jointscope_imports_no_library():
    code = "import sys, jointscope; print([m for m in ('numpy', 'gtsam', 'pinocchio', 'rosbags') if m in sys.modules])"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
