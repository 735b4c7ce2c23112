# SPDX-License-Identifier: BSD-3-Clause
"""Topics that are about one joint each: they are put together, and what they are called tells whose they are.

Topics of one family differ in one part of their path: `/elbow/command` and `/wrist/command`, `/motor_1/cmd` and
`/motor_2/cmd`. JointStates name their joint themselves; of plain numbers the part that differs is a joint's name or
ends like it. Numbers that count from 0 or 1 are no names: their order is that of the URDF, which is a guess.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.joined_topics import PLUS, SINGLE_TYPES, WOVEN_TYPE
from jointscope.tools.bags.messages.open_bag import Bag
from jointscope.tools.init.streams.joint_names import NameMatch, match_names

COMMANDED = re.compile(r"command|cmd|desired|target|setpoint|reference|goal|(^|\.)output\.|points\.|_d$|_des$")
"""Words in topics and fields with what a controller wants, in contrast to what is measured."""
DRIVEN = re.compile(r"effort|torque|current|duty|pwm|volt")
"""Words in topics with what acts on a motor."""
NUMBERED = re.compile(r"(.*?)(\d+)")
MANY = 200  # topics of one sort that are compared with each other


def joint_by_joint(bag: Bag, joints: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Topics that are to be joined, as each is about one joint.

    Args:
        bag: an open one.
        joints: moving joints of the URDF, base to tip.

    Returns:
        By the name of the joined topic the joints in the order of its parts; none where only their order tells.
    """
    found: dict[str, tuple[str, ...]] = {}
    for kind, topics in _candidates(bag).items():
        for family in _families(topics):
            if kind == WOVEN_TYPE and not _name_one_each(bag, family):
                continue
            order, known = _ordered(family, joints, named=kind == WOVEN_TYPE)
            if len(order) > 1:
                found[PLUS.join(order)] = known
    return found


def _candidates(bag: Bag) -> dict[str, list[str]]:
    """Topics of messages that can be about one joint, by a name of their sort."""
    found: dict[str, list[str]] = {}
    for topic in bag.topics:
        kinds = bag.type_names(topic)
        drives = COMMANDED.search(topic.lower()) or DRIVEN.search(topic.lower())
        if kinds == (WOVEN_TYPE,):
            found.setdefault(WOVEN_TYPE, []).append(topic)
        elif drives and len(kinds) == 1 and kinds[0] in SINGLE_TYPES:
            found.setdefault(kinds[0], []).append(topic)
    return {kind: topics[:MANY] for kind, topics in found.items()}


def _families(topics: Sequence[str]) -> list[dict[str, str]]:
    """Topics that differ in one part of their path, the largest families first: that part, and the topic."""
    left, families = list(topics), []
    while len(left) > 1:
        sorts = Counter(sort for topic in left for sort in _sorts(topic))
        sort, count = max(sorts.items(), key=lambda item: item[1])
        if count < 2:
            break
        family = {topic.split("/")[sort[0]]: topic for topic in left if sort in _sorts(topic)}
        families.append(_without_common_end(family))
        left = [topic for topic in left if topic not in family.values()]
    return families


def _sorts(topic: str) -> list[tuple[int, tuple[str, ...]]]:
    """A topic with each part of its path left out, in turn."""
    parts = topic.split("/")
    return [(i, (*parts[:i], "*", *parts[i + 1 :])) for i, part in enumerate(parts) if part]


def _without_common_end(family: dict[str, str]) -> dict[str, str]:
    """Labels without the last words that all have, as in `elbow_controller` and `wrist_controller`."""
    words = {label: label.split("_") for label in family}
    common = 0
    while all(len(some) > common + 1 for some in words.values()) and (
        len({some[-1 - common] for some in words.values()}) == 1
    ):
        common += 1
    return {"_".join(words[label][: len(words[label]) - common]): topic for label, topic in family.items()}


def _ordered(family: dict[str, str], joints: Sequence[str], named: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Topics of a family in the order of the joints that they are about, and these; or in that of their numbers."""
    match = match_names(joints, tuple(family))
    labels = {**match.found, **_like_the_others(match)}
    known = tuple(joint for joint in joints if joint in labels)
    doubtful = {label for label, _ in match.ambiguous} - set(labels.values())
    if len(known) > 1 and not doubtful and not (named and len(known) < len(family)):
        return tuple(family[labels[joint]] for joint in known), known
    if named:
        return tuple(family.values()), ()
    if labels or match.ambiguous:
        return (), ()
    numbers = {label: NUMBERED.fullmatch(label) for label in family}
    told = {label: (m[1], int(m[2])) for label, m in numbers.items() if m is not None}
    order = sorted(told, key=lambda label: told[label][1])
    counts = [told[label][1] for label in order]
    first = counts[0] if counts else 0
    counted = len(told) == len(family) and first in (0, 1) and counts == list(range(first, first + len(counts)))
    if not counted or len({prefix for prefix, _ in told.values()}) > 1:
        return (), ()
    return tuple(family[label] for label in order), ()


def _like_the_others(match: NameMatch) -> dict[str, str]:
    """Labels that several joints could have, for the one that begins as the joints do whose labels are certain.

    Of `panda_joint1` and `panda_finger_joint1` the first is `joint1` where `joint2` is `panda_joint2`.
    """
    begins = {joint.removesuffix(label) for joint, label in match.found.items() if joint.endswith(label)}
    found = {}
    for label, candidates in match.ambiguous:
        fitting = [joint for joint in candidates if joint.removesuffix(label) in begins and joint.endswith(label)]
        if len(fitting) == 1:
            found[fitting[0]] = label
    return found


def _name_one_each(bag: Bag, family: dict[str, str]) -> bool:
    """Whether the first message of each topic names one joint, and each another one."""
    named = []
    for topic in family.values():
        try:
            first = next(iter(bag.messages([topic])), None)
            names = () if first is None else tuple(bag.message_type(topic).decode(first[2]).name)
        except RecordingError:
            return False
        if len(names) != 1:
            return False
        named.append(names[0])
    return len(set(named)) == len(named)
