"""What a keeper counts of a timed solve, from outside: the machine before and after it, and the most memory held."""

from typing import Literal

from attrs import define, evolve

from matbench.plans.limits import cores
from matbench.runs.outcome import Outcome
from matbench.solving import disturbance, intake


@define
class Stopwatch:
    """It is started when a process gets its order; what the process says sets the begin and the end of its solve."""

    pid: int
    start: disturbance.Moment | None = None
    begin: disturbance.Moment | None = None
    end: disturbance.Moment | None = None
    peak_mb: float = 0.0

    def begin_warm_up(self) -> None:
        """The process gets its order now."""
        self.start = disturbance.moment(self.pid)

    def take(self, word: Literal["begins", "ends"]) -> None:
        """Count when the timed solve begins or ends.

        Raises
        ------
        ValueError
            If it was said before, or the end before the beginning.
        """
        now = disturbance.moment(self.pid)
        if word == "begins" and self.begin is None:
            self.begin = now
        elif word == "ends" and self.begin is not None and self.end is None:
            self.end = now
        else:
            raise ValueError(f"{word} twice")

    def take_memory(self, used: float) -> None:
        """Take in how many MiB are held now, if the timed solve is under way."""
        if self.begin is not None and self.end is None:
            self.peak_mb = max(self.peak_mb, used)

    def timed(self, outcome: Outcome, threads: int) -> Outcome:
        """An outcome with what was counted: seconds, processor seconds, memory, and what others took.

        Raises
        ------
        ValueError
            If the process has not let itself be timed.
        """
        if outcome.elsewhere:
            return evolve(outcome, doubt="its answers were found elsewhere", peak_mb=None, processor_seconds=None)
        if self.start is None or self.begin is None or self.end is None or outcome.seconds is None:
            raise ValueError("it was not timed")
        solve = disturbance.between(self.begin, self.end)
        # the system counts coarsely: of a short solve, what others took while it was warmed up says more
        looked = solve if solve.wall >= disturbance.SHORTEST else disturbance.between(self.start, self.end)
        outcome = intake.corrected(outcome, solve.wall)
        if not outcome.doubt and looked.is_disturbed(threads, cores()):
            taken = looked.others + looked.stolen
            when = "meanwhile" if looked is solve else f"in the {looked.wall:.2g} s of its warm-up and solve"
            outcome = evolve(outcome, doubt=f"others took {taken:.2g} processor seconds {when}")
        return evolve(
            outcome,
            peak_mb=max(outcome.peak_mb or 0.0, self.peak_mb),
            processor_seconds=solve.own,
            others_seconds=solve.others + solve.stolen,
        )
