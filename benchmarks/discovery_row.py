# SPDX-License-Identifier: BSD-3-Clause
"""What one discovery found beside what was hidden: one row of the table, one line of the results file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

MATTERS = 1.1  # times the held-out error of the true structure; an effect below changes little
MISTAKE_WORDS = {"swapped_axes": "axes", "wrong_gear": "gear ratio"}
ALSO_NAMED = {"wrong_gear": "encoder_scale"}  # effects that say the same
FRICTION = (
    "motor_viscous",
    "motor_stribeck",
    "load_dependent_friction",
    "asymmetric_friction",
    "link_viscous",
    "link_coulomb",
    "coriolis",
)
AS_GOOD = 1.1  # times the held-out error of the true structure


@dataclass(frozen=True)
class Row:
    """One case of the table.

    Attributes:
        name, kind, truth: of the case.
        ranks: place of each true effect in the first diagnosis, 1 is the best; 0 where it is not among the candidates.
        first: ID@OWNER of the best candidate of the first diagnosis; "" without one.
        look_alike: whether the best candidate and a true effect call each other look-alikes.
        accepted: ID@OWNER of everything in the last model, physical or not.
        numerics: those of `accepted` that are defects of the computation.
        base_error, final_error, true_error: on the held-out recording: of the base model, the last model, and a model
            of the true structure that was calibrated with the same recording; None where there is none [sensor sigma].
        floor: of the held-out recording with the last model [sensor sigma].
        z: by full name of a true effect's parameter that is in the last model: (estimate - truth) / sigma.
        adequate: whether the last model is called adequate.
        seconds: of the whole discovery.
        stages: seconds of the first diagnosis by stage.
        suspicions: what the first diagnosis says to look at before any effect.
        leaders: best candidates of the first diagnosis, one line each.
        stop: why the discovery stopped.
        error: one line where the discovery ended with an error, else "".
    """

    name: str
    kind: str
    truth: tuple[str, ...]
    ranks: tuple[int, ...] = ()
    first: str = ""
    look_alike: bool = False
    accepted: tuple[str, ...] = ()
    numerics: tuple[str, ...] = ()
    base_error: float | None = None
    final_error: float | None = None
    true_error: float | None = None
    floor: float | None = None
    z: dict[str, float] = field(default_factory=dict)
    adequate: bool | None = None
    seconds: float = 0.0
    stages: dict[str, float] = field(default_factory=dict)
    suspicions: tuple[str, ...] = ()
    leaders: tuple[str, ...] = ()
    stop: str = ""
    error: str = ""

    @property
    def matters(self) -> bool:
        """Whether the hidden effects change the held-out error by more than a tenth."""
        return bool(self.base_error and self.true_error and self.base_error > MATTERS * self.true_error)

    @property
    def found_first(self) -> bool:
        """Whether the best candidate is true, or cannot be told apart from a true one."""
        return self.first in self.truth or self.look_alike

    @property
    def physics(self) -> tuple[str, ...]:
        """Physical effects in the last model."""
        return tuple(label for label in self.accepted if label not in self.numerics)

    @property
    def explained(self) -> float | None:
        """Share of the squared error above the floor that the last model has taken away; None where not known."""
        if not (self.base_error and self.final_error and self.floor and self.base_error > self.floor):
            return None
        return (self.base_error**2 - self.final_error**2) / (self.base_error**2 - self.floor**2)

    @property
    def named(self) -> bool:
        """Whether a mistake is told by what it is: the words for it, and the name of what it sits in."""
        said = " ".join((self.error, *self.suspicions))
        for label in self.truth:
            mistake, owner = label.split("@")
            if mistake in MISTAKE_WORDS:
                if f"{ALSO_NAMED.get(mistake)}@{owner}" in self.accepted:
                    continue
                if MISTAKE_WORDS[mistake] not in said or (owner != "robot" and owner not in said):
                    return False
            elif label not in self.accepted and not self.look_alike:
                return False
        return bool(self.truth) or not self.physics

    @property
    def blamed(self) -> tuple[str, ...]:
        """Friction and Coriolis among what was accepted though it is not there."""
        return tuple(a for a in self.physics if a.split("@")[0] in FRICTION and a not in self.truth)

    @property
    def as_good(self) -> bool | None:
        """Whether the last model predicts as well as one of the true structure; None where that is not known."""
        if not self.final_error or not self.true_error:
            return None
        return self.final_error <= AS_GOOD * self.true_error

    def to_json(self) -> dict[str, Any]:
        """For one line of JSON."""
        return asdict(self)

    @staticmethod
    def of_json(found: dict[str, Any]) -> Row:
        """Back from a line of JSON."""
        lists = {key: tuple(found[key]) for key in ("truth", "ranks", "accepted", "numerics", "suspicions", "leaders")}
        return Row(**{**found, **lists})
