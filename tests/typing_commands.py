"""Commands as a person types them."""

import pytest

from matbench.cli import main

SMALL = "synthetic/box[size=96x72]"


def run(capsys: pytest.CaptureFixture[str], *tokens: object) -> tuple[int, str, str]:
    """Exit status, output and errors of a command line."""
    with pytest.raises(SystemExit) as stop:
        main([str(token) for token in tokens])
    said = capsys.readouterr()
    return int(stop.value.code or 0), said.out, said.err
