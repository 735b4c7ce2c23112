# SPDX-License-Identifier: BSD-3-Clause
"""Every simulated effect: runs, matters, vanishes at its null value, refuses nonsense with a reason."""

import argparse
import json

import numpy as np
import pytest

from jointscope.robots.errors import EffectError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.command_line import add_verb
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effect_list import effect_list
from jointscope.tools.simulator.effects import make_effect, simulated_effects
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.effect import SimulatedEffect, owners_of
from jointscope.tools.simulator.world.not_simulated import NOT_SIMULATED

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

CATALOGUE = {  # id: (owners, parameters) as simulator and estimator have agreed
    "motor_viscous": ("joint", "coefficient"),
    "motor_stribeck": ("joint", "torque velocity"),
    "load_dependent_friction": ("joint", "coefficient"),
    "asymmetric_friction": ("joint", "torque"),
    "friction_by_direction": ("joint", "torque coefficient"),
    "cogging": ("joint", "cos sin order"),
    "torque_offset": ("joint", "torque"),
    "motor_lag": ("joint, robot", "time_constant"),
    "command_delay": ("joint, robot", "delay"),
    "quadratic_damping": ("joint", "coefficient"),
    "pwm_deadband": ("joint", "width"),
    "truncated_command": ("joint", "lost"),
    "command_limit": ("joint", "lost limit"),
    "spring_cubic": ("elastic joint", "stiffness"),
    "spring_curve": ("elastic joint", "quadratic cubic"),
    "backlash": ("elastic joint", "half_gap"),
    "spring_slack": ("elastic joint", "forward backward"),
    "spring_limit": ("elastic joint", "stiffness forward backward"),
    "hysteresis": ("elastic joint", "torque deflection"),
    "kinematic_coupling": ("elastic joint", "from_joint2 from_joint3"),
    "link_viscous": ("joint", "coefficient"),
    "link_coulomb": ("joint", "torque"),
    "gravity_imbalance": ("joint", "cos sin"),
    "parallel_spring": ("joint", "stiffness torque"),
    "payload": ("last joint, robot with a target", "inertia"),
    "inertia_error": ("joint", "ixx iyy izz"),
    "bearing_flexibility": (
        "joint",
        "compliance_x compliance_y damping_x damping_y inertia_x inertia_y product_xy product_xz product_yz",
    ),
    "encoder_scale": ("joint", "scale"),
    "encoder_eccentricity": ("joint, joint seen on the link", "cos sin order"),
    "encoder_hysteresis": ("joint, joint seen on the link", "half_play"),
    "encoder_harmonics": ("joint, joint seen on the link", "cos sin order"),
    "axis_misalignment": ("joint", "x y"),
    "encoder_delay": ("joint, robot, target, link encoders", "delay"),
    "encoder_filter": ("joint, robot", "variance"),
    "encoder_offset": ("joint, joint seen on the link", "offset"),
    "torque_constant_error": ("joint", "share"),
    "link_mass": ("joint", "mass x y z"),
    "gyro_delay": ("imu", "delay"),
    "gyro_scale": ("imu", "x y z"),
    "gyro_bias_drift": ("imu", "x y z"),
    "clock_offset": ("imu, robot", "offset"),
    "clock_drift": ("imu, robot", "drift"),
}
SLOW = ("gyro_bias_drift", "clock_drift")  # matter after a minute only
SECONDS = 1.5
DOGGY = load_robot("doggy")  # its springs carry the weight, so its gravity has no direction
ON_DOGGY = {name: effect for name, effect in simulated_effects().items() if owners_of(effect.acts_on[0], DOGGY)}
KINDS = [(name, kind) for name, effect in ON_DOGGY.items() for kind in effect.acts_on if owners_of(kind, DOGGY)]


def run(*effects: str, friction: str = "dry"):
    return simulate(DOGGY, "moves", SECONDS, 3, effects=effects, friction=friction, quantized=False)


@pytest.fixture(scope="module")
def plain():
    return {friction: run(friction=friction) for friction in ("dry", "smooth")}


