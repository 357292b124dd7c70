"""Text from elsewhere: what is printed is inert, and what is written to a table computes nothing."""

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from matbench.safe_text import csv_field, from_csv_field, hidden_in, one_line, printable

HIDDEN = [*map(chr, (0, 7, 9, 10, 13, 27, 0x7F, 0x85, 0x9B, 0x61C, 0x200E, 0x202E, 0x2028, 0x2066, 0xFEFF))]
HIDDEN += [*map(chr, (0xD800, 0xDC9B, 0xDFFF, 0xE0041))]
ORDINARY = ["naïve", "視差", "שלום", "a\u00a0b", "क\u200dष", "می\u200cخواهم", "👩\u200d🔬", "½ → – … †", "{x}\\[y]"]


@pytest.mark.parametrize("text", HIDDEN)
def test_what_cannot_be_seen_is_an_escape_and_no_name(text: str) -> None:
    shown = printable(f"a{text}b")
    assert hidden_in(f"a{text}b")
    assert shown.isascii()
    assert shown.isprintable() or text == "\n"
    assert one_line(f"a{text}b") == "a b"


@pytest.mark.parametrize("text", ORDINARY)
def test_ordinary_text_of_all_peoples_stays_as_it_is(text: str) -> None:
    assert printable(text) == csv_field(text) == text
    assert hidden_in(text) == ""


@given(st.text(st.characters(codec=None)))
def test_what_is_printable_stays_so(text: str) -> None:
    assert not hidden_in(printable(text).replace("\n", ""))
    assert printable(printable(text)) == printable(text)
    assert one_line(one_line(text)) == one_line(text)


def test_a_byte_of_a_files_name_is_told_as_a_byte() -> None:
    assert printable(b"caf\xe9.png".decode("utf-8", "surrogateescape")) == r"caf\xe9.png"
    assert hidden_in("caf\udce9") == r"the byte \xe9, which is not UTF-8"


@pytest.mark.parametrize("text", ["=1+1", "+cmd", "-2+3", "@SUM(A1)", " =1", "'=1", "＝1", "-x", "+-1", "\u00a0=1"])
def test_a_formula_begins_with_an_apostrophe(text: str) -> None:
    assert csv_field(text) == f"'{text}"
    assert from_csv_field(csv_field(text)) == text


@pytest.mark.parametrize("text", ["-1.5", "+0.25", "-3", "-1e-07", "-inf", "-.5", "", "–", "a=1", "'tis"])
def test_numbers_and_other_texts_stay_as_they_are(text: str) -> None:
    assert csv_field(text) == text
    assert from_csv_field(text) == text


@given(st.text(st.sampled_from("='+-@ a1.e\t\u00a0")) | st.text())
def test_what_is_written_is_read_back(text: str) -> None:
    if not hidden_in(text):
        file = io.StringIO(newline="")
        csv.writer(file).writerow([csv_field(text), ""])
        assert from_csv_field(next(csv.reader([file.getvalue()]))[0]) == text
