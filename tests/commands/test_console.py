"""The console that commands print with."""

from io import StringIO

import pytest

from matbench.commands.console import Console


def test_a_line_is_printed_as_it_is() -> None:
    line = "runs/[bold]a/" + "long" * 40 + "[/] 17"
    out = StringIO()
    Console(file=out, width=40, force_terminal=True).say(line)
    assert out.getvalue() == f"{line}\n"


def test_who_stops_reading_is_told_to_main() -> None:
    class Gone(StringIO):
        def write(self, _: str) -> int:
            raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        Console(file=Gone()).print("to nobody")
