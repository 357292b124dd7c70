"""The console that commands print with."""

import json
from io import StringIO

import pytest
from rich.table import Table

from matbench.commands.console import Console, complain, print_json, print_text

HOSTILE = "\x1b[2J\x1b]0;title\x07 \x9b31m \u202egnp.exe \udc80"


def test_a_line_is_printed_as_it_is() -> None:
    line = "runs/[bold]a/" + "long" * 40 + "[/] 17"
    out = StringIO()
    Console(file=out, width=40, force_terminal=True).say(line)
    assert out.getvalue() == f"{line}\n"


def test_nothing_that_is_printed_is_obeyed(capsys: pytest.CaptureFixture[str]) -> None:
    out = StringIO()
    console = Console(file=out, width=200)
    table = Table(HOSTILE, title=HOSTILE)
    table.add_row(HOSTILE)
    console.print(table)
    console.say(HOSTILE)
    complain(f"{HOSTILE}\nand more")
    print_text(HOSTILE)
    print_json({HOSTILE: "\x7f" + HOSTILE})
    said = capsys.readouterr()
    assert all(c == "\n" or c.isprintable() for c in out.getvalue() + said.out + said.err)
    assert out.getvalue().count(r"\x1b[2J") == 4
    assert len(said.err.splitlines()) == 1
    assert json.loads(said.out[said.out.index("{") :]) == {HOSTILE: "\x7f" + HOSTILE}


def test_colours_of_our_own_are_still_colours() -> None:
    out = StringIO()
    Console(file=out, force_terminal=True, color_system="standard", width=40).print("[red]failed[/]")
    assert out.getvalue() == "\x1b[31mfailed\x1b[0m\n"


@pytest.mark.parametrize(("term", "draws"), [("xterm", True), ("dumb", False), ("", False), (None, False)])
def test_only_a_terminal_that_says_what_it_is_is_drawn_on(
    monkeypatch: pytest.MonkeyPatch, term: str | None, draws: bool
) -> None:
    monkeypatch.delenv("TERM", raising=False)
    if term is not None:
        monkeypatch.setenv("TERM", term)
    console = Console(file=StringIO(), force_terminal=True)
    assert console.is_interactive is draws


def test_what_is_being_done_may_hold_brackets() -> None:
    out = StringIO()
    Console(file=out, width=80).print(Console(file=out).busy("synthetic/box[size=48x36]: reading").renderable)
    assert "synthetic/box[size=48x36]: reading" in out.getvalue()


def test_nobody_is_shown_a_path_of_thousands_of_characters(capsys: pytest.CaptureFixture[str]) -> None:
    complain(f"{'a/' * 3000}plan.json cannot be read: File name too long; give a run folder")
    said = capsys.readouterr().err
    assert "a/a/ ... 5809 characters ... /a/" in said
    assert said.endswith("a/plan.json cannot be read: File name too long; give a run folder\n")
    assert len(said) < 400
