"""A step of the site's build: equations in TeX become MathML, which browsers draw by themselves, without a network."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

_TEX = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
_TAG = re.compile(r"\\tag\{(\w+)\}")


def on_page_content(content: str, **_: Any) -> str:
    """Replace what `pymdownx.arithmatex` has marked; equation n is the anchor ``#eq-n``."""
    return _TEX.sub(_drawn, content)


def _drawn(found: re.Match[str]) -> str:
    tag, bracket, text = found.groups()
    tex = html.unescape(text).strip()
    if bracket == "(":
        return str(convert(tex, display="inline"))
    number = _TAG.search(tex)
    equation = convert(_TAG.sub("", tex), display="block")
    if number is None:
        return f'<{tag} class="equation">{equation}</{tag}>'
    name = number.group(1)
    return f'<{tag} class="equation" id="eq-{name}">{equation}<span>({name})</span></{tag}>'
