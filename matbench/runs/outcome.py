"""What became of a cell."""

from collections.abc import Mapping
from typing import Literal

from attrs import field, frozen

from matbench.plans.record_option import RecordOption

Status = Literal["ok", "skipped", "failed", "timeout", "out-of-memory", "crashed", "interrupted"]
FINAL: frozenset[Status] = frozenset({"ok", "skipped"})
_LONGEST = 2000  # characters of a reason


def _one_line(text: str) -> str:
    """What a method, or whoever wrote a run folder, has to say, as one line that can be printed."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:_LONGEST].rstrip()


@frozen
class Outcome:
    """What became of a cell.

    Parameters
    ----------
    seconds
        Wall time of the solve alone: no imports, no compilation, no recording.
    processor_seconds
        Of the solve, over all processors: of the cell's process and of all that it started.
    others_seconds
        Processor seconds that all else on the machine took meanwhile, another machine's on the same processor included.
    doubt
        Why `seconds` cannot be compared, in words: others took the processors, or two clocks disagree.
    warmup_seconds
        Wall time of a first solve on a tiny scene of the same kind, compilation included.
    peak_mb
        Largest resident memory of the cell's process during the solve, in MiB.
    reason
        Why it is not `ok`, in one line.
    has_volume
        Did the estimate have a volume that could be kept? It is kept only on request.
    work, history
        As the estimate gave them; None for a number that is not finite.
    recorded
        What its recording holds, if it has one.
    alone
        Did no other cell of the run run meanwhile? Otherwise `seconds` is not comparable.
    maps
        Digest of its maps (`maps_digest`), if it has any.
    ran_on
        The machine and the versions that it ran on (`matbench.runs.provenance.ran_on`).
    """

    status: Status
    seconds: float | None = None
    warmup_seconds: float | None = None
    peak_mb: float | None = None
    threads: int | None = None
    reason: str = field(default="", converter=_one_line)
    has_volume: bool = False
    work: Mapping[str, int] = {}
    history: Mapping[str, list[float | None]] = {}
    recorded: RecordOption | None = None
    alone: bool = True
    maps: str = ""
    ran_on: Mapping[str, str] = {}
    processor_seconds: float | None = None
    others_seconds: float | None = None
    doubt: str = field(default="", converter=_one_line)

    @property
    def is_doubtful(self) -> bool:
        """Was it timed while others, be they other cells, took the processors? Then `seconds` cannot be compared."""
        return self.status == "ok" and (bool(self.doubt) or not self.alone)
