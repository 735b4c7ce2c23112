# SPDX-License-Identifier: BSD-3-Clause
"""A rod of 2 kg at 0.3 m that swings about one level axis, with a hook at 0.5 m: equilibria that a page works out."""

URDF = """<robot name="lever"><link name="base"/>
<joint name="swing" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="20" lower="-3" upper="3"/></joint>
<link name="rod"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
 <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hook_joint" type="fixed"><parent link="rod"/><child link="hook"/><origin xyz="0 0 -0.5"/></joint>
<link name="hook"/></robot>"""
