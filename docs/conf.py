# SPDX-License-Identifier: BSD-3-Clause
"""How `make docs` builds the pages: Sphinx reads markdown and the docstrings of the package, and needs no internet.

Every page also reads well where it lies, on a forge or in an editor.
"""

import importlib.metadata

from sphinx.application import Sphinx

OUTSIDE = {"../examples/ros2/README.md": "pages/ros2.md", "../CONTRIBUTING.md": "pages/contributing.md"}
"""Documents that lie elsewhere, and the pages that take them into the site."""

project = "Jointscope"
author = "the Jointscope developers"
release = importlib.metadata.version("jointscope")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"Jointscope {release}"
html_show_sourcelink = False
html_copy_source = False
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"


def setup(app: Sphinx) -> None:
    """Links to documents that lie elsewhere lead to their pages."""
    app.connect("source-read", _with_links_inside)


def _with_links_inside(app: Sphinx, page: str, source: list[str]) -> None:
    for document, taken_in in OUTSIDE.items():
        source[0] = source[0].replace(f"({document})", f"({'../' * page.count('/')}{taken_in})")
