# SPDX-License-Identifier: BSD-3-Clause
"""The steps of `jointscope demo`: a robot with hidden effects, a model without them, and the way to one with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.terminal.progress import Progress, progress_bar, reading
from jointscope.tools.verb_parts.demo_truth import against_truth
from jointscope.tools.verb_parts.named_recordings import discovery_of
from jointscope.tools.verb_parts.result_files import ResultFiles, write_discovery
from jointscope.tools.writing.whole_file import whole_file, write_json

ROBOT = "doggy"
SOFT_BEARING = "bearing_flexibility@joint1"
FRICTION = "smooth"  # as the robot file has it; "dry" would be a second missing effect
TEST_SECONDS = 8.0  # [s]


class DemoStory:
    """The story, told while it happens.

    Args:
        hidden: where files are written.
        folder: where the user will find them.
        seconds: length of the training recording [s].
        seed: of the simulated robot.
        effects: ID@OWNER of what the robot has and the model does not know.
    """

    def __init__(self, hidden: Path, folder: Path, seconds: float, seed: int, effects: Sequence[str]):
        self.hidden, self.folder, self.seconds, self.seed, self.effects = hidden, folder, seconds, seed, effects
        self.robot = load_robot(ROBOT)

    def tell(self) -> dict[str, Any]:
        """Runs all steps and returns what they found, for JSON."""
        say(f"1. A recording. MuJoCo drives a Doggy with {', '.join(self.effects)}; the model does not know that.")
        truth = self._simulate("train", "calibration", self.seconds)
        say("\n2. Another motion of the same robot, held out: it is scored, but never influences the choice.")
        self._simulate("test", "moves", TEST_SECONDS)
        say("\n3. What does the model lack? Calibrate, diagnose, add, and again, until nothing helps.")
        discovery = self._discover()
        say("\n4. Against the truth of the simulation:")
        say(against_truth(discovery, truth, self.effects))
        return {"discovery": discovery.to_json(), "truth": truth}

    def _simulate(self, name: str, motion: str, seconds: float) -> dict[str, Any]:
        """Writes a bag and the truth beside it; returns the true parameters."""
        from jointscope.tools.bags.write_bag import write_bag
        from jointscope.tools.simulator import simulate

        options = " ".join(f"--effect {effect}" for effect in self.effects)
        options += f" --motion {motion} --seconds {seconds:g} --seed {self.seed} --friction {FRICTION}"
        self._command(f"simulate {ROBOT} -o {{0}}/{name}.mcap {options}")
        with progress_bar() as progress:
            simulation = simulate(
                self.robot,
                motion,
                seconds,
                self.seed,
                effects=self.effects,
                friction=FRICTION,
                progress=lambda share: progress("simulating", share),
            )
            write_bag(self.hidden / f"{name}.mcap", simulation.recording, self.robot)
        write_json(self.hidden / f"{name}.truth.json", simulation.truth)
        count = simulation.recording.sample_count
        say(f"{self.folder}/{name}.mcap: {count:,} messages; the true values are in {name}.truth.json")
        return dict(simulation.truth["parameters"])

    def _discover(self) -> Discovery:
        from jointscope.graphs.discovery.discover import discover
        from jointscope.tools.terminal.discovery_text import discovery_text
        from jointscope.tools.verb_parts.discovery_state import DiscoveryState, hashes_of

        self._command(
            f"discover {ROBOT} {{0}}/train.mcap --holdout {{0}}/test.mcap -o {{0}}/found.yaml "
            "--report {0}/discovery.html --rrd {0}/discovery.rrd"
        )
        with progress_bar() as progress:
            train, test = self._read("train", progress), self._read("test", progress)
            hashes = hashes_of(self.robot, [train], test, [])
            state = DiscoveryState(self.hidden / "found.yaml", hashes, [train], self.robot.path.name)

            def save(index: int, step: DiscoveryStep) -> str:
                return str(self.folder / Path(state.save(index, step)).name)

            result = discover(self.robot, [train], test, save=save, progress=progress)
            result = discovery_of(replace(result, robot_file=str(self.folder / "found.yaml")), [train], test)
            names = ResultFiles(*(self.hidden / f"discovery.{end}" for end in ("html", "rrd", "json")))
            write_discovery(result, replace(names, robot=self.hidden / "found.yaml"), self.robot.path.name)
            self._draw(result)
        say(discovery_text(result))
        return result

    def _draw(self, result: Discovery) -> None:
        """The story, the waterfall and the most telling residual map as picture files."""
        from jointscope.graphs.discovery.residual_maps import residual_maps
        from jointscope.tools.report.page.picture import picture
        from jointscope.tools.report.sections.diagnosis.torque_maps import map_picture
        from jointscope.tools.report.sections.diagnosis.waterfall import waterfall_picture
        from jointscope.tools.report.story_picture import story_picture

        pictures = {"story.svg": story_picture(result), "waterfall.svg": picture(waterfall_picture(result))}
        first: Diagnosis | None = result.steps[0].diagnosis
        maps = residual_maps(first.missing) if first is not None and first.missing is not None else []
        if first is not None and first.missing is not None and maps:
            pictures["missing_torque.svg"] = picture(map_picture(maps[0], first.missing))
        for name, svg in pictures.items():
            with whole_file(self.hidden / name) as file:
                file.write_text(svg, encoding="utf-8")

    def _read(self, name: str, progress: Progress) -> Recording:
        from jointscope.tools.bags.read_recording import read_recording

        bag = f"{name}.mcap"
        recording = read_recording(self.hidden / bag, self.robot, reading(Path(bag), progress))
        return replace(recording, path=str(self.folder / bag))

    def _command(self, text: str) -> None:
        """Prints what the user would type."""
        say(f"   $ jointscope {text.format(self.folder)}\n")


def say(text: str) -> None:
    """Prints at once, also into a pipe."""
    print(text, flush=True)
