# SPDX-License-Identifier: BSD-3-Clause
"""Modules of other projects that may be missing, or be another thing under the same name.

The name of a module is not that of the package that brings it: `pinocchio` comes with `pin`, and the package
`pinocchio` is something else; `gtsam-nb` puts a smaller `gtsam` over the one that is there; the package `rerun` is no
viewer. Each is asked once, where it is first needed, for what this project uses of it.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from jointscope.robots.errors import JointscopeError


@dataclass(frozen=True)
class OutsideModule:
    """A module that this project imports.

    Attributes:
        package: what to install.
        uses: names in it without which nothing works.
    """

    package: str
    uses: tuple[str, ...]


MODULES = {
    "gtsam": OutsideModule("gtsam", ("NonlinearFactorGraph", "JacobianFactor", "CustomFactor", "Values")),
    "mujoco": OutsideModule("mujoco", ("MjModel", "MjData", "MjSpec", "mj_step")),
    "pinocchio": OutsideModule("pin", ("buildModelFromUrdf", "computeABADerivatives", "ModelPool")),
    "rerun": OutsideModule("rerun-sdk", ("RecordingStream", "TimeColumn", "blueprint")),
}
ALWAYS = ("gtsam", "pinocchio")  # without these no verb runs
FIXED_LAG = ("IncrementalFixedLagSmoother", "ISAM2Params", "ISAM2GaussNewtonParams", "LinearContainerFactor")


def need_module(name: str, also: Sequence[str] = ()) -> ModuleType:
    """The module, once it is sure that it is the one that is meant.

    Args:
        name: one of MODULES.
        also: further names in it that are used here.

    Raises:
        KeyboardInterrupt: the user stopped the import.
        JointscopeError: it is missing, cannot be imported, or lacks names; says what is installed and what to do.
    """
    try:
        module = importlib.import_module(name)
    except Exception as err:  # a module of another project may raise anything while it is imported
        if _interrupted(err):
            raise KeyboardInterrupt from err
        raise JointscopeError(_not_there(name, err)) from err
    lacking = [used for used in (*MODULES[name].uses, *also) if not hasattr(module, used)]
    if lacking:
        raise JointscopeError(_another(name, module, lacking))
    return module


def _interrupted(err: BaseException | None) -> bool:
    """Whether the user stopped the import; extension modules turn that into errors of their own."""
    while err is not None:
        if isinstance(err, KeyboardInterrupt) or "KeyboardInterrupt" in str(err):
            return True
        err = err.__cause__ or err.__context__
    return False


def trouble_with_modules() -> str:
    """What is wrong with the modules that every verb needs, one sentence; empty if nothing is."""
    for name in ALWAYS:
        try:
            need_module(name)
        except JointscopeError as err:
            return str(err)
    return ""


def _not_there(name: str, err: Exception) -> str:
    package = MODULES[name].package
    if isinstance(err, ModuleNotFoundError) and err.name == name:
        return f"the Python module {name} is not installed; install it: pip install {package}"
    text = " ".join(str(err).split())
    return f"the Python module {name} cannot be imported ({type(err).__name__}: {text}); {_installed(name)}{_way(name)}"


def _another(name: str, module: ModuleType, lacking: Sequence[str]) -> str:
    place = getattr(module, "__file__", None) or "no file"
    version = getattr(module, "__version__", None)
    said = f", version {version}" if version else ""
    return (
        f"the Python module {name} ({place}{said}) has no {', '.join(lacking)}, "
        f"so it is not the {MODULES[name].package} that is needed; {_installed(name)}{_way(name)}"
    )


def _installed(name: str) -> str:
    found = _packages_with(name)
    if not found:
        return "no installed package says that it is its own; "
    return f"installed: {', '.join(f'{package} {version}' for package, version in found)}; "


def _way(name: str) -> str:
    """The commands that put the right module there."""
    package = MODULES[name].package
    others = [other for other, _ in _packages_with(name) if other != package]
    away = f"pip uninstall -y {' '.join(others)} && " if others else ""
    return f"do: {away}pip install --force-reinstall {package}"


@cache
def _packages_with(name: str) -> tuple[tuple[str, str], ...]:
    """Installed packages that may have brought a module, with their versions: by their files, and by their names."""
    from importlib import metadata

    names = list(metadata.packages_distributions().get(name, ()))
    names += [name, MODULES[name].package]
    found = {}
    for package in names:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return tuple(sorted(found.items()))
