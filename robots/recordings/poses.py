# SPDX-License-Identifier: BSD-3-Clause
"""Poses of an arm at rest: angles of its joints, and where a target was, or which contact held it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.recording import Notice

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sighting:
    """What a tracker measured of a further target in m poses, in its axes; not a number where it did not see it.

    Attributes:
        name: of the target.
        place: shape (m, 3) [m].
        turn: orientation, R_tracker_target, shape (m, 3, 3); None where none was measured.
    """

    name: str
    place: Array
    turn: Array | None = None

    def only(self, kept: NDArray[np.bool_]) -> Sighting:
        """In some of the poses."""
        return replace(self, place=self.place[kept], turn=None if self.turn is None else self.turn[kept])


@dataclass(frozen=True)
class Poses:
    """Poses of one session.

    Attributes:
        path: where they come from.
        sha256: of that file.
        names: of the poses, as the user counts them.
        q: angles of the robot's joints, shape (m, n) [rad].
        target: measured positions in the axes of the tracker, shape (m, 3) [m], not a number where it was not seen;
            None where contacts hold the target.
        contacts: name of the contact of each pose; empty where positions were measured.
        places: name of the place of each contact, by contact; contacts of one place have a known distance.
        torque: measured torques of the motors, shape (m, n) [N m]; None where there are none.
        notices: what was left out or looked odd.
        share: of the session that had passed at each pose, shape (m,); None for poses at even distances.
        turn: measured orientations of the target, R_tracker_target, shape (m, 3, 3), not a number where there was none;
            None where none were measured.
        others: further targets on the tool.
        held: name of the target that is held in each contact; empty where that is the first one.
    """

    path: str
    sha256: str
    names: tuple[str, ...]
    q: Array
    target: Array | None
    contacts: tuple[str, ...] = ()
    places: tuple[tuple[str, str], ...] = ()
    torque: Array | None = None
    notices: tuple[Notice, ...] = ()
    share: Array | None = None
    turn: Array | None = None
    others: tuple[Sighting, ...] = ()
    held: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.q)

    def only(self, kept: NDArray[np.bool_]) -> Poses:
        """Some of the poses."""
        some = [i for i, keep in enumerate(kept) if keep]
        contacts = tuple(self.contacts[i] for i in some) if self.contacts else ()
        return replace(
            self,
            names=tuple(self.names[i] for i in some),
            q=self.q[kept],
            target=None if self.target is None else self.target[kept],
            contacts=contacts,
            places=tuple(pair for pair in self.places if pair[0] in contacts),
            torque=None if self.torque is None else self.torque[kept],
            share=self.shares[kept],
            turn=None if self.turn is None else self.turn[kept],
            others=tuple(other.only(kept) for other in self.others),
            held=tuple(self.held[i] for i in some) if self.held else (),
        )

    def without(self, hidden: Mapping[str, NDArray[np.bool_]], first: str) -> Poses:
        """The same poses with some targets not seen in some of them.

        Args:
            hidden: by name of the target, in which poses, shape (m,).
            first: name of the first target.
        """
        seen = [Sighting(first, self.target, self.turn)] if self.target is not None else []
        kept = {}
        for s in (*seen, *self.others):
            out = hidden.get(s.name, np.zeros(len(self), bool))[:, None]
            turn = None if s.turn is None else np.where(out[:, :, None], np.nan, s.turn)
            kept[s.name] = Sighting(s.name, np.where(out, np.nan, s.place), turn)
        main = kept.pop(first, Sighting(first, np.zeros((0, 3))))
        target = None if self.target is None else main.place
        return replace(self, target=target, turn=main.turn, others=tuple(kept.values()))

    @property
    def of_first(self) -> Poses:
        """The poses in which the first target was seen, and its place only."""
        if self.target is None or not (self.others or self.turn is not None):
            return self
        return replace(self.only(np.all(np.isfinite(self.target), axis=1)), turn=None, others=())

    @property
    def shares(self) -> Array:
        """Share of the session that had passed at each pose, shape (m,), from 0 to 1."""
        return np.linspace(0.0, 1.0, len(self)) if self.share is None else self.share

    @property
    def groups(self) -> tuple[str, ...]:
        """What belongs together when some are held out: the place of each pose, or the pose itself."""
        places = dict(self.places)
        return tuple(places.get(c, c) for c in self.contacts) if self.contacts else self.names
