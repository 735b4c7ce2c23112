# SPDX-License-Identifier: BSD-3-Clause
"""What motion and rests of one lever say together; the motion is MuJoCo's, equilibria are worked out by hand."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from lever_bench import C0, hanging, lever
from resting_axes import stiff_axes

from jointscope import simulate
from jointscope.graphs.across_kinds.diagnose_kinds import diagnose_kinds
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.terminal.searches.kinds_text import kinds_headline, kinds_sentences
from jointscope.tools.verb_parts.searches import kinds_search

OFFSET = 0.15  # [N m]


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    """The rigid lever."""
    return lever(tmp_path_factory.mktemp("rod"), rigid=True)


def moved(rod, effects=()):
    true = rod.with_values({"swing.coulomb_torque": C0})
    return simulate(true, seconds=8.0, seed=3, effects=list(effects), friction="smooth").recording


def by_label(found):
    return {c.label: c for c in found.candidates}


def test_loads_that_are_wrong_are_shown_by_rests_and_motion_bars_what_rests_take_for_them(rod):
    rests = hanging(40, 3, rigid=True)
    given = KindsRecordings((moved(rod),), rests=(replace(rests, forces=0.9 * rests.forces),))
    found = diagnose_kinds(rod, given, missing_torque=False)
    assert kinds_headline(found) == "Missing: load_scale@robot, shown by rests."
    effects = by_label(found)
    value, sigma, _ = effects["load_scale@robot"].by_kind["rests"].sizes["share"]
    assert abs(value - (1.0 / 0.9 - 1.0)) < 3.0 * sigma and not found.adequate
    # rests would take a wrong torque constant, too; motion knows it to 3e-5
    assert effects["torque_constant_error@swing"].verdict == "absent"
    assert effects["torque_constant_error@swing"].against == ("motion",)


@pytest.mark.slow
def test_nothing_is_missing_in_a_true_model(rod):
    given = KindsRecordings((moved(rod),), rests=(hanging(40, 3, rigid=True),))
    found = diagnose_kinds(rod, given, missing_torque=False)
    assert found.adequate and kinds_headline(found) == "Nothing of the catalogue is missing in motion and rests."
    assert not [c.label for c in found.candidates if c.verdict == "missing"]


@pytest.mark.slow
def test_what_rests_alone_would_name_wrongly_is_explained_by_what_motion_shows(rod):
    rests = hanging(40, 3, rigid=True)  # an offset that helps the motor takes as much from its command
    bent = replace(rests, u=rests.u - OFFSET)
    given = KindsRecordings((moved(rod, [f"torque_offset@swing:torque={OFFSET}"]),), rests=(bent,))
    found = diagnose_kinds(rod, given, missing_torque=False)
    assert kinds_headline(found) == "Missing: torque_offset@swing or asymmetric_friction@swing, shown by motion."
    assert next(c.label for c in found.rests.candidates if c.verdict == "missing") == "encoder_offset@swing"
    assert by_label(found)["encoder_offset@swing"].verdict == "possible"
    assert any("encoder_offset@swing looks like" in line and "in rests" in line for line in kinds_sentences(found))
    value, sigma, _ = by_label(found)["torque_offset@swing"].by_kind["motion"].sizes["torque"]
    assert abs(value - OFFSET) < 3.0 * sigma


@pytest.mark.slow
def test_an_offset_that_only_the_motion_has_is_a_contradiction(rod):
    rests = hanging(40, 3, rigid=True)
    other = replace(rests, u=rests.u + OFFSET)
    given = KindsRecordings((moved(rod, [f"torque_offset@swing:torque={OFFSET}"]),), rests=(other,))
    found = diagnose_kinds(rod, given, missing_torque=False)
    friction = by_label(found)["asymmetric_friction@swing"]
    assert friction.shown_by == ("motion", "rests") == friction.against
    assert kinds_headline(found).startswith("The model lacks something, but no effect")
    assert any("contradicts that" in line for line in kinds_sentences(found))


@pytest.mark.slow
def test_the_command_says_which_kind_shows_it(rod, tmp_path, capsys, monkeypatch):
    bag = tmp_path / "moves.mcap"
    write_bag(bag, moved(rod, ["motor_viscous@swing:coefficient=0.1"]), rod)
    rests = hanging(40, 3, rigid=True)
    monkeypatch.setattr(kinds_search, "read_all_rests", lambda paths, *_: [rests for _ in paths])
    given = [str(rod.path), str(bag), "--rests", "weights.mcap"]
    out = {"--json": tmp_path / "found.json", "--report": tmp_path / "found.html"}
    assert main(["diagnose", *given, *(str(text) for pair in out.items() for text in pair)]) == 0
    said = capsys.readouterr().out
    answer, viscous = said.splitlines()[0], {"motor_viscous@swing", "link_viscous@swing"}
    assert set(answer.removeprefix("Missing: ").removesuffix(", shown by motion.").split(" or ")) == viscous
    assert "Motion alone:" in said and "Rests alone:" in said
    content = json.loads(out["--json"].read_text(encoding="utf-8"))
    first = content["candidates"][0]
    assert f"{first['effect']}@{first['owner']}" in viscous and first["shown_by"] == ["motion"]
    assert set(first["untestable_by"]) == {"rests"}
    assert set(content["by_graph"]) == {"motion", "rests"} and not content["adequate"]
    assert "What all kinds say" in out["--report"].read_text(encoding="utf-8")


@pytest.mark.slow
def test_motion_and_poses_of_an_arm_show_what_the_other_cannot(tmp_path):
    pytest.importorskip("mujoco", reason="arms are moved by MuJoCo, which the extra `sim` brings")
    robot = stiff_axes(tmp_path)
    drift = PoseConditions(effects=["tracker_drift@robot:x=3e-4,z=0"], perfect=True)
    poses, truth = simulate_poses(robot, 40, 3, drift)
    dry = {name: truth["parameters"][name] for name in robot.parameters if name.endswith("coulomb_torque")}
    constant = ["torque_constant_error@joint2:share=0.05"]
    motion = simulate(
        robot, seconds=6.0, seed=3, encoder_rate=250.0, effects=constant, parameters=dry, friction="smooth"
    ).recording
    found = diagnose_kinds(robot, KindsRecordings((motion,), (poses,)), missing_torque=False)
    said = "Missing: torque_constant_error@joint2, shown by motion; tracker_drift@robot, shown by poses."
    assert kinds_headline(found) == said
    effects = by_label(found)
    for label, kind, name, true in (
        ("torque_constant_error@joint2", "motion", "share", 0.05),
        ("tracker_drift@robot", "poses", "x", 3e-4),
    ):
        value, sigma, _ = effects[label].by_kind[kind].sizes[name]
        assert abs(value - true) < 3.0 * sigma
    assert effects["torque_constant_error@joint2"].by_kind["poses"].verdict == "untestable"
