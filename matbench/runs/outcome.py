"""The outcome of a cell: how its solve ended, and what it cost."""

from collections.abc import Mapping
from math import isfinite, log10
from typing import Literal

from attrs import field, frozen

from matbench.plans.record_option import RecordOption
from matbench.safe_text import one_line, printable

Status = Literal["ok", "skipped", "failed", "timeout", "out-of-memory", "crashed", "interrupted"]
FINAL: frozenset[Status] = frozenset({"ok", "skipped"})  # these are not solved again: they would end the same way
_LONGEST = 2000  # characters of a reason
_LARGEST = 1e10  # seconds, MiB or threads: far more than there can be
_MOST_COUNTED = 1 << 80
DEVICE = ("device_seconds", "device_mb")
"""What a method says that it took of a device."""
_DIGITS = 15  # of a number that is shown as it is


# these texts come from a method, or from a run folder of any origin


def _one_line(text: str) -> str:
    return one_line(text)[:_LONGEST].rstrip()


# two of them: mypy cannot tell what a generic converter takes
def _counts(values: Mapping[str, int]) -> Mapping[str, int]:
    return {printable(str(name)): value for name, value in values.items()}


def _curves(values: Mapping[str, list[float | None]]) -> Mapping[str, list[float | None]]:
    return {printable(str(name)): value for name, value in values.items()}


def _shown(number: float) -> str:
    """A number as it is read; of a whole one with many digits, how large it is."""
    if isinstance(number, float) or abs(number) < 10**_DIGITS:
        return str(number)
    return f"{'-' if number < 0 else ''}10^{round(number.bit_length() * log10(2))}, about"


def _facts(values: Mapping[str, str]) -> Mapping[str, str]:
    return {printable(str(name)): one_line(str(value)) for name, value in values.items()}


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
        As in the method's estimate, hidden characters in their names as escapes. None stands for a number that is
        not finite.
    recorded
        What its recording holds, if it has one.
    alone
        True if no other cell of the run was solved at the same time. Otherwise `seconds` cannot be compared.
    maps
        Digest of its maps (`maps_digest`), if it has any.
    confidence
        Digest of its confidence maps, if it has any.
    elsewhere
        The method has brought answers that it found elsewhere: `seconds` is what it says of them, or nothing.
    device_seconds, device_mb
        What the method says that it took of a device.
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
    work: Mapping[str, int] = field(factory=dict, converter=_counts)
    history: Mapping[str, list[float | None]] = field(factory=dict, converter=_curves)
    recorded: RecordOption | None = None
    alone: bool = True
    maps: str = field(default="", converter=_one_line)
    ran_on: Mapping[str, str] = field(factory=dict, converter=_facts)
    processor_seconds: float | None = None
    others_seconds: float | None = None
    doubt: str = field(default="", converter=_one_line)
    elsewhere: bool = False
    confidence: str = field(default="", converter=_one_line)
    device_seconds: float | None = None
    device_mb: float | None = None

    @property
    def answer(self) -> str:
        """What tells two answers apart: the digests of its maps and of its confidence; empty without maps."""
        return f"{self.maps}{self.confidence}"

    @property
    def implausible(self) -> str:
        """The first number that no solve gives, in words; empty if all can be right. A received file may hold any."""
        times = ("seconds", "warmup_seconds", "processor_seconds", "others_seconds", "peak_mb", "threads")
        found = {name: v for name in (*times, *DEVICE) if (v := getattr(self, name)) is not None}
        wrong = [f"{name} = {_shown(value)}" for name, value in found.items() if not 0 <= value <= _LARGEST]
        wrong += [f"{name} = {_shown(count)}" for name, count in self.work.items() if abs(count) > _MOST_COUNTED]
        wrong += [
            f"{name} = {value}"
            for name, values in self.history.items()
            for value in values
            if value is not None and not isfinite(value)
        ]
        return wrong[0][:_LONGEST] if wrong else ""

    @property
    def is_doubtful(self) -> bool:
        """Was the solve disturbed, by other cells or by other programs? Then `seconds` cannot be compared."""
        return self.status == "ok" and not self.elsewhere and (bool(self.doubt) or not self.alone)
