# SPDX-License-Identifier: BSD-3-Clause
"""What can be wrong with a recording: with its messages, while the file is sound, or with the bytes of the file.

A mutation of messages takes the generator and the messages and gives other messages; its name says what it does. Add
a function with the decorator, and it is drawn like the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from fuzz_messages import ARRAY, IMU, JOINT_STATE, TEXT, Message

Messages = list[Message]
Rng = np.random.Generator
OF_MESSAGES: dict[str, Callable[[Rng, Messages], Messages]] = {}
OF_BYTES: dict[str, Callable[[Rng, bytes], bytes]] = {}

ODD_NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, -0.0, 1e9, 2.0**53)
ODD_NAMES = ("", " ", "joint: #1", "elbow\n", '"elbow"', "Ellbogen_größe", "../elbow", "null", "1.5", "x" * 3000, "*")
ODD_STAMPS = (0, 1, -1, -(10**9), 2**31 * 10**9 - 1, 10**18 * 4, 10**9, 4_294_967_295 * 10**9)
FIELDS = ("position", "velocity", "effort")
FAMOUS = (0, 1, 0x7F, 0xFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 2**63 - 1)  # lengths and counts that break readers


def _message(function: Callable[[Rng, Messages], Messages]) -> Callable[[Rng, Messages], Messages]:
    OF_MESSAGES[function.__name__] = function
    return function


def _bytes(function: Callable[[Rng, bytes], bytes]) -> Callable[[Rng, bytes], bytes]:
    OF_BYTES[function.__name__] = function
    return function


def _some(rng: Rng, messages: Messages) -> set[int]:
    """One message, some of them, all of one topic, or all."""
    n = len(messages)
    if not n:
        return set()
    kind = rng.integers(4)
    if kind == 0:
        return {int(rng.integers(n))}
    if kind == 1:
        return set(np.flatnonzero(rng.random(n) < rng.uniform(0, 0.3)).tolist())
    if kind == 2:
        topic = messages[int(rng.integers(n))].topic
        return {k for k, message in enumerate(messages) if message.topic == topic}
    return set(range(n))


def _each(rng: Rng, messages: Messages, change: Callable[[Message], Message]) -> Messages:
    chosen = _some(rng, messages)
    return [change(message) if k in chosen else message for k, message in enumerate(messages)]


def _pick(rng: Rng, values: tuple) -> object:
    return values[int(rng.integers(len(values)))]


@_message
def messages_missing(rng: Rng, messages: Messages) -> Messages:
    chosen = _some(rng, messages)
    return [message for k, message in enumerate(messages) if k not in chosen]


@_message
def messages_twice(rng: Rng, messages: Messages) -> Messages:
    chosen = _some(rng, messages)
    return [message for k, message in enumerate(messages) for _ in range(1 + (k in chosen))]


@_message
def few_messages(rng: Rng, messages: Messages) -> Messages:
    return messages[: int(rng.integers(0, 12))]


@_message
def other_order(rng: Rng, messages: Messages) -> Messages:
    if rng.random() < 0.5:
        return messages[::-1]
    received = [message.received for message in messages]
    return [replace(messages[k], received=t) for k, t in zip(rng.permutation(len(messages)), received, strict=True)]


@_message
def odd_stamps(rng: Rng, messages: Messages) -> Messages:
    return _each(rng, messages, lambda m: replace(m, stamp=int(_pick(rng, ODD_STAMPS))))  # type: ignore[call-overload]


@_message
def one_odd_stamp_for_all(rng: Rng, messages: Messages) -> Messages:
    stamp = int(_pick(rng, ODD_STAMPS))  # type: ignore[call-overload]
    return _each(rng, messages, lambda m: replace(m, stamp=stamp))


@_message
def clock_set(rng: Rng, messages: Messages) -> Messages:
    at, by = int(rng.integers(len(messages) + 1)), int(rng.choice([-1, 1]) * 10.0 ** rng.uniform(3, 17))
    return [replace(m, stamp=m.stamp + by) if k >= at else m for k, m in enumerate(messages)]


@_message
def clock_of_another_speed(rng: Rng, messages: Messages) -> Messages:
    factor = float(rng.choice([1e-6, 1e-3, 0.5, -1.0, 2.0, 1e3]))
    first = messages[0].stamp if messages else 0
    return [replace(m, stamp=first + int((m.stamp - first) * factor)) for m in messages]


@_message
def odd_reception(rng: Rng, messages: Messages) -> Messages:
    return _each(rng, messages, lambda m: replace(m, received=max(0, int(_pick(rng, ODD_STAMPS)))))  # type: ignore[call-overload]


@_message
def odd_numbers(rng: Rng, messages: Messages) -> Messages:
    def change(m: Message) -> Message:
        field = str(_pick(rng, FIELDS))
        values = list(getattr(m, field)) or [0.0] * len(m.name)
        if values:
            values[int(rng.integers(len(values)))] = float(_pick(rng, ODD_NUMBERS))  # type: ignore[arg-type]
        return replace(m, **{field: tuple(values)})

    return _each(rng, messages, change)


@_message
def one_odd_number_everywhere(rng: Rng, messages: Messages) -> Messages:
    number = float(_pick(rng, ODD_NUMBERS))  # type: ignore[arg-type]
    return _each(rng, messages, lambda m: replace(m, **{f: (number,) * len(getattr(m, f)) for f in FIELDS}))


@_message
def other_size(rng: Rng, messages: Messages) -> Messages:
    factor = float(10.0 ** rng.uniform(-12, 12) * rng.choice([-1, 1]))
    return _each(rng, messages, lambda m: replace(m, **{f: tuple(factor * x for x in getattr(m, f)) for f in FIELDS}))


@_message
def coarse_numbers(rng: Rng, messages: Messages) -> Messages:
    grid = float(10.0 ** rng.uniform(-4, 1))

    def coarse(numbers: tuple[float, ...]) -> tuple[float, ...]:
        with np.errstate(all="ignore"):
            return tuple((grid * np.round(np.array(numbers) / grid)).tolist())

    return _each(rng, messages, lambda m: replace(m, **{f: coarse(getattr(m, f)) for f in FIELDS}))


@_message
def other_length(rng: Rng, messages: Messages) -> Messages:
    n, fields = int(rng.choice([0, 1, 3, 50])), [f for f in (*FIELDS, "name") if rng.random() < 0.4]

    def change(m: Message) -> Message:
        made = {f: tuple((list(getattr(m, f)) + [0.1] * n)[:n]) for f in fields if f != "name"}
        return replace(m, **made, **({"name": (*m.name, *(f"j{k}" for k in range(n)))[:n]} if "name" in fields else {}))

    return _each(rng, messages, change)


@_message
def odd_names(rng: Rng, messages: Messages) -> Messages:
    def change(m: Message) -> Message:
        names = list(m.name)
        if names:
            names[int(rng.integers(len(names)))] = str(_pick(rng, (*ODD_NAMES, "shoulder")))
        return replace(m, name=tuple(names))

    return _each(rng, messages, change)


@_message
def one_odd_name_everywhere(rng: Rng, messages: Messages) -> Messages:
    name = str(_pick(rng, ODD_NAMES))
    return _each(rng, messages, lambda m: replace(m, name=(name, *m.name[1:])))


@_message
def names_in_another_order(rng: Rng, messages: Messages) -> Messages:
    return _each(
        rng,
        messages,
        lambda m: replace(m, name=m.name[::-1], **{f: getattr(m, f)[::-1] for f in FIELDS if rng.random() < 0.9}),
    )


@_message
def another_publisher(rng: Rng, messages: Messages) -> Messages:
    chosen = [m for m in messages if rng.random() < 0.3]
    numbers = tuple(float(_pick(rng, (0.0, 0.5, np.nan))) for _ in range(2))  # type: ignore[arg-type]
    others = [replace(m, received=m.received + 5, **{f: numbers for f in FIELDS if getattr(m, f)}) for m in chosen]
    return sorted([*messages, *others], key=lambda m: m.received)


@_message
def another_type(rng: Rng, messages: Messages) -> Messages:
    kind = str(_pick(rng, (ARRAY, IMU, TEXT, JOINT_STATE)))
    return _each(rng, messages, lambda m: replace(m, kind=kind))


@_message
def another_topic(rng: Rng, messages: Messages) -> Messages:
    topic = str(_pick(rng, ("/joint_states", "/imu1/data_raw", "/a", "/link_states", "/ä/" + "x" * 200, "no_slash")))
    return _each(rng, messages, lambda m: replace(m, topic=topic))


@_message
def a_topic_more(rng: Rng, messages: Messages) -> Messages:
    kind, number = str(_pick(rng, (IMU, ARRAY, TEXT))), float(_pick(rng, ODD_NUMBERS))  # type: ignore[arg-type]
    stamp = int(_pick(rng, (*ODD_STAMPS, None)) or 0)  # type: ignore[call-overload]
    more = [
        replace(m, topic="/more", kind=kind, position=(number,) * 3, effort=(number,) * 3, stamp=stamp or m.stamp)
        for m in messages[::2]
    ]
    return sorted([*messages, *more], key=lambda m: m.received)


@_message
def odd_frames(rng: Rng, messages: Messages) -> Messages:
    return _each(rng, messages, lambda m: replace(m, frame=str(_pick(rng, ODD_NAMES))))


@_message
def standing_still(rng: Rng, messages: Messages) -> Messages:
    fields = [f for f in FIELDS if rng.random() < 0.6]
    first = {m.topic: m for m in reversed(messages)}
    return [replace(m, **{f: getattr(first[m.topic], f) for f in fields}) for m in messages]


@_message
def a_gap(rng: Rng, messages: Messages) -> Messages:
    at, by = int(rng.integers(len(messages) + 1)), int(10.0 ** rng.uniform(7, 14))
    return [replace(m, stamp=m.stamp + by, received=m.received + by) if k >= at else m for k, m in enumerate(messages)]


@_bytes
def flipped_bits(rng: Rng, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.choice([1, 8, 64, 512]))):
        changed[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


@_bytes
def odd_length_field(rng: Rng, data: bytes) -> bytes:
    width = int(rng.choice([1, 2, 4, 8]))
    value = int(_pick(rng, FAMOUS)) % 256**width  # type: ignore[call-overload]
    at = int(rng.integers(max(1, min(len(data), 4096) if rng.random() < 0.5 else len(data))))
    return data[:at] + value.to_bytes(width, "little") + data[at + width :]


@_bytes
def truncated(rng: Rng, data: bytes) -> bytes:
    return data[: int(rng.integers(len(data)))]


@_bytes
def overwritten(rng: Rng, data: bytes) -> bytes:
    at, n = int(rng.integers(len(data))), int(2 ** rng.uniform(0, 12))
    block = bytes(n) if rng.random() < 0.5 else rng.bytes(n)
    return data[:at] + block[: len(data) - at] + data[at + n :]


@_bytes
def taken_out(rng: Rng, data: bytes) -> bytes:
    at, n = int(rng.integers(len(data))), int(2 ** rng.uniform(0, 12))
    return data[:at] + data[at + n :]


@_bytes
def put_in(rng: Rng, data: bytes) -> bytes:
    at, n = int(rng.integers(len(data))), int(2 ** rng.uniform(0, 12))
    start = int(rng.integers(len(data)))
    return data[:at] + data[start : start + n] + data[at:]


@_bytes
def exchanged(rng: Rng, data: bytes) -> bytes:
    n = int(2 ** rng.uniform(2, 12))
    a, b = sorted(int(x) for x in rng.integers(max(1, len(data) - 2 * n), size=2))
    b = max(b, a + n)
    return data[:a] + data[b : b + n] + data[a + n : b] + data[a : a + n] + data[b + n :]
