"""What every command prints with, and the exit status that it ends with."""

from rich import console as rich_console

DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130


class Console(rich_console.Console):
    """A console that prints what it is told, word for word, and leaves a broken pipe to `main`."""

    def say(self, line: str) -> None:
        """Print a line that may be of any length and hold anything, such as paths."""
        self.print(line, markup=False, highlight=False, soft_wrap=True)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError
