# SPDX-License-Identifier: BSD-3-Clause
"""What the style sheet inside of an SVG file says of each of its elements, on a light page."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

import cssselect2
import tinycss2

Style = Mapping[str, str]
Kind = tuple[tuple[str, str], ...]
"""Names and classes of an element and of all around it."""

INHERITED = (
    "fill",
    "fill-opacity",
    "stroke",
    "stroke-opacity",
    "stroke-width",
    "stroke-dasharray",
    "stroke-linecap",
    "stroke-linejoin",
    "font-size",
    "font-weight",
    "text-anchor",
    "dominant-baseline",
)
FONT = re.compile(r"^(?:(?P<weight>bold|\d{3}) )?(?P<size>[\d.]+px)")
VARIABLE = re.compile(r"var\((--[\w-]+)(?:,\s*((?:[^()]|\([^()]*\))*))?\)")
BY_PAGE = re.compile(r"light-dark\(([^,]*),[^)]*\)")
SVG = "{http://www.w3.org/2000/svg}"


def styled(root: Element) -> Iterator[tuple[cssselect2.ElementWrapper, Style]]:
    """Every element in the order of the file, with the values that hold for it: attributes, style sheet, parents.

    Args:
        root: an SVG file whose `style` elements hold its style sheet.
    """
    rules = _rules("".join(element.text or "" for element in root.iter(f"{SVG}style")))
    of: dict[int, tuple[Kind, Style]] = {}
    seen: dict[Kind, Style] = {}
    for element in cssselect2.ElementWrapper.from_xml_root(root).iter_subtree():
        kind, above = of[id(element.parent.etree_element)] if element.parent is not None else ((), {})
        kind = (*kind, (element.local_name, element.etree_element.get("class", "")))
        if kind not in seen:  # rules of pictures ask for names and classes alone, and most elements are of few kinds
            seen[kind] = _ruled(element, rules)
        style = _style(element.etree_element, seen[kind], above)
        of[id(element.etree_element)] = kind, style
        yield element, style


def value(style: Style, name: str, default: str = "") -> str:
    """A value of a style without variables, as it is on a light page."""
    text = style.get(name, default)
    while found := VARIABLE.search(text):
        text = text[: found.start()] + style.get(found[1], found[2] or "none") + text[found.end() :]
    return BY_PAGE.sub(r"\1", text).strip()


def _ruled(element: cssselect2.ElementWrapper, rules: cssselect2.Matcher) -> Style:
    declared: dict[str, str] = {}
    for *_, more in sorted(rules.match(element), key=lambda match: match[:2]):
        declared.update(more)
    return declared


def _style(element: Element, ruled: Style, parent: Style) -> Style:
    own = {**element.attrib, **ruled}
    if "style" in element.attrib:
        own.update(_declared(tinycss2.parse_blocks_contents(element.attrib["style"])))
    if font := FONT.match(own.get("font", "")):
        own.setdefault("font-size", font["size"])
        own["font-weight"] = own.get("font-weight") or font["weight"] or "normal"
    kept = {name: text for name, text in parent.items() if name in INHERITED or name.startswith("--")}
    return {**kept, **own}


def _rules(sheet: str) -> cssselect2.Matcher:
    matcher = cssselect2.Matcher()
    for rule in tinycss2.parse_stylesheet(sheet, skip_comments=True, skip_whitespace=True):
        if rule.type != "qualified-rule":
            continue  # what holds on some screens alone
        declared = _declared(tinycss2.parse_blocks_contents(rule.content))
        for selector in cssselect2.compile_selector_list(rule.prelude):
            if selector.pseudo_element is None:
                matcher.add_selector(selector, declared)
    return matcher


def _declared(content: list[tinycss2.ast.Node]) -> dict[str, str]:
    return {
        declaration.name: tinycss2.serialize(declaration.value).strip()
        for declaration in content
        if declaration.type == "declaration"
    }
