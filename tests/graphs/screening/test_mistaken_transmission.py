# SPDX-License-Identifier: BSD-3-Clause
"""Matrices of coupled transmissions that are wrong in a plain way, on recordings of an engine that knows no matrix."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.discovery.starting_model import starting_model
from jointscope.graphs.screening.mistaken_transmission import MISTAKEN_TRANSMISSION
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

T = np.array([[1.0, 0.0, 0.0], [0.0, 0.9, 0.0], [0.2, -0.6, 1.1]])
WITH_GYROS = replace(load_robot("doggy"), transmission=T)
WITH_LINK_ENCODERS = load_robot("biorob")
TURNED = np.diag([1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def of_gyros():
    stiff = {f"{joint}.stiffness": 900.0 for joint in WITH_GYROS.joints}
    return simulate(WITH_GYROS, "calibration", 4.0, seed=3, friction="smooth", parameters=stiff).recording


@pytest.fixture(scope="module")
def of_link_encoders():
    return simulate(WITH_LINK_ENCODERS, "calibration", 5.0, seed=3, friction="smooth").recording


def said(robot, recording):
    return {notice.kind: notice.text for notice in screen_all(recording, robot) if notice.kind in PLAIN_MISTAKES}


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (T.T, "seems transposed"),
        (np.linalg.inv(T), "seems inverse (motor angles of joint angles)"),
        (np.linalg.inv(T).T, "seems inverse and transposed"),
        (T * np.array([[1, 1, 1], [1, 1, 1], [1, -1, 1]]), "to have a wrong sign in row 3, column 2"),
        (TURNED @ T, "to have a wrong sign in row 3 (joint3)"),
        (T[:, [0, 2, 1]], "to have columns 2 and 3 exchanged"),
    ],
)
def test_what_was_done_to_a_matrix_is_said_with_the_right_one_to_paste(of_gyros, matrix, words):
    found = said(replace(WITH_GYROS, transmission=matrix), of_gyros)
    assert set(found) == {MISTAKEN_TRANSMISSION}  # no gyro is to blame
    assert words in found[MISTAKEN_TRANSMISSION] and "imu1 and imu2" in found[MISTAKEN_TRANSMISSION]
    assert "write `transmission: {matrix: [[1, 0, 0], [0, 0.9, 0], [0.2, -0.6, 1.1]]}`" in found[MISTAKEN_TRANSMISSION]


@pytest.mark.parametrize("change", [np.transpose, np.linalg.inv, lambda matrix: matrix[:, [0, 2, 1, 3]]])
def test_encoders_on_links_tell_even_where_the_wrong_matrix_exceeds_all_limits(of_link_encoders, change):
    right = WITH_LINK_ENCODERS.transmission
    found = said(replace(WITH_LINK_ENCODERS, transmission=change(right)), of_link_encoders)
    rows = ", ".join(f"[{', '.join(f'{x:.9g}' for x in row + 0.0)}]" for row in right)
    assert f"write `transmission: {{matrix: [{rows}]}}`" in found[MISTAKEN_TRANSMISSION]


def test_nothing_is_said_of_right_matrices_and_of_small_errors(of_gyros, of_link_encoders):
    assert not said(WITH_GYROS, of_gyros) and not said(WITH_LINK_ENCODERS, of_link_encoders)
    assert not said(replace(WITH_GYROS, transmission=T * [[1, 1, 1], [1, 1.02, 1], [1, 0.9, 1]]), of_gyros)


def test_a_gyro_that_is_mounted_otherwise_is_no_matter_of_the_matrix(of_gyros):
    gyro = WITH_GYROS.gyros[1]
    turned = replace(gyro, R_imu_body=np.diag([1.0, -1.0, -1.0]) @ gyro.R_imu_body)
    robot = replace(WITH_GYROS, sensors={**WITH_GYROS.sensors, gyro.name: turned})
    assert set(said(robot, of_gyros)) == {"axes"}


def test_an_element_that_is_calibrated_may_begin_with_the_other_sign(of_gyros):
    matrix = T * np.array([[1, 1, 1], [1, 1, 1], [1, -1, 1]])
    element = Parameter("joint3.from_joint2", 0.6, "rad/rad", 0.6, 1.0, False)
    parameters = {element.name: element, **WITH_GYROS.parameters}
    assert not said(replace(WITH_GYROS, transmission=matrix, parameters=parameters), of_gyros)
    fixed = {**parameters, element.name: replace(element, fixed=True)}
    text = said(replace(WITH_GYROS, transmission=matrix, parameters=fixed), of_gyros)[MISTAKEN_TRANSMISSION]
    assert "`value: -0.6` of parameters.joint3.from_joint2" in text


def test_nothing_is_searched_with_a_wrong_matrix(of_gyros):
    with pytest.raises(RecordingError, match=r"seems transposed.*correct the robot file, then search again"):
        starting_model(replace(WITH_GYROS, transmission=T.T), [of_gyros])
