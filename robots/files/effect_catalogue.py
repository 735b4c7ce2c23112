# SPDX-License-Identifier: BSD-3-Clause
"""All physical effects that are known: those of `robots/effects/`, of installed packages, and of the user's files."""

from __future__ import annotations

import ast
import hashlib
import importlib
import pkgutil
import sys
import traceback
from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from jointscope.robots import effects as folder
from jointscope.robots import ready_effects
from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.groups import GROUPS, group_of
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_check import check_effect
from jointscope.robots.yaml_section import did_you_mean

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot

ENTRY_POINTS = "jointscope.effects"

_of_files: dict[Path, dict[str, Effect]] = {}


def catalogue() -> dict[str, Effect]:
    """All known effects by id, those of the motor side first and numerics last.

    Raises:
        EffectError: an installed package offers something that is no effect, or an id twice.
    """
    known = {**_own(), **_of_packages()}
    for found in _of_files.values():
        known |= found
    return {e.id: e for e in sorted(known.values(), key=lambda e: (GROUPS.index(group_of(e)), e.id))}


def add_user_effects(path: str | Path) -> tuple[Effect, ...]:
    """Adds the effects of a Python file: every effect that the file makes at its top level.

    Adding a file again replaces what it held.

    Args:
        path: the file.

    Returns:
        The effects that it holds.

    Raises:
        EffectError: the file cannot be read or run, holds no effect, or one that cannot be used.
    """
    file = Path(path).resolve()
    others = {**_own(), **_of_packages()}
    for other, content in _of_files.items():
        if other != file:
            others |= content
    found: dict[str, Effect] = {}
    for effect, place in effects_of_file(Path(path)):
        if any(effect is other for other in others.values()):
            continue  # imported from somewhere else, to be changed or combined
        check_effect(effect, place)
        if effect.id in others or effect.id in found:
            raise EffectError(f"{place}: the id {effect.id!r} is taken by another effect; give this one another id")
        found[effect.id] = effect
    if not found:
        raise EffectError(
            f"{path}: no effect in it; expected a constant at the top level such as EFFECT = JointTorque(...)"
        )
    _of_files[file] = found
    return tuple(found.values())


def find_effect(effect_id: str) -> Effect:
    """The effect of that id, or with that alias.

    Raises:
        EffectError: there is none; the message offers the nearest.
    """
    known, effect_id = catalogue(), without_alias(effect_id)
    if effect_id in _of_ready_robots():
        return _of_ready_robots()[effect_id]
    if effect_id not in known:
        hint = did_you_mean(effect_id, list(known))
        if "did you mean" not in hint:
            hint = "; `jointscope effects` lists all, --effects FILE.py adds your own"
        raise EffectError(f"no effect {effect_id!r}{hint}")
    return known[effect_id]


def without_alias(label: str) -> str:
    """An id, or ID@OWNER, with the effect's own id where another name of it was typed."""
    effect_id, at, owner = label.partition("@")
    return next((e.id for e in catalogue().values() if effect_id in e.aliases), effect_id) + at + owner


def parse_effect(text: str, robot: Robot) -> tuple[Effect, str]:
    """An effect and its owner from ID@OWNER.

    Args:
        text: for example "cogging@joint2".
        robot: whose joints and gyros can be owners.

    Returns:
        The effect and the owner.

    Raises:
        EffectError: text of another form, unknown id, or an owner on which the effect cannot act.
    """
    effect_id, at, owner = text.partition("@")
    if not at or not effect_id or not owner or "@" in owner:
        example = f"{effect_id or 'cogging'}@{robot.joints[0]}"
        raise EffectError(f"effect {text!r}: expected ID@OWNER, for example {example}")
    effect = find_effect(effect_id)
    reason = effect.may_act_on(robot, owner)
    if reason:
        hint = did_you_mean(owner, effect.owners_of(robot))
        raise EffectError(f"effect {text!r}: {effect.id} {reason}{hint if 'did you mean' in hint else ''}")
    return effect, owner


