# SPDX-License-Identifier: BSD-3-Clause
"""Every option of a verb is an argument of its function, or stands here with the reason why it is not."""

from __future__ import annotations

import argparse
import inspect

import pytest

import jointscope as js
from jointscope.robots.errors import RecordingError
from jointscope.tools.command_line import _parser, verbs
from jointscope.tools.notebook.given import without_stretches

OTHER_NAME = {
    "bags": "recordings",
    "bag": "recording",
    "labels": "effects",
    "effect": "effects",
    "output": "bag",  # of simulate
    "incremental": "solver",
    "workers": "side_by_side",
    "scheduler": "side_by_side",
    "restart": "resume",
}
RESULT = "the result writes it: `result.save(...)`, `.to_json()`, `.plot()`"
CATALOGUE = "`robots.files.effect_catalogue.add_user_effects(path)` adds it once for all functions"
OTHER_KIND = "kinds without motion have functions of their own: `calibrate_rests`, `calibrate_poses`, ..."
NO_TERMINAL = "draws or prints while the verb runs"
BETWEEN = "`recording.between(t0, t1)` cuts a recording"
CONDITION = "one of the `conditions` of simulate"
SHELL_ONLY = {
    **dict.fromkeys(("report", "figures", "rrd", "json"), RESULT),
    "effects": CATALOGUE,
    "holdout_share": BETWEEN,
}
SHELL_ONLY_OF = {
    "add": {"output": RESULT},
    "remove": {"output": RESULT},
    "calibrate": {
        "output": RESULT,
        "urdf": "`export(result, urdf=...)` writes it",
        **dict.fromkeys(("workers", "scheduler"), "`solver=` takes one that spreads"),
    },
    "compare": dict.fromkeys(("poses", "rests", "frequency"), OTHER_KIND),
    "discover": {"output": "`save=` is called after each step"},
    "info": {"locked_springs": "`tools.bags.read_locked.read_coupling([bag], robot)` gives the matrix as an object"},
    "replay": {"output": RESULT, **dict.fromkeys(("batch", "live", "speed"), NO_TERMINAL)},
    "simulate": {
        **dict.fromkeys(("kind", "count", "session", "orientation", "pose", "realisations", "highest"), OTHER_KIND),
        **dict.fromkeys(("f0", "periods", "share", "weights", "at", "hold"), OTHER_KIND),
        **dict.fromkeys(
            ("set", "friction", "encoder_rate", "gyro_rate", "target_rate", "jitter", "drop", "transport_delay"),
            CONDITION,
        ),
        **dict.fromkeys(("white_encoder", "disturbance"), CONDITION),
    },
}
WITHOUT_FUNCTION = {
    "closed-loop": "a study with many choices: `tools.closed_loop.run_closed_loop`",
    "demo": "a story told on a terminal",
    "effects": "prints cards: `robots.files.effect_catalogue.catalogue()` holds them",
    "frequency": "`graphs.responses` measures responses of any signals",
    "init": "writes a text with comments that a user goes on editing",
    "report": "`.save(report=...)` of any result",
    "robots": "prints a robot file: `load_robot(name)` loads it",
    "view": "opens a window",
}
WITH_FUNCTION = sorted(set(verbs()) - set(WITHOUT_FUNCTION))


def test_every_verb_has_a_function_or_a_reason():
    assert {verb for verb in verbs() if not callable(getattr(js, verb.replace("-", "_"), None))} == set(
        WITHOUT_FUNCTION
    )


@pytest.mark.parametrize("verb", WITH_FUNCTION)
def test_every_option_is_an_argument_or_has_a_reason(verb):
    (choices,) = (a.choices for a in _parser([verb])._actions if isinstance(a, argparse._SubParsersAction))
    options = {action.dest for action in choices[verb]._actions} - {"help"}
    arguments = set(inspect.signature(getattr(js, verb)).parameters)
    own = SHELL_ONLY_OF.get(verb, {})
    for option in options:
        there = option in arguments or OTHER_NAME.get(option, option) in arguments
        if option in own:
            assert option not in arguments, f"{verb}: {option} is an argument now; take it from the list"
        elif option in SHELL_ONLY and option != "effects":
            assert option not in arguments, f"{verb}: {option} is an argument now; take it from the list"
        else:
            assert there or option in SHELL_ONLY, f"{verb} --{option.replace('_', '-')} is no argument of js.{verb}"
    assert set(own) <= options, f"{verb}: {set(own) - options} are no options any more"


def test_stretches_are_left_out_as_on_the_command_line():
    made = js.simulate("doggy", seconds=2.0, seed=2).recording
    (by_pair,) = without_stretches([made], [(0.5, 0.75)])
    (by_text,) = without_stretches([made], ["0.5:0.75"])
    assert by_pair.left_out == by_text.left_out == ((0.5, 0.75),)
    with pytest.raises(RecordingError, match=r"2 recordings are meant; expected \[BAG:\]T0:T1"):
        without_stretches([made, made], [(0.5, 0.75)])
    with pytest.raises(RecordingError, match=r"expected \(t0, t1\) \[s\] or 'BAG:T0:T1', got float 0.5"):
        without_stretches([made], [0.5])
    for verb in ("calibrate", "diagnose", "discover"):
        with pytest.raises(RecordingError, match=r"cannot leave out 7 to 8 s"):
            getattr(js, verb)("doggy", made, leave_out=[(7.0, 8.0)])
    with pytest.raises(RecordingError, match=r"cannot leave out 7 to 8 s"):
        js.compare("doggy", made, leave_out=["7:8"])
