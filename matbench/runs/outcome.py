"""The outcome of a cell: how its solve ended, and what it cost."""

from collections.abc import Mapping
from typing import Literal

from attrs import field, frozen

from matbench.plans.record_option import RecordOption

Status = Literal["ok", "skipped", "failed", "timeout", "out-of-memory", "crashed", "interrupted"]
FINAL: frozenset[Status] = frozenset({"ok", "skipped"})  # these are not solved again: they would end the same way
_LONGEST = 2000  # characters of a reason


def _one_line(text: str) -> str:
    """A text from a method or from a run folder of any origin, as one line that is safe to print."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:_LONGEST].rstrip()


@frozen
class Outcome:
    """How the solve of a cell ended, and what it cost.

    Parameters
    ----------
    seconds
        Wall time of the solve alone: no imports, no compilation, no recording.
    processor_seconds
        Processor time of the solve, summed over all processors: that of the cell's process and of all that it started.
    others_seconds
        Processor seconds that everything else on the machine took during the solve. What other virtual machines took
        from the same processors counts, too.
    doubt
        Why `seconds` cannot be compared, in words: others took the processors, or two clocks disagree. Empty if it can.
    warmup_seconds
        Wall time of a first solve on a tiny scene of the same kind, compilation included.
    peak_mb
        Largest resident memory of the cell's process during the solve, in MiB.
    reason
        Why it is not `ok`, in one line.
    has_volume
        True if the estimate has a volume that can be stored. It is stored only on request.
    work, history
        As in the method's estimate. None stands for a number that is not finite.
    recorded
        What its recording holds, if it has one.
    alone
        True if no other cell of the run was solved at the same time. Otherwise `seconds` cannot be compared.
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
        """Was the solve disturbed, by other cells or by other programs? Then `seconds` cannot be compared."""
        return self.status == "ok" and (bool(self.doubt) or not self.alone)