def effect_of(effect_id: str, kind: str, robot: Robot = DOGGY) -> SimulatedEffect:
    owners = owners_of(kind, robot)  # how the first axis of a robot without weight stands makes no difference
    return make_effect(f"{effect_id}@{owners[-1 if effect_id == 'axis_misalignment' else 0]}", robot)


def null_text(effect: SimulatedEffect) -> str:
    values = ",".join(f"{name}={effect.null}" for name in effect.parameters if name not in effect.above_zero)
    return f"{effect.id}@{effect.owner}:{values}"


def changes(one, other) -> dict[str, float]:
    """Root mean square change of each sensor in units of its sigma, over the samples that both have."""
    found = {}
    for name, sensor in DOGGY.sensors.items():
        a, b = one.recording.streams[name].values, other.recording.streams[name].values
        count = min(len(a), len(b))
        found[name] = float(np.sqrt(np.mean((a[:count] - b[:count]) ** 2)) / sensor.sigmas[0])
    return found


def test_the_catalogue_is_simulated_under_its_agreed_names():
    found = {
        effect.id: (", ".join(effect.acts_on), " ".join(effect_of(effect.id, effect.acts_on[0]).parameters))
        for effect in ON_DOGGY.values()
        if effect.kind() == "catalogue"
    }
    assert found == CATALOGUE


@pytest.mark.parametrize(("effect_id", "kind"), KINDS)
def test_an_effect_matters_more_than_the_noise_of_a_sensor(plain, effect_id, kind):
    effect = effect_of(effect_id, kind)
    simulation = run(f"{effect.id}@{effect.owner}")
    assert max(changes(simulation, plain["dry"]).values()) > (0.05 if effect_id in SLOW else 1.0)
    truth = json.loads(json.dumps(simulation.truth))
    assert truth["effects"][0]["kind"] == effect.kind()
    for name, value in effect.parameters.items():
        assert truth["parameters"][f"{effect.owner}.{effect_id}.{name}"] == value


@pytest.mark.parametrize("effect_id", list(ON_DOGGY))
def test_an_effect_of_size_zero_is_no_effect(plain, effect_id):
    kind = [kind for kind in simulated_effects()[effect_id].acts_on if owners_of(kind, DOGGY)][-1]
    effect = effect_of(effect_id, kind)
    friction = "dry" if "friction" in effect_id else "smooth"  # where the engine works on what is zero
    simulation = run(null_text(effect), friction=friction)
    assert max(changes(simulation, plain[friction]).values()) < 1e-3
    assert simulation.extra_states == {}


@pytest.mark.parametrize("effect_id", list(ON_DOGGY))
def test_wrong_owners_and_parameters_are_refused_with_what_there_is(effect_id):
    kinds = simulated_effects()[effect_id].acts_on
    owners = [owner for kind in kinds for owner in owners_of(kind, DOGGY)]
    with pytest.raises(EffectError) as wrong_owner:
        make_effect(f"{effect_id}@head", DOGGY)
    assert str(wrong_owner.value) == f"effect {effect_id} cannot act on 'head'; it acts on {', '.join(owners)}"
    effect = effect_of(effect_id, kinds[0])
    with pytest.raises(EffectError) as wrong_parameter:
        make_effect(f"{effect_id}@{effect.owner}:foo=1", DOGGY)
    names = ", ".join(effect.parameters)
    assert str(wrong_parameter.value) == f"effect {effect_id} has no parameter 'foo'; it has {names}"


