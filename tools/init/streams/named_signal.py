# SPDX-License-Identifier: BSD-3-Clause
"""A signal of a bag and what it calls the joints of the URDF: by name, by ending, by place only where it names none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.wrapped_counter import continued, wrapping_jump
from jointscope.tools.init.streams.joint_names import match_names
from jointscope.tools.init.streams.signals import Signal

TURNS = (2.0 * np.pi, 360.0, 1.0)  # periods of counters, in rad, degrees, turns
NEAR_A_GOAL = 0.7  # of a motion's spread, rms, within which it follows its goal
NEAR_A_TURN = 0.1  # relative; the joint moves on while its counter jumps


@dataclass(frozen=True)
class Wish:
    """What the user said.

    Attributes:
        joints: those to use; empty for all that move and are driven.
        names: what messages call some of them, where that is not to be guessed.
        locked: joints to hold at their mean although they move.
    """

    joints: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    locked: tuple[str, ...] = ()


@dataclass(frozen=True)
class Chosen:
    """A signal in its role.

    Attributes:
        signal: where it is.
        names: joint names in the messages, one per joint of the robot; places, counted from 0, where the messages
            name none, and empty where those are all places in order.
        reason: why this one.
        sure: whether nothing else could be meant.
        wraps: period after which its counter begins anew, in the unit of the bag; the signal is continued already.
        by_ending: joints whose names are not those of the URDF.
        by_order: whether the names have nothing in common with those of the URDF and are taken in its order.
    """

    signal: Signal
    names: tuple[str, ...]
    reason: str
    sure: bool
    wraps: float = 0.0
    by_ending: tuple[str, ...] = ()
    by_order: bool = False


@dataclass(frozen=True)
class NamedSignal:
    """A signal and what it calls the joints of the URDF; who else could be meant, if that is not clear."""

    signal: Signal
    names: Mapping[str, str]
    by_ending: tuple[str, ...] = ()
    unclear: str = ""
    turns: Mapping[str, float] = field(default_factory=dict)
    by_order: bool = False

    def chosen(self, joints: tuple[str, ...], reason: str, sure: bool) -> Chosen:
        """The signal in a role."""
        names = tuple(self.names[joint] for joint in joints)
        turn = max((self.turns.get(name, 0.0) for name in names), default=0.0)
        if not self.signal.names and names == tuple(map(str, range(self.signal.values.shape[1]))):
            names = ()
        by_ending = tuple(joint for joint in joints if joint in self.by_ending)
        return Chosen(self.signal, names, reason, sure, turn, by_ending, self.by_order)

    def varies(self, joint: str) -> bool:
        """Whether a joint has samples that differ."""
        if joint not in self.names:
            return False
        column = self.signal.columns((self.names[joint],))[:, 0]
        good = column[np.isfinite(column)]
        return bool(len(good) > len(column) / 2 and np.ptp(good) > 0)


def are_goals(command: NamedSignal, positions: NamedSignal, joints: Sequence[str]) -> bool:
    """Whether the numbers of a command that nobody names are goal positions: the joints are where they say."""
    shared = [joint for joint in joints if joint in command.names and joint in positions.names]
    lefts = []
    for joint in shared:
        wanted = command.signal.stream((command.names[joint],))
        is_at = positions.signal.stream((positions.names[joint],))
        if len(wanted.times) < 2 or len(is_at.times) < 2:
            continue
        seen = np.interp(wanted.times, is_at.times, is_at.values[:, 0])
        lefts.append(float(np.sqrt(np.mean((wanted.values[:, 0] - seen) ** 2)) / max(float(np.std(seen)), 1e-12)))
    return bool(lefts) and float(np.median(lefts)) < NEAR_A_GOAL


def named_signal(signal: Signal, urdf_joints: tuple[str, ...], wish: Wish) -> NamedSignal:
    """Which columns of a signal belong to which joints; by place only where the messages name none."""
    turns = _turns(signal) if signal.quantity == "position" else {}
    signal = _continued(signal, turns)
    said = {joint: name for joint, name in wish.names.items() if name in signal.names}
    if not signal.names:
        candidates = tuple(joint for joint in urdf_joints if not wish.joints or joint in wish.joints)
        fits = next((c for c in (candidates, urdf_joints) if len(c) == signal.values.shape[1]), ())
        return NamedSignal(signal, {joint: str(place) for place, joint in enumerate(fits)}, turns=turns)
    left = [joint for joint in urdf_joints if joint not in said]
    rest = [name for name in signal.names if name not in said.values()]
    # a name that several joints could have belongs to the one that the user named
    match = match_names(left, rest)
    if match.ambiguous and wish.joints:
        match = match_names([joint for joint in left if joint in wish.joints], rest)
    names = {**match.found, **said}
    strangers = not names and not match.ambiguous
    candidates = tuple(joint for joint in urdf_joints if not wish.joints or joint in wish.joints)
    if strangers and len(candidates) == len(signal.names):
        by_order = dict(zip(candidates, signal.names, strict=True))
        return NamedSignal(signal, by_order, candidates, "", turns, by_order=True)
    return NamedSignal(signal, names, match.alike, _unclear(signal, match.ambiguous), turns)


def _unclear(signal: Signal, ambiguous: Sequence[tuple[str, tuple[str, ...]]]) -> str:
    """A complaint about a moving joint that could be several; empty where there is none."""
    for name, others in ambiguous:
        known = name in signal.names
        columns = signal.columns((name,) if known else others)
        if not any(np.ptp(column[np.isfinite(column)]) for column in columns.T if np.isfinite(column).any()):
            continue
        joint, in_bag = (others[0], name) if known else (name, others[0])
        here, there = (signal.topic, "the URDF") if known else ("the URDF", signal.topic)
        return (
            f"{name} of {here} could be {' or '.join(others)} of {there}; say which, as in "
            f"--joints {joint}={in_bag}, with all joints that the robot shall have"
        )
    return ""


def _turns(signal: Signal) -> dict[str, float]:
    """Periods of counters that begin anew, by the name or place of their column."""
    labels = signal.names or tuple(map(str, range(signal.values.shape[1])))
    own = [_own(signal, k) for k in range(len(labels))]
    jumps = {
        label: wrapping_jump(signal.times[rows], signal.values[rows, k])
        for k, (label, rows) in enumerate(zip(labels, own, strict=True))
    }
    found = {
        label: next((turn for turn in TURNS if abs(jump / turn - 1.0) < NEAR_A_TURN), 0.0)
        for label, jump in jumps.items()
    }
    return {label: turn for label, turn in found.items() if turn}


def _continued(signal: Signal, turns: Mapping[str, float]) -> Signal:
    if not turns:
        return signal
    labels = signal.names or tuple(map(str, range(signal.values.shape[1])))
    values = signal.values.copy()
    for k, label in enumerate(labels):
        if label in turns:
            own = _own(signal, k)
            whole = continued(values[own][:, [k]], turns[label])[:, 0]
            values[:, k] = np.interp(signal.times, signal.times[own], whole)
    return replace(signal, values=values)


def _own(signal: Signal, column: int) -> NDArray[np.bool_]:
    """Rows that a column was told in, shape (n,): other nodes may speak in between."""
    return np.ones(len(signal.values), bool) if signal.filled is None else np.asarray(~signal.filled[:, column])


def by_place(signal: Signal, fits: tuple[str, ...], moving: tuple[str, ...]) -> NamedSignal:
    """A signal that names nobody: its columns belong to joints in their order.

    Args:
        signal: the numbers.
        fits: joints, as many as it has columns; empty where nothing tells who they are.
        moving: joints that then have its columns that vary, if they are as many: controllers hold others that stand.
    """
    places = list(range(len(fits))) or [
        k for k, column in enumerate(signal.values.T) if len(np.unique(column[np.isfinite(column)])) > 1
    ]
    joints = fits or moving
    if len(joints) != len(places):
        return NamedSignal(signal, {})
    return NamedSignal(signal, {joint: str(place) for joint, place in zip(joints, places, strict=True)})
