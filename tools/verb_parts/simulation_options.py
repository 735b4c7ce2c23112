# SPDX-License-Identifier: BSD-3-Clause
"""Options of every verb that simulates: what is true of the robot and its sensors."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from jointscope.robots.errors import SimulationError
from jointscope.tools.simulator.loop.sensing import Sampling
from jointscope.tools.simulator.occasion import Conditions
from jointscope.tools.simulator.world.disturbance import Disturbance


def add_simulation_options(parser: argparse.ArgumentParser, rests: str = "") -> None:
    """Adds --effect, --set, --friction and those of sensors and disturbances.

    Args:
        parser: of the verb.
        rests: what the help says of rates in recordings of rests.
    """
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="ID@OWNER[:param=value,...]",
        help="a physical effect, of a noticeable size unless you give values; may be repeated; listed below",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="true value of a parameter; may be repeated"
    )
    parser.add_argument(
        "--friction",
        choices=["dry", "smooth"],
        default="dry",
        help="friction of the motors; dry: motors stick, which the model rounds off, so that more than the named "
        "effects is missing; smooth: rounded off as in the model; default dry",
    )
    sensors = parser.add_argument_group("sensors and disturbances")
    sensors.add_argument("--encoder-rate", type=float, metavar="HZ", help=f"default 1000{rests}")
    sensors.add_argument("--gyro-rate", type=float, metavar="HZ", help=f"default 1000{rests}")
    sensors.add_argument("--target-rate", type=float, default=200.0, metavar="HZ", help="of trackers; default 200")
    sensors.add_argument("--jitter", type=float, default=0.0, metavar="MS", help="of sampling, 1 sigma [ms]; default 0")
    sensors.add_argument("--drop", type=float, default=0.0, metavar="P", help="share of lost samples; default 0")
    sensors.add_argument(
        "--transport-delay",
        type=float,
        default=0.5,
        metavar="MS",
        help="mean time from stamp to arrival [ms]; default 0.5",
    )
    sensors.add_argument("--white-encoder", action="store_true", help="white encoder noise instead of quantization")
    sensors.add_argument(
        "--disturbance",
        metavar="NAME=VALUE,...",
        help="random torques: link and motor [N m, 1 sigma], correlation_time [s]; "
        "for example link=0.3,motor=0.3,correlation_time=0.02",
    )


def conditions_of(args: argparse.Namespace, rate: float = 1000.0) -> Conditions:
    """What the options say.

    Args:
        args: of the command line.
        rate: of encoders and gyros, if they do not say it [Hz].

    Raises:
        SimulationError: an option is impossible.
    """
    sampling = Sampling(
        rate if args.encoder_rate is None else args.encoder_rate,
        rate if args.gyro_rate is None else args.gyro_rate,
        args.jitter * 1e-3,
        args.drop,
        args.transport_delay * 1e-3,
        not args.white_encoder,
        args.target_rate,
    )
    disturbance = Disturbance.parse(args.disturbance or "")
    return Conditions(assignments(args.set), args.effect, args.friction, disturbance, sampling)


def assignments(texts: Sequence[str]) -> dict[str, float]:
    """Values by name from texts NAME=VALUE.

    Raises:
        SimulationError: another form.
    """
    values = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            values[name.strip()] = float(number)
        except ValueError:
            raise SimulationError(f"--set {text}: expected NAME=VALUE, for example joint1.stiffness=180") from None
    return values
