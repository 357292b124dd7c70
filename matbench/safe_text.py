"""Text from elsewhere, made safe to print and to put into a table; and which characters no name may have.

Names, reasons and messages come from methods, archives and servers. A terminal obeys escape codes, a spreadsheet
computes what begins with "=", and marks of writing direction make a text look like another one.
"""

import re

_COLOURS = re.compile(r"\x1b\[[0-?]*[ -/]*[@-~]")  # and other such codes, as compilers print them
_HIDDEN = re.compile(
    "[\x00-\x1f\x7f-\x9f"  # control characters: the escape code is one, and so are tab and newline
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # they change the direction of the text that follows
    "\u2028\u2029\ufeff\ufff9-\ufffb"  # separators of lines, marks of byte order and of annotations
    "\ud800-\udfff"  # halves of characters, and what Python makes of bytes that are not UTF-8
    "\U000e0000-\U000e007f]"  # invisible tags
)
# explicit ranges, not `str.isprintable`: that calls joiners and no-break blanks unprintable, and letters that are
# newer than the running Python
_LONG = re.compile(r"\S{1000,}")
_FORMULA = re.compile(r"'*\s*[=+\-@＝＋－＠]")
_GUARDED = re.compile(r"''*\s*[=+\-@＝＋－＠]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]inf", re.IGNORECASE | re.ASCII)


def printable(text: str) -> str:
    r"""A text that is safe to print anywhere: hidden characters stand in it as escapes. Lines stay lines.

    >>> print(printable("\x1b[2Jgone"), printable("a\tb"), printable("caf\udce9"), printable("naïve 間"))
    \x1b[2Jgone a\tb caf\xe9 naïve 間
    """
    # most texts are plain, and a run has hundreds of thousands of them
    return text if _is_plain(text) else _HIDDEN.sub(lambda found: _escape(found[0]), text)


def _is_plain(text: str) -> bool:
    """Is every character a visible one of ASCII, or a blank?"""
    return text.isascii() and text.isprintable()


def one_line(text: str) -> str:
    r"""Prose from elsewhere as one line that is safe to print: what cannot be seen becomes a blank.

    >>> one_line("\x1b[1mno such\x1b[0m\n  file")
    'no such file'
    """
    return " ".join((text if _is_plain(text) else _HIDDEN.sub(" ", _COLOURS.sub("", text))).split())


def shortened(text: str) -> str:
    """A text whose very long words, such as paths that nobody can read, are told by their two ends.

    >>> shortened("no file " + "a" * 5000) == "no file " + "a" * 100 + " ... 4800 characters ... " + "a" * 100
    True
    """
    return _LONG.sub(lambda found: f"{found[0][:100]} ... {len(found[0]) - 200} characters ... {found[0][-100:]}", text)


def hidden_in(text: str) -> str:
    r"""The first character of a text that no name may have, in words; empty if there is none.

    >>> hidden_in("a\tb"), hidden_in("zero-width\u200djoiner")
    ('a tab', '')
    """
    found = _HIDDEN.search(text)
    if found is None:
        return ""
    words = {"\t": "a tab", "\n": "a line break", "\r": "a line break", "\x1b": "an escape code"}
    if "\udc80" <= found[0] <= "\udcff":
        return f"the byte {_escape(found[0])}, which is not UTF-8"
    return words.get(found[0], f"the hidden character U+{ord(found[0]):04X}")


def csv_field(text: str) -> str:
    """A text for a CSV file: an apostrophe goes before what a spreadsheet would compute. Numbers stay as they are.

    >>> csv_field("=1+1"), csv_field("-1.5"), csv_field("sgbm")
    ("'=1+1", '-1.5', 'sgbm')
    """
    safe = printable(text)
    return f"'{safe}" if _FORMULA.match(safe) and not _NUMBER.fullmatch(safe) else safe


def from_csv_field(text: str) -> str:
    """The text that `csv_field` was given.

    >>> from_csv_field("'=1+1"), from_csv_field("'tis")
    ('=1+1', "'tis")
    """
    return text[1:] if _GUARDED.match(text) else text


def _escape(character: str) -> str:
    if character == "\n":
        return character
    if "\udc80" <= character <= "\udcff":  # a byte of a file's name that is not UTF-8
        return f"\\x{ord(character) - 0xDC00:02x}"
    return character.encode("unicode_escape", "backslashreplace").decode("ascii")
