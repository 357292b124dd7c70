"""A step of the site's build: equations in TeX become MathML, which browsers draw by themselves, without a network."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

_TEX = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(content: str, **_: Any) -> str:
    """Replace what `pymdownx.arithmatex` has marked."""

    def drawn(found: re.Match[str]) -> str:
        tag, bracket, tex = found.groups()
        block = bracket == "["
        equation = convert(html.unescape(tex).strip(), display="block" if block else "inline")
        return f'<{tag} class="equation">{equation}</{tag}>'

    return _TEX.sub(drawn, content)