@cache
def _own() -> dict[str, Effect]:
    """The effects of this package; a broken file here is a bug."""
    return _of_folder(folder)


@cache
def _of_ready_robots() -> dict[str, Effect]:
    """Effects that a ready robot alone has."""
    return _of_folder(ready_effects)


def _of_folder(package: ModuleType) -> dict[str, Effect]:
    """The effects of all modules of a package."""
    modules = (importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__))
    families = (getattr(module, "EFFECTS", None) or (module.EFFECT,) for module in modules)
    return {effect.id: effect for family in families for effect in family}


@cache
def _of_packages() -> dict[str, Effect]:
    """The effects that installed packages offer."""
    return _loaded(entry_points(group=ENTRY_POINTS))


def _loaded(points: Iterable[EntryPoint]) -> dict[str, Effect]:
    """The effects behind entry points such as `drag = "my_package.drag:EFFECT"`."""
    found: dict[str, Effect] = {}
    for point in points:
        place = f"entry point {point.name!r} ({point.value})"
        try:
            effect = point.load()
        except Exception as err:
            raise EffectError(f"{place}: {type(err).__name__}: {err}; repair or uninstall that package") from err
        if not isinstance(effect, Effect):
            raise EffectError(f"{place}: expected an effect, got {type(effect).__name__}")
        check_effect(effect, place)
        if effect.id in _own() or effect.id in found:
            raise EffectError(f"{place}: the id {effect.id!r} is taken by another effect; uninstall one of the two")
        found[effect.id] = effect
    return found


def effects_of_file(path: Path) -> list[tuple[Effect, str]]:
    """Runs a Python file.

    Args:
        path: the file, as the user named it.

    Returns:
        Each effect at its top level with its place ("my_effects.py, line 12"), in the order of the file.

    Raises:
        EffectError: the file cannot be read, is not Python, or fails when it runs.
    """
    source, tree = _parsed(path)
    # named after what it says: a worker on another machine, which has the file elsewhere, knows it by the same name
    module = ModuleType(f"jointscope_user_effects_{hashlib.sha256(source.encode()).hexdigest()[:12]}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses look their module up by name
    try:
        exec(compile(source, str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as err:
        raise EffectError(_failure(path, err)) from err
    lines = _lines_of_names(tree)
    found: dict[int, tuple[Effect, str]] = {}
    for name, member in vars(module).items():
        if isinstance(member, Effect):
            found.setdefault(id(member), (member, f"{path}, line {lines.get(name, 1)}"))
    return list(found.values())


def _parsed(path: Path) -> tuple[str, ast.Module]:
    """The file's text and syntax tree."""
    try:
        source = path.read_text(encoding="utf-8")
    except OSError as err:
        raise EffectError(f"cannot read the effects file {path}: {err.strerror or err}") from err
    except UnicodeDecodeError as err:
        raise EffectError(f"{path} is not a Python file: it is not text; --effects takes a .py file") from err
    try:
        return source, ast.parse(source)
    except SyntaxError as err:
        raise EffectError(f"{path}, line {err.lineno or 1}: not Python: {err.msg}; correct the file") from err
    except ValueError as err:  # null bytes
        raise EffectError(f"{path} is not a Python file: {err}; --effects takes a .py file") from err


def _failure(path: Path, err: BaseException) -> str:
    """What went wrong, at the last line of the user's own file that was running."""
    lines = [frame.lineno for frame in traceback.extract_tb(err.__traceback__) if frame.filename == str(path)]
    text = " ".join(str(err).split())
    return f"{path}, line {lines[-1] if lines else 1}: {type(err).__name__}: {text}; correct the file"


def _lines_of_names(tree: ast.Module) -> dict[str, int]:
    """The line at which each name of the top level was made."""
    lines: dict[str, int] = {}
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in targets:
            if isinstance(target, ast.Name):
                lines[target.id] = node.lineno
    return lines
