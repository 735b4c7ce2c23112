# SPDX-License-Identifier: BSD-3-Clause
"""Maps the four rooms at the top of the tree into the one package `jointscope`."""

from setuptools import find_packages, setup

ROOMS = ("robots", "factors", "graphs", "tools")

packages = ["jointscope"]
package_dir = {"jointscope": "tools/facade"}
for room in ROOMS:
    package_dir[f"jointscope.{room}"] = room
    packages += [
        f"jointscope.{room}",
        *(f"jointscope.{room}.{name}" for name in find_packages(room) if name != "facade"),
    ]

setup(packages=packages, package_dir=package_dir, package_data={"": ["*.yaml", "*.urdf", "*.css", "*.js", "py.typed"]})
