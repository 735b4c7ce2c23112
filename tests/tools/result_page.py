# SPDX-License-Identifier: BSD-3-Clause
"""A report as a reader and a browser see it: text, anchors, links, numbers of the pictures; tags must nest."""

from __future__ import annotations

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "link", "img", "input", "hr", "wbr"}
GEOMETRY = ("d", "x", "y", "width", "height", "viewbox", "transform", "style")


class ResultPage(HTMLParser):
    """Collects what tests ask about."""

    def __init__(self, html):
        super().__init__()
        self.html, self.open, self.ids, self.links, self.numbers, self.parts = html, [], [], [], [], []
        self.feed(html)
        self.close()
        assert self.open == [], self.open

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        values = dict(attributes)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[key] for key in ("href", "src", "action", "xlink:href") if key in values]
        self.numbers += [values[key] for key in GEOMETRY if key in values]

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.parts.append(data)

    @property
    def text(self):
        """What a reader sees, with single spaces."""
        return " ".join(" ".join(self.parts).split())

    def check(self):
        """No network, no number or word that is none."""
        assert all(link.startswith("#") for link in self.links)
        for number in self.numbers:
            assert not re.search(r"\b(nan|inf)", number, re.IGNORECASE), number
        for word in ("nan", "NaN", "None", "inf", "True", "False"):
            assert not re.search(rf"\b{word}\b", self.text), word
        assert len(self.ids) == len(set(self.ids))
