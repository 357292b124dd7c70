"""A process that reads a scene for one that may not see its truth: ``python -m matbench.scenes.reader``."""

import sys
from pathlib import Path

from matbench.errors import UserError
from matbench.scenes import views_only
from matbench.scenes.catalogue import load_scene


def main(path: str, name: str, data: str = "", *files: str) -> None:
    """Load a scene and write its views to a file; a `UserError` becomes a line on the error stream.

    Parameters
    ----------
    data
        The folder of real scenes; none if empty.
    files
        The users' own files that may hold the dataset.
    """
    try:
        views_only.write_views(load_scene(name, data or None, files), Path(path))
    except UserError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(*sys.argv[1:])
