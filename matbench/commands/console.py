"""The console that every command prints with, and the exit statuses."""

from rich import console as rich_console

DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130


class Console(rich_console.Console):
    """A console that can print lines as they are; a broken pipe is raised, for `main` to handle."""

    def say(self, line: str) -> None:
        """Print a line as it is: not wrapped, and brackets in it are not markup. For paths and names."""
        self.print(line, markup=False, highlight=False, soft_wrap=True)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError
