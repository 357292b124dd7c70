"""Printing: what every command writes to the terminal goes through here, and is safe to look at. The exit statuses."""

import json
import os
import sys
from collections.abc import Iterator
from typing import Any

from rich import console as rich_console
from rich.segment import Segment
from rich.status import Status
from rich.text import Text

from matbench.safe_text import printable, shortened

DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130
_NARROWEST = 20  # columns: rich fails or hangs in fewer


class Console(rich_console.Console):
    """A console in which no text is obeyed by the terminal, wherever it comes from: only rich writes escape codes."""

    def say(self, line: str) -> None:
        """Print a line as it is: not wrapped, and brackets in it are not markup. For paths and names."""
        self.print(line, markup=False, highlight=False, soft_wrap=True)

    def busy(self, what: str) -> Status:
        """A context that shows, in a terminal, what is being done; `update` changes it."""
        can_draw = self.encoding.startswith("utf")
        return self.status(Text(what), spinner="dots" if can_draw else "line")

    def render(
        self, renderable: rich_console.RenderableType, options: rich_console.ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else printable(text), style, control)

    @property
    def is_dumb_terminal(self) -> bool:
        """Does the terminal know no codes? One that does not say what it is counts as such."""
        return self.is_terminal and (not os.environ.get("TERM") or super().is_dumb_terminal)


def print_text(text: str) -> None:
    """Print what a script reads: a path, or a table of a chosen format."""
    print(printable(text))


def print_json(facts: Any) -> None:
    """Print a JSON document; all of it is ASCII."""
    print(json.dumps(facts, indent=1).replace("\x7f", "\\u007f"))


def complain(message: str) -> None:
    """Print to the error stream what went wrong, in one line."""
    print(f"matbench: {printable(shortened(' '.join(message.splitlines())))}", file=sys.stderr, flush=True)