@pytest.mark.parametrize("effect_id", list(ON_DOGGY))
def test_impossible_values_are_refused(effect_id):
    effect = effect_of(effect_id, simulated_effects()[effect_id].acts_on[0])
    head = f"{effect_id}@{effect.owner}"
    for name in effect.parameters:
        with pytest.raises(EffectError, match=f"effect {head}: {name} must be finite, got nan"):
            make_effect(f"{head}:{name}=nan", DOGGY)
        if name in effect.never_negative:
            with pytest.raises(EffectError, match=f"effect {head}: {name} must not be negative, got -1"):
                make_effect(f"{head}:{name}=-1", DOGGY)
        if name in effect.above_zero:
            with pytest.raises(EffectError, match=f"effect {head}: {name} must be positive, got 0"):
                make_effect(f"{head}:{name}=0", DOGGY)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("payload@joint2", "effect payload cannot act on 'joint2'; it acts on joint3"),
        ("gyro_scale", "effect 'gyro_scale': expected ID@OWNER[:param=value,...], for example gyro_scale@imu1"),
        (
            "coriolis@robot",
            "effect coriolis cannot be switched on: every simulation contains the Coriolis terms; "
            "calibrate with 'coriolis: false' in the robot file",
        ),
        ("wrong_gear@joint1:factor=0", "effect wrong_gear@joint1: factor must not be zero"),
        (
            "swapped_axes@imu1:swap=21",
            "effect swapped_axes@imu1: swap must be 12 (x and y), 13 (x and z) or 23 (y and z), got 21",
        ),
        (
            "encoder_eccentricity@joint1:cos=0.02",
            "effect encoder_eccentricity@joint1: the disc would be off by 0.841901 of its radius",
        ),
        (
            "motor_lag@robot:time_constant=1e-5",
            "effect motor_lag@robot: time_constant must be 0 or at least 0.0001 s, got 1e-05",
        ),
        (
            "inertia_error@joint3:izz=2",
            "effect inertia_error@joint3: no body has the moments of inertia 0.555363, 0.565661, 2.02 kg m2",
        ),
    ],
)
def test_messages_say_what_to_do(text, message):
    with pytest.raises(EffectError) as error:
        run(text)
    assert str(error.value) == message


def test_an_effect_given_twice_is_refused():
    with pytest.raises(EffectError, match="effect link_viscous@joint1 is given twice; give all its parameters at once"):
        run("link_viscous@joint1", "link_viscous@joint1:coefficient=2")


def test_effects_that_are_always_or_never_there_say_how_to_get_them():
    assert not set(NOT_SIMULATED) & set(simulated_effects())
    for effect_id in NOT_SIMULATED:
        with pytest.raises(EffectError, match=r"cannot be switched on: .*; (calibrate with|simulate) "):
            make_effect(f"{effect_id}@robot", DOGGY)


@pytest.mark.slow
def test_all_effects_of_all_kinds_run_together(plain):
    truth = true_robot(DOGGY, {})
    texts, together = [], {id: cls for id, cls in ON_DOGGY.items() if id != "spring_slack"}  # one dead zone a spring
    for effect_id, cls in together.items():
        owner = owners_of(cls.acts_on[0], truth)[-1]
        texts.append(f"{effect_id}@{owner}")
    simulation = run(*texts, friction="dry")
    assert len(simulation.truth["effects"]) == len(together)
    assert np.isfinite(simulation.states).all()


def test_help_lists_every_effect_once(capsys):
    parser = argparse.ArgumentParser()
    add_verb(parser.add_subparsers(), "simulate")
    with pytest.raises(SystemExit):
        parser.parse_args(["simulate", "--help"])
    words = capsys.readouterr().out.split("effects of the catalogue, by owner:")[1].replace(",", " ").split()
    for effect_id in simulated_effects():
        assert words.count(effect_id) == 1
    assert max(map(len, effect_list().splitlines())) <= 100


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "spring_slack@joint1:forward=3,backward=9",
            r"a gap of 12 rad, the slack of both ropes, is as wide as all that",
        ),
        ("encoder_harmonics@joint3.link:cos=0.1,sin=0.1", r"the offsets would be 0.566 of the signals, order times"),
        ("backlash@joint1:half_gap=50", r"a gap of 100 rad, twice half_gap, is as wide as all that the motor turns"),
        ("axis_misalignment@joint3:x=9", r"x: expected below 0.785 rad, got 9"),
    ],
)
def test_sizes_that_no_law_covers_are_told(text, message):
    with pytest.raises(EffectError, match=message):
        simulate(load_robot("biorob"), "calibration", 1.0, effects=[text])


def test_all_encoders_on_the_links_may_be_late_together():
    robot = load_robot("biorob")
    late = make_effect("encoder_delay@link_encoder:delay=0.004", robot)
    assert late.age(robot.link_encoder).tolist() == [0.004] * 4 and not late.age(robot.motor_encoder).any()
