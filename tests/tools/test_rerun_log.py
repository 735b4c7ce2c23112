# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import argparse
import os
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.errors import JointscopeError, RecordingError
from jointscope.tools.rerun_log import log_calibration, log_comparison
from jointscope.tools.rerun_log.entities.covariance_picture import correlation_picture
from jointscope.tools.rerun_log.entities.moving_robot import position_covariance
from jointscope.tools.rerun_log.entities.rrd_file import _check_complete
from jointscope.tools.rerun_log.entities.viewer_text import viewer_text
from jointscope.tools.verbs import view

FAKES = runpy.run_path(str(Path(__file__).with_name("fake_results.py")))


@pytest.fixture(scope="module")
def result():
    return FAKES["fake_calibration"](1.0)


@pytest.fixture(scope="module")
def calibration_file(result, tmp_path_factory):
    file = tmp_path_factory.mktemp("rrd") / "run.rrd"
    log_calibration(result, file)
    return file


def tab_names(file):
    """Display names of everything in the layout that the file opens with."""
    from rerun.chunk import RrdReader

    reader, names = RrdReader(str(file)), set()
    for chunk in reader.stream(store=reader.blueprints()[0]):
        batch = chunk.to_record_batch()
        for column in batch.column_names:
            if column.endswith("display_name"):
                names |= {name for row in batch.column(column).to_pylist() for name in row or []}
    return names


def paths(file):
    from rerun.chunk import RrdReader

    return {str(path) for path in RrdReader(str(file)).store().schema().entity_paths()}


def scalars(file, path):
    from rerun.chunk import RrdReader

    found = []
    for chunk in RrdReader(str(file)).stream().filter(content=path, is_static=False):
        batch = chunk.to_record_batch()
        column = next(c for c in batch.column_names if c.endswith("Scalars:scalars"))
        found.append(np.array(batch.column(column).to_pylist(), dtype=float))
    return np.concatenate(found)


def test_every_part_of_a_calibration_has_its_entities(calibration_file):
    found = paths(calibration_file)
    for path in (
        "/findings",
        "/covariance/correlation",
        "/covariance/parameters",
        "/residuals/imu1/imu1.x/residual",
        "/residuals/motor_encoder/joint3.motor_position/band",
        "/signals/imu2/imu2.z/measured",
        "/states/joint2/v_link/value",
        "/states/joint2/v_link/band",
        "/robot/link3",
        "/robot/link1/joint1_axis",
        "/robot/trail/last_second",
        "/robot/position_2_sigma",
    ):
        assert path in found, path


def test_all_tabs_are_in_the_file(calibration_file):
    expected = {"findings", "residuals", "states", "covariance", "measured and predicted", "robot in 3D"}
    assert expected <= tab_names(calibration_file)


def test_residuals_come_back_as_they_were(calibration_file, result):
    series = result.bags[0].residuals["imu1"]
    expected = (series.measured - series.predicted)[:, 1]
    np.testing.assert_array_equal(scalars(calibration_file, "/residuals/imu1/imu1.y/residual").ravel(), expected)


def test_bands_are_three_sigma(calibration_file, result):
    n = result.robot.n
    bag = result.bags[0]
    band = scalars(calibration_file, "/states/joint1/v_link/band")
    np.testing.assert_allclose(band[:, 1] - band[:, 0], 6.0 * bag.sigmas[:, n], rtol=1e-12)


def test_several_recordings_have_folders_of_their_own(tmp_path):
    log_calibration(FAKES["fake_calibration"](0.2, bags=2), tmp_path / "two.rrd")
    found = paths(tmp_path / "two.rrd")
    assert {"/bag1/states/joint1/v_link/value", "/bag2/robot/head"} <= found


def test_a_comparison_has_errors_and_predictions_per_channel(tmp_path):
    comparison = FAKES["fake_comparison"](0.5)
    log_comparison(comparison, tmp_path / "run.rrd")
    found = paths(tmp_path / "run.rrd")
    assert {"/scores", "/error/imu1.x", "/ahead/imu1.x/measured", "/open_loop/imu1.x/predicted"} <= found
    prediction = comparison.models[0].sensors["imu1"]
    error = scalars(tmp_path / "run.rrd", "/error/imu1.x")
    assert error.shape == (np.isfinite(prediction.ahead[:, 0]).sum(), 2)


