# SPDX-License-Identifier: BSD-3-Clause
"""One robot's line in the table of arms: what came of the three commands, held against the truth."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from arm_verbs import Session

PERCENT, SIGMAS = 1.0, 3.5  # a value is right within one of them
RIGHT, WRONG, BROKEN = "right", "wrong and called good", "broken"
ADVISED, MISLED, STUCK = "refused, advice works", "refused, advice fails", "refused without advice"
OUTCOMES = (RIGHT, ADVISED, MISLED, STUCK, WRONG, BROKEN)
VERDICT = re.compile(r"^(Yes|Usable|No)\b", re.MULTILINE)
# what findings say of pushes and mistakes; the recordings of the benchmark have none
ACCUSING = re.compile(r"push|presses|collision|leave-out|swapped|mirrored|left.handed|exchanged|glitch", re.IGNORECASE)
SUPPLY = re.compile(r"motor\.supply_voltage:\s*([-+.\deE]+)")
PLACES = {
    "inertia": ("inertia",),
    "coulomb": ("coulomb_torque", "coulomb_force", "coulomb"),
    "viscous": ("motor_viscous.coefficient", "link_viscous.coefficient", "viscous", "k_mi"),
    "k": ("torque_constant", "k_pwm"),
}


@dataclass(frozen=True)
class Value:
    """One value of the result beside the truth; `value` is None where the result has none."""

    name: str
    truth: float
    value: float | None
    sigma: float | None

    @property
    def percent(self) -> float:
        """Error in percent of the truth."""
        return float("inf") if self.value is None else 100.0 * abs(self.value / self.truth - 1.0)

    @property
    def z(self) -> float:
        """Error in standard deviations."""
        if self.value is None or not self.sigma:
            return float("inf")
        return abs(self.value - self.truth) / self.sigma

    @property
    def right(self) -> bool:
        """Whether it is near the truth by one of the two measures."""
        return self.percent <= PERCENT or self.z <= SIGMAS


@dataclass
class ArmRow:
    """What came of one robot.

    Attributes:
        name, variant: of the case.
        outcome: one of OUTCOMES.
        verdict: the calibration's own: Yes, Usable, No, or "" without one.
        ended_at: the verb that was the last.
        message: why it ended there, or the value that is farthest off.
        advice: commands that refusals named and that were typed.
        largest: largest error of a value that is not right [%], or of all [%].
        cpu: [s] of init, info and calibrate together, and of init alone.
        megabytes: the most that a verb held.
        accused: pushes and mistakes that the calibration names; there are none.
        promised: whether both `init` and `info` said that the recording can be used.
    """

    name: str
    variant: str
    outcome: str
    verdict: str = ""
    ended_at: str = ""
    message: str = ""
    advice: list[str] = field(default_factory=list)
    largest: float | None = None
    cpu: float = 0.0
    init_cpu: float = 0.0
    megabytes: float = 0.0
    promised: bool = False
    accused: list[str] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """For the file of results."""
        return asdict(self)


def judge(name: str, truth: Mapping[str, Any], session: Session, folder: Path) -> ArmRow:
    """The row of a robot."""
    last = session.last
    said = [typed for typed in session.typed if typed.line.split()[0] in ("init", "info") and typed.code == 0]
    row = ArmRow(
        name=name,
        variant=str(truth["variant"]),
        outcome=MISLED if session.advice else STUCK,
        ended_at=last.line.split()[0],
        advice=session.advice,
        cpu=sum(typed.cpu for typed in session.typed),
        init_cpu=session.typed[0].cpu,
        megabytes=max(typed.megabytes for typed in session.typed),
        promised=len(said) >= 2,
    )
    if last.code != 0 or last.crashed:
        row.outcome = BROKEN if last.crashed else row.outcome
        row.message = "no end in time" if last.code == 124 else last_line(last.err)
        return row
    verdict = VERDICT.search(last.out)
    row.verdict = verdict.group(1) if verdict else ""
    content = json.loads((folder / session.result).read_text(encoding="utf-8"))
    row.accused = [str(text) for text in content.get("findings", ()) if ACCUSING.search(str(text))]
    values = found_values(truth, folder, session)
    worst = max(values, key=lambda value: (not value.right, value.percent))
    row.largest = worst.percent
    right = all(value.right for value in values)
    if row.verdict in ("Yes", "Usable"):
        row.outcome = (ADVISED if session.advice else RIGHT) if right else WRONG
    row.message = _worst_in_words(worst)
    if row.verdict == "No":
        row.message = ("values are right; " if right else "") + f"{row.message}; {_reason(last.out)}"
    return row


def found_values(truth: Mapping[str, Any], folder: Path, session: Session) -> list[Value]:
    """All values that the truth has and the result should have."""
    result = json.loads((folder / session.result).read_text(encoding="utf-8"))["parameters"]
    text = (folder / session.robot_file).read_text(encoding="utf-8")
    supply = SUPPLY.search(text)
    volts = float(supply.group(1)) if supply else 1.0
    values = []
    for k, joint in enumerate(truth["joints"]):
        for quantity, places in PLACES.items():
            true = float(truth[quantity][k])
            if quantity == "k" and truth["unit"] == "Nm" and not _entries(result, joint, places):
                continue  # torques are commanded as they are
            values.append(_value(f"{joint}.{quantity}", true, _entries(result, joint, places), volts))
    return values


def _entries(result: Mapping[str, Any], joint: str, places: tuple[str, ...]) -> list[tuple[str, dict[str, Any]]]:
    """Entries of a joint that mean the same; those of all motors where the joint has none."""
    own = [(place, result[f"{joint}.{place}"]) for place in places if f"{joint}.{place}" in result]
    return own or [(place, result[f"motor.{place}"]) for place in places if f"motor.{place}" in result]


def _value(name: str, truth: float, entries: list[tuple[str, dict[str, Any]]], volts: float) -> Value:
    """Friction of several laws adds up; a constant per volt counts for the whole supply."""
    if not entries:
        return Value(name, truth, None, None)
    scales = [volts if place == "k_pwm" else 1.0 for place, _ in entries]
    value = sum(scale * float(entry["value"]) for scale, (_, entry) in zip(scales, entries, strict=True))
    squares = [(s * float(entry.get("sigma") or 0.0)) ** 2 for s, (_, entry) in zip(scales, entries, strict=True)]
    return Value(name, truth, value, sum(squares) ** 0.5)


def last_line(text: str) -> str:
    """The message of an error."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def _worst_in_words(worst: Value) -> str:
    if worst.value is None:
        return f"{worst.name} is not in the result"
    z = f"{worst.z:.1f} sigma" if worst.sigma else "no sigma"
    return f"{worst.name} {worst.value:.4g}, true {worst.truth:.4g} ({worst.percent:.2g} %, {z})"


def _reason(out: str) -> str:
    reasons = [line.strip(" !") for line in out.splitlines() if line.lstrip().startswith("!")]
    return reasons[0] if reasons else ""
