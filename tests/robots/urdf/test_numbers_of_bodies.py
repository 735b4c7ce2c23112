# SPDX-License-Identifier: BSD-3-Clause
"""Masses and inertias that are no numbers: the parser leaves such a body out, so the file is refused by the link."""

import pytest

from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.urdf_bodies import UrdfBodies

URDF = """<robot name="one"><link name="base"/>
<link name="arm"><inertial><mass value="{mass}"/>
<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"""


def written(folder, mass="1.6", ixx="0.01"):
    path = folder / "one.urdf"
    path.write_text(URDF.format(mass=mass, ixx=ixx))
    return path


@pytest.mark.parametrize("mass", ["1,6", "", "nan", "heavy"])
def test_a_mass_that_is_no_number_is_named_with_its_link_and_line(mass, tmp_path):
    path = written(tmp_path, mass)
    with pytest.raises(RobotError) as error:
        UrdfBodies.read(path)
    said = f'line 2: <mass value="{mass}"> of link arm is no number; expected a decimal number with a point, as 1.6'
    assert str(error.value) == f"{path}, {said}"


def test_an_inertia_that_is_no_number_is_named_with_its_link_and_line(tmp_path):
    with pytest.raises(RobotError, match=r'line 3: <inertia ixx="0,01"> of link arm is no number'):
        UrdfBodies.read(written(tmp_path, ixx="0,01"))


@pytest.mark.parametrize(("mass", "odd"), [("0", True), ("0.0", True), ("1.6", False), ("1e-3", False)])
def test_an_inertia_without_a_mass_is_a_complaint_about_its_link(mass, odd, tmp_path):
    complaints = UrdfBodies.read(written(tmp_path, mass)).complaints
    assert complaints == ("link arm has an inertia but mass 0, as no body has",) * odd