def test_a_file_that_cannot_be_written_is_one_line_and_leaves_nothing(result, tmp_path):
    with pytest.raises(JointscopeError, match=r"cannot write .*run\.rrd: No such file or directory"):
        log_calibration(result, tmp_path / "no" / "run.rrd")
    assert list(tmp_path.iterdir()) == []


def test_a_disk_without_room_is_noticed_before_the_work(result, tmp_path, monkeypatch):
    real = os.statvfs(tmp_path)
    tiny = os.statvfs_result([*real[:4], 1, *real[5:]])
    monkeypatch.setattr(os, "statvfs", lambda path: tiny)
    with pytest.raises(JointscopeError, match=r"MB are needed, 0 MB are free"):
        log_calibration(result, tmp_path / "run.rrd")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_a_file_that_was_cut_off_is_noticed(calibration_file, tmp_path):
    whole = calibration_file.read_bytes()
    (tmp_path / "cut.rrd").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(JointscopeError, match="is not complete"):
        _check_complete(tmp_path / "cut.rrd")


def test_an_interrupted_log_leaves_the_old_file(result, tmp_path, monkeypatch):
    file = tmp_path / "run.rrd"
    file.write_bytes(b"old")

    def interrupted(*args):
        raise KeyboardInterrupt

    module = sys.modules[log_calibration.__module__]
    monkeypatch.setattr(module, "_send_states", interrupted)
    with pytest.raises(KeyboardInterrupt):
        log_calibration(result, file)
    assert file.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


def test_the_ellipsoid_follows_from_the_joint_sigmas(result):
    tree = result.robot.tree
    q, sigma = np.zeros((1, 3)), np.array([[1e-3, 2e-3, 3e-3]])
    covariance = position_covariance(tree, "head", q, sigma)[0]
    # upright, 0.9 m above the joints: joint 1 moves nothing, joint 2 (y) moves x, joint 3 (-x) moves y
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [0.9 * 2e-3, 0.9 * 3e-3, 0.0], atol=1e-9)


def test_the_correlation_picture_shows_signs_as_colours(result):
    picture = correlation_picture(result)
    assert picture.dtype == np.uint8 and picture.shape[2] == 3
    assert picture[..., 2].max() > 200 and picture[..., 0].max() > 200


def test_text_that_the_viewer_cannot_draw_is_replaced():
    assert viewer_text("χ² = 1 ± 0.2 µrad − größer") == "χ² = 1 ± 0.2 µrad − größer"
    assert viewer_text("ﬁt ℹ 録画") == "fit i ??"
    assert viewer_text("\u0149 \u038b") == "n ?"


def test_viewing_a_missing_or_foreign_file_is_one_line(tmp_path):
    with pytest.raises(RecordingError, match=r"no file .*none\.rrd; the verbs write one with --rrd"):
        view.run(argparse.Namespace(file=tmp_path / "none.rrd"))
    (tmp_path / "text.rrd").write_text("hello")
    with pytest.raises(RecordingError, match=r"text\.rrd is not a file of the rerun viewer"):
        view.run(argparse.Namespace(file=tmp_path / "text.rrd"))


def test_viewing_starts_the_viewer_with_the_file(calibration_file, monkeypatch):
    commands = []
    monkeypatch.setattr(view.subprocess, "run", lambda c, **k: commands.append(c) or argparse.Namespace(returncode=0))
    assert view.run(argparse.Namespace(file=calibration_file)) == 0
    assert commands[0][1:] == ["-m", "rerun", str(calibration_file)]


def test_a_calibration_with_a_bearing_and_a_memory_shows_its_joints(tmp_path):
    result = FAKES["fake_calibration_with_effects"]()
    log_calibration(result, tmp_path / "run.rrd")
    assert (tmp_path / "run.rrd").stat().st_size > 0
