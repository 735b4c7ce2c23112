# SPDX-License-Identifier: BSD-3-Clause
"""Modules of other projects that are missing, or another thing under the same name, are told apart and said."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from jointscope.graphs.fixed_lag.window.smoother_window import SmootherWindow
from jointscope.robots import outside_modules
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.outside_modules import FIXED_LAG, MODULES, need_module
from jointscope.tools.command_line import main
from jointscope.tools.verb_parts.result_files import ResultFiles

SHARED = Path(__file__).resolve().parents[2].parent / "shared"


def stand_in(monkeypatch, name, without=(), **attributes):
    """Another module under a name: the real one lacking some names, or an empty one."""
    module = ModuleType(name)
    if without:
        real = __import__(name)
        module.__dict__.update({key: value for key, value in vars(real).items() if key not in without})
    module.__file__ = f"/somewhere/{name}/__init__.py"
    module.__dict__.update(attributes)
    monkeypatch.setitem(sys.modules, name, module)
    return module


def installed(monkeypatch, **packages):
    """Pretends that a module was brought by these packages; names with _ for -."""
    found = tuple((name.replace("_", "-"), version) for name, version in packages.items())
    monkeypatch.setattr(outside_modules, "_packages_with", lambda name: found)


@pytest.mark.parametrize("name", list(MODULES))
def test_the_modules_that_are_meant_are_taken(name):
    pytest.importorskip(name)
    assert need_module(name, FIXED_LAG if name == "gtsam" else ()) is sys.modules[name]


def test_a_gtsam_without_fixed_lag_smoothers_is_said_with_package_version_file_and_command(monkeypatch):
    stand_in(monkeypatch, "gtsam", without=FIXED_LAG, __version__="4.3.1")
    installed(monkeypatch, gtsam="4.3.0", gtsam_nb="4.3.1")
    with pytest.raises(JointscopeError) as error:
        SmootherWindow(0.1, [1.0])
    assert str(error.value) == (
        "the Python module gtsam (/somewhere/gtsam/__init__.py, version 4.3.1) has no IncrementalFixedLagSmoother, "
        "ISAM2Params, ISAM2GaussNewtonParams, LinearContainerFactor, so it is not the gtsam that is needed; installed: "
        "gtsam 4.3.0, gtsam-nb 4.3.1; do: pip uninstall -y gtsam-nb && pip install --force-reinstall gtsam"
    )


def test_a_gtsam_that_nobody_claims_is_installed_anew(monkeypatch):
    stand_in(monkeypatch, "gtsam")
    installed(monkeypatch)
    with pytest.raises(JointscopeError, match=r"no installed package says .* do: pip install --force-reinstall gtsam$"):
        need_module("gtsam")


def test_another_pinocchio_is_no_fault_of_the_urdf(monkeypatch):
    stand_in(monkeypatch, "pinocchio")
    installed(monkeypatch, pinocchio="0.4.3")
    with pytest.raises(JointscopeError) as error:
        load_robot("doggy")
    assert str(error.value) == (
        "the Python module pinocchio (/somewhere/pinocchio/__init__.py) has no buildModelFromUrdf, "
        "computeABADerivatives, ModelPool, so it is not the pin that is needed; installed: pinocchio 0.4.3; do: "
        "pip uninstall -y pinocchio && pip install --force-reinstall pin"
    )


def test_a_missing_viewer_is_told_before_the_work(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(JointscopeError, match=r"module rerun is not installed; install it: pip install rerun-sdk"):
        ResultFiles(rrd=tmp_path / "f.rrd")
    stand_in(monkeypatch, "rerun")
    with pytest.raises(JointscopeError, match="has no RecordingStream"):
        ResultFiles(rrd=tmp_path / "f.rrd")
    assert ResultFiles(json=tmp_path / "f.json").all == (tmp_path / "f.json",)


def test_a_module_that_breaks_while_it_is_imported_is_named(monkeypatch, tmp_path):
    (tmp_path / "mujoco.py").write_text("import nose_of_another_age\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    installed(monkeypatch)
    with pytest.raises(
        JointscopeError, match=r"mujoco cannot be imported \(ModuleNotFoundError: No module named 'nose"
    ):
        need_module("mujoco")


@pytest.mark.parametrize("wrapped", ["raise KeyboardInterrupt", "raise ImportError('KeyboardInterrupt: ')"])
def test_an_import_that_the_user_stopped_is_an_interruption(monkeypatch, tmp_path, wrapped):
    (tmp_path / "mujoco.py").write_text(f"{wrapped}\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    with pytest.raises(KeyboardInterrupt):
        need_module("mujoco")


@pytest.mark.parametrize(
    ("name", "content"),
    [("gtsam", "def symbol(*_): return 0\n"), ("pinocchio", "raise ImportError('plugins of another program')\n")],
)
def test_a_verb_says_it_in_one_line(tmp_path, name, content):
    case = SHARED / "cases" / "measured_effort.yaml"
    if not case.is_file():
        pytest.skip("shared/cases is not beside the project: a replay needs a recording")
    (tmp_path / f"{name}.py").write_text(content)
    here = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    code = "import sys; from jointscope.tools.command_line import main; sys.exit(main(sys.argv[1:]))"
    verb = ["replay", str(case), str(case.with_suffix(".mcap"))]
    done = subprocess.run(
        [sys.executable, "-c", code, *verb],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": here},
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
    assert f"the Python module {name} " in done.stderr and f"force-reinstall {MODULES[name].package}" in done.stderr


def test_a_bug_stays_a_bug(monkeypatch, capsys):
    def broken(*_):
        raise AttributeError("x has no y")

    for user in ("notebook.calls", "acceptance.limits"):  # what first imports the broken one would keep it for good
        importlib.import_module(f"jointscope.tools.{user}")
    monkeypatch.setattr("jointscope.robots.files.robot_file.load_robot", broken)
    assert main(["calibrate", "doggy", "no.mcap", "-o", "o.yaml"]) == 1
    assert "this is a bug in jointscope: AttributeError: x has no y" in capsys.readouterr().err
