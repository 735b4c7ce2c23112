# SPDX-License-Identifier: BSD-3-Clause
"""What a controller is handed while the engine runs is what the bag holds afterwards."""

import numpy as np
import pytest

from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.loop.online_sensors import OnlineSensors
from jointscope.tools.simulator.loop.sensing import Sampling
from jointscope.tools.simulator.occasion import Conditions, Occasion
from jointscope.tools.simulator.world.engine import TICK

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

EFFECTS = [
    "encoder_delay@joint2",
    "gyro_delay@imu1",
    "gyro_scale@imu2",
    "clock_offset@imu2",
    "bearing_flexibility@joint1",
]


class Listener:
    """A controller that pushes each joint gently and notes what arrives when."""

    def __init__(self, occasion):
        self.sensors, self.heard = OnlineSensors(occasion.sensors()), []

    def __call__(self, tick, past):
        self.heard += [(tick * TICK, sample) for sample in self.sensors.arrived(tick * TICK, past)]
        return 0.3 * np.sin(6.0 * tick * TICK + np.arange(3))


@pytest.mark.parametrize(
    "sampling",
    [
        Sampling(transport_delay=0.0),
        Sampling(gyro_rate=200.0),
        Sampling(encoder_rate=500.0, gyro_rate=330.0, jitter=2e-4, drop=0.2, transport_delay=3e-3),
    ],
    ids=["at once", "slow gyros", "jitter, loss and delay"],
)
def test_the_bag_holds_what_the_controller_was_handed(doggy, sampling):
    occasion = Occasion(doggy, "hits", 1.0, 3, Conditions(effects=EFFECTS, sampling=sampling))
    listener = Listener(occasion)
    trajectory = occasion.run(listener)
    recording = occasion.recording(trajectory, np.zeros((1000, 3)))
    for name in doggy.sensors:
        stream = recording.streams[name]
        heard = [sample for _, sample in listener.heard if sample.sensor == name]
        stamps = np.array([sample.stamp for sample in heard])
        assert len(np.unique(stamps)) == len(stamps)  # each once
        order = np.argsort(stamps)
        rows = np.searchsorted(stream.times, stamps[order])
        np.testing.assert_array_equal(stream.times[rows], stamps[order])
        values = np.array([sample.values for sample in heard])[order]
        np.testing.assert_allclose(values, stream.values[rows], rtol=0, atol=1e-12)
        missing = np.setdiff1d(stream.times, stamps)
        late = 1.0 - 0.01 - 8.0 * sampling.transport_delay
        assert (missing > late).all()  # only what arrives after the end


def test_nothing_arrives_before_it_was_sent_and_everything_at_the_next_tick(doggy):
    sampling = Sampling(transport_delay=3e-3)
    occasion = Occasion(doggy, "hits", 1.0, 3, Conditions(sampling=sampling))
    listener = Listener(occasion)
    recording = occasion.recording(occasion.run(listener), np.zeros((1000, 3)))
    for name in doggy.sensors:
        stream = recording.streams[name]
        received = dict(zip(stream.times.tolist(), stream.received.tolist(), strict=True))
        for now, sample in listener.heard:
            if sample.sensor == name:
                assert -1e-9 <= now - received[sample.stamp] < TICK + 1e-9


def test_recordings_are_those_of_the_first_version(doggy):
    """Numbers from before controllers could see more than encoders; other noise or another order would change them."""
    simulation = simulate(doggy, "moves", 2.0, seed=3, effects=["encoder_delay@joint1"], friction="smooth")
    streams = simulation.recording.streams
    expected = {
        "command": [0.9, 0.008752821628298102, -0.9],
        "motor_encoder": [-0.317441715106401, -0.6987379641094753, -0.42317933037616107],
        "imu1": [-0.07640895575477868, -3.8570340157842735, -0.17079189845751735],
        "imu2": [2.9909240526419167, 0.2894910985012947, 6.386115676630858],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(streams[name].values[1500], values, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(simulation.states[-1, :3], [1.62341995, -0.65690455, -0.93435191], rtol=1e-4)
