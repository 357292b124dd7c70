"""Two recordings of one scene merged into one file, for panels side by side."""

from collections import Counter
from pathlib import Path

import rerun as rr
from attrs import evolve

from matbench.errors import UserError
from matbench.recording import blueprint
from matbench.recording.blueprint import Contents
from matbench.recording.entities import read_contents
from matbench.recording.rrd import NOTE, new_stream, staged, verify

SIDES = ("A", "B")


def merge(path: Path, one: Path, other: Path) -> None:
    """Merge two recordings into one file, each below a path of its own, ``A`` or ``B``.

    Raises
    ------
    UserError
        If one cannot be read, or their scenes differ.
    RecordingError
        If what was written cannot be read back.
    """
    sides = [contents_of(one), contents_of(other)]
    if sides[0].scene != sides[1].scene:
        raise UserError(
            f"{sides[0].title!r} and {sides[1].title!r} are of different scenes: only answers to one scene compare"
        )
    for contents, name in zip(sides, SIDES, strict=True):
        contents.root = (name,)
    if sides[0].method == sides[1].method:  # two runs or seeds of one method: titles must differ
        sides = [evolve(c, title=f"{name} {c.title}") for c, name in zip(sides, SIDES, strict=True)]
    written: Counter[str] = Counter()
    with staged(path) as beside:
        stream = new_stream(beside, f"{sides[0].title} | {sides[1].title}")
        try:
            for contents, source in zip(sides, (one, other), strict=True):
                chunks = [
                    chunk.with_entity_path(contents.at(()) + chunk.entity_path)
                    for chunk in rr.chunk.RrdReader(source).stream()
                    if not chunk.entity_path.startswith("/__")  # properties of the whole file, such as its contents
                ]
                for chunk in chunks:
                    written[chunk.entity_path] += chunk.num_rows
                stream.send_chunks(chunks)
            stream.send_blueprint(blueprint.side_by_side(*sides))
        finally:
            stream.disconnect()
        verify(beside, written)


def contents_of(path: Path) -> Contents:
    """The table of contents of a recording.

    Raises
    ------
    UserError
        If the file cannot be read, or has none: `matbench.recording.rrd` did not write it.
    """
    try:
        for chunk in rr.chunk.RrdReader(path).stream().filter(content=f"/__properties/{NOTE}"):
            return read_contents(chunk.to_record_batch().to_pylist()[0]["contents"][0])
    except Exception as error:  # whatever a damaged or hostile file makes readers raise
        raise UserError(f"recording {str(path)!r} cannot be read: record the cell again") from error
    raise UserError(f"recording {str(path)!r} does not say what it holds: record the cell again")
