"""Standard output and errors that never end a command; in processes of their own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

OPEN = "from matbench.commands import streams; import sys, os; streams.open_lasting()\n"


def shell(code: str, line: str, **environment: str) -> "subprocess.CompletedProcess[bytes]":
    """Run a program within a shell's line, in which it is called $P."""
    given = {**os.environ, "P": f"{sys.executable} -c 'exec(os.environ[\"CODE\"])'", **environment}
    given["CODE"] = OPEN + code
    line = line.replace("$P", f"{sys.executable} -c 'import os; exec(os.environ[\"CODE\"])'")
    return subprocess.run(["bash", "-c", line], env=given, capture_output=True, timeout=300)


LONG = "for _ in range(100000): print('x' * 10)\nprint('end', streams.fault(), file=sys.stderr)"


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("$P | head -1 > /dev/null", b"end \n"),
        ("$P > /dev/full", b"end No space left on device\n"),
        ("$P >&-", b"end \n"),
        ("$P < /dev/null > /dev/null", b"end \n"),
    ],
)
def test_output_that_goes_nowhere_ends_nothing(line: str, told: bytes) -> None:
    assert shell(LONG, line).stderr == told


def test_errors_that_go_nowhere_end_nothing() -> None:
    code = "for _ in range(9999): print('x' * 99, file=sys.stderr)\nprint('end')"
    assert shell(code, "$P 2> /dev/full").stdout == shell(code, "$P 2>&-").stdout == b"end\n"


def test_a_file_never_gets_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    code = f"file = open({str(tmp_path / 'mine')!r}, 'w'); os.write(1, b'astray'); assert file.fileno() > 2"
    assert shell(code, "$P <&- >&- 2>&-").returncode == 0
    assert (tmp_path / "mine").read_bytes() == b""


def test_a_slow_reader_is_waited_for() -> None:
    code = "os.set_blocking(1, False)\nprint('x' * 1000000)\nprint('end', streams.fault(), file=sys.stderr)"
    done = shell(code, "$P | (sleep 0.3; cat)")
    assert done.stdout.strip() == b"x" * 1000000
    assert done.stderr == b"end \n"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_what_an_encoding_lacks_is_replaced(encoding: str) -> None:
    done = shell("print('naïve – 視差 \\udc80 end')", "$P", PYTHONIOENCODING=encoding)
    assert done.stderr == b""
    assert done.stdout.decode(encoding).endswith("? end\n")


@pytest.mark.parametrize("said", ["0", "abc", "-5", "²", "", "99999999999999999999", " 80"])
def test_a_width_that_is_none_is_forgotten(said: str) -> None:
    code = "streams.mend_width()\nprint(os.environ.get('COLUMNS'), os.environ.get('LINES'))"
    assert shell(code, "$P", COLUMNS=said, LINES="24").stdout == b"None 24\n"
    assert shell(code, "$P", COLUMNS="132", LINES=said).stdout == b"132 None\n"
