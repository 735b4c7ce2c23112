# SPDX-License-Identifier: BSD-3-Clause
"""Twenty simulated BioRob arms, all alike in kind and different in every value: do the sigmas hold what they say?

An interrupted run goes on where it stopped, as long as the code is the same.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from kept_rows import code_of, keep, known_rows
from patience import say
from tables import Section, Table

import jointscope as js

ARMS, SECONDS = 20, 12.0
KEPT = Path(tempfile.gettempdir()) / "jointscope-biorob-arms.jsonl"
SPREAD = (0.7, 1.3)  # times the values below
SPRINGS = ((0.416, -0.134, 0.54), (0.992, -0.135, 0.53), (2.189,), (1.166,))  # at the pulleys, by powers of the angle
DAMPING, LINK_DAMPING = (0.0104, 0.0108, 0.0078, 0.0019), (0.02, 0.02, 0.008, 0.002)
INERTIA, MOTOR_DAMPING = (1.96e-3, 1.96e-3, 1.17e-3, 4.5e-4), (0.593, 0.593, 0.364, 0.094)
FRICTION = ((0.06, 0.12, 0.03), (0.08, 0.15, 0.05), (0.05, 0.1, 0.04), (0.03, 0.2, 0.1))


def coverage() -> Section:
    """Share of the true values within two sigmas, over all values of all arms."""
    code, arms = code_of(__file__), []
    known = known_rows(KEPT, code)
    for seed in range(ARMS):
        name = f"arm {seed}"
        say(f"arms: {name}")
        if name not in known:
            known[name] = {"name": name, **_calibrated(seed)}
            keep(KEPT, code, known[name])
        arms.append(known[name])
    z = [off for arm in arms for off in arm["off"].values()]
    within = 100 * np.mean(np.abs(z) < 2.0)
    summary = Table(
        "Sigmas",
        ("what", "wanted", "measured"),
        [
            (f"true values within two sigmas, of {len(z)} [%]", "90 to 98", f"{within:.1f}"),
            ("beyond three sigmas [%]", "", f"{100 * np.mean(np.abs(z) > 3.0):.1f}"),
            ("one calibration, median [CPU s]", "", f"{np.median([arm['cpu'] for arm in arms]):.0f}"),
        ],
    )
    each = Table("Arms", ("arm", "within two sigmas [%]", "worst [sigma]", "verdict"), [_told(arm) for arm in arms])
    text = (
        f"{SECONDS:g} s of motion each, by MuJoCo with dry friction; every value within 30 % of that of `shared/data`."
    )
    return Section(f"BioRob, {ARMS} arms", text, tables=[summary, each])


def _calibrated(seed: int) -> dict[str, Any]:
    """One arm: errors of its values in sigmas, CPU time, verdict."""
    values, effects = drawn_arm(seed)
    simulated = js.simulate("biorob", seconds=SECONDS, seed=seed, parameters=values, effects=effects)
    start = time.process_time()
    result = js.calibrate("biorob", simulated.recording)
    cpu = time.process_time() - start
    true = simulated.truth["parameters"]
    off = {p.name: (p.value - true[p.name]) / p.sigma for p in result.parameters if p.name in true and p.sigma}
    return {"off": off, "cpu": cpu, "verdict": result.judgement.headline}


def _told(arm: dict[str, Any]) -> tuple[str, str, str, str]:
    """A line of the table."""
    off = arm["off"]
    worst = max(off, key=lambda name: abs(off[name]))
    within = np.mean(np.abs(list(off.values())) < 2.0)
    return arm["name"].split()[1], f"{100 * within:.0f}", f"{worst} {off[worst]:+.1f}", arm["verdict"]


def drawn_arm(seed: int) -> tuple[dict[str, float], list[str]]:
    """True values of an arm, and its effects."""
    rng = np.random.default_rng(seed)
    values, effects = {}, []
    for i, spring in enumerate(SPRINGS):
        joint = f"joint{i + 1}"
        own = dict(stiffness=spring[0], damping=DAMPING[i], inertia=INERTIA[i], k_mi=MOTOR_DAMPING[i])
        own["coulomb_torque"] = FRICTION[i][0]
        values |= {f"{joint}.{name}": value * rng.uniform(*SPREAD) for name, value in own.items()}
        laws = {
            "weight_dependent_friction": dict(coefficient=FRICTION[i][1], quadratic=FRICTION[i][2]),
            "link_viscous": dict(coefficient=LINK_DAMPING[i]),
        }
        if len(spring) > 1:
            laws["spring_curve"] = dict(quadratic=spring[1], cubic=spring[2])
        for law, sizes in laws.items():
            drawn = ",".join(f"{name}={value * rng.uniform(*SPREAD):.6g}" for name, value in sizes.items())
            effects.append(f"{law}@{joint}:{drawn}")
    return values, effects
