# SPDX-License-Identifier: BSD-3-Clause
"""What a search found in a robot with free links: the steps, with training and held-out errors of every equation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jointscope.graphs.transmission.regression import total
from jointscope.graphs.transmission.transmission_model import TransmissionModel, physical, with_found_effects
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class TransmissionStep:
    """One model on the way.

    Attributes:
        added: ID@OWNER; None for the model that the search began with.
        model: the fit.
        train: error of each equation on the training recordings [sigma].
        heldout: the same on the held-out recording; empty without one.
        look_alikes: effects that would explain the same in these recordings.
        paragraph: what the step means.
    """

    added: str | None
    model: TransmissionModel
    train: Mapping[str, float]
    heldout: Mapping[str, float]
    look_alikes: tuple[str, ...]
    paragraph: str


@dataclass(frozen=True)
class TransmissionDiscovery:
    """All steps.

    Attributes:
        steps: the first model first.
        recordings: for training.
        holdout: the held-out recording, if there was one.
        stop_reason: why it ended.
        refused: why each other effect was not added, by label.
        sigmas: standard deviations of the columns of the last model, by name.
    """

    steps: tuple[TransmissionStep, ...]
    recordings: tuple[Recording, ...]
    holdout: Recording | None
    stop_reason: str
    refused: Mapping[str, str]
    sigmas: Mapping[str, float]

    @property
    def model(self) -> TransmissionModel:
        """The last model."""
        return self.steps[-1].model

    @property
    def robot(self) -> Robot:
        """The last model as a robot."""
        return with_found_effects(self.model, self.sigmas)

    def units(self) -> dict[str, tuple[float, str]]:
        """Sigma and unit of each equation."""
        return {e.name: (e.sigma, e.unit) for e in self.model.equations(self.recordings[:1])}

    def to_json(self) -> dict[str, Any]:
        """For machines; errors in the equations' SI units."""
        units = self.units()
        return {
            "steps": [
                {
                    "added": step.added,
                    "removed": None,
                    "train_error": total(dict(step.train)),
                    "heldout_error": total(dict(step.heldout)) if step.heldout else None,
                    "floor": 1.0,
                    "look_alikes": list(step.look_alikes),
                    "paragraph": step.paragraph,
                    "equations": {
                        name: {"unit": unit, "train": step.train[name] * sigma}
                        | ({"heldout": step.heldout[name] * sigma} if step.heldout else {})
                        for name, (sigma, unit) in units.items()
                    },
                }
                for step in self.steps
            ],
            "stop_reason": self.stop_reason,
            "adequate": None,  # without equations of motion nothing says what is left of them
            "parameters": {
                name: {
                    "value": physical(self.model, name),
                    "sigma": self.robot.parameters[name].sigma,
                    "unit": self.robot.parameters[name].unit,
                }
                for candidate in self.model.chosen
                for name in candidate.sizes
            },
            "refused": dict(self.refused),
        }
