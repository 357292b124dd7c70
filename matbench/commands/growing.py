"""`--until decided`: scenes are added, in order, until the difference between the first two methods is decided."""

import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

from attrs import evolve, frozen

from matbench.commands import running
from matbench.commands.console import DONE, FAILED, INTERRUPTED
from matbench.commands.options import Options
from matbench.commands.running import Voice
from matbench.comparison import Growth
from matbench.errors import UserError
from matbench.measures.metrics import Better
from matbench.measures.statistics import CONFIDENCE, FEW
from matbench.plans import limits, plugins
from matbench.prepared import Comparison
from matbench.reports import standing, tables
from matbench.results import freshness, metric_catalogue
from matbench.results.deciding import Ended, Look, Why, look, places
from matbench.results.scores import Tables
from matbench.runs.lock import locked
from matbench.runs.outcome import FINAL
from matbench.runs.stopped import Stopped
from matbench.scenes.catalogue import Selection, data_root, growing_scenes, select
from matbench.shelf import only
from matbench.spec import witness


class Prepare(Protocol):
    """`matbench.comparison.prepare`, all but the scenes given: those to compare now, and all that may come."""

    def __call__(self, scenes: Sequence[str], *, growth: Growth) -> Comparison: ...


_WHY = {
    "budget": "; the budget is spent, the same command goes on from here",
    "scenes": "; there are no more scenes",
    "interrupted": "; interrupted, the same command goes on from here",
    "decided": f", judged alone; the interval holds at all looks at once ({100 * CONFIDENCE:g} %)",
}


@frozen
class Decision:
    """How a growing run ended.

    Parameters
    ----------
    first, second
        The methods; the difference is of the first minus the second.
    metric, better
        What is compared, in region `all`, and which direction of it is better.
    look
        The last look; None if none was reached.
    scenes
        At how many scenes that was.
    why
        Why it ended: ``decided``; ``budget``; ``scenes``, there are no more; ``interrupted``.
    """

    first: str
    second: str
    metric: str
    better: Better
    look: Look | None
    scenes: int
    why: Why

    @property
    def verdict(self) -> str:
        """``better`` or ``worse``, as the first method is; else ``undecided``."""
        if self.look is None or not self.look.is_decided:
            return "undecided"
        return standing.words(self.look.effect.verdict, self.better == "higher")

    @property
    def told(self) -> str:
        """The difference and its interval."""
        if self.look is None:
            return "not looked at yet"
        effect = self.look.effect
        ends = tables.interval(effect.low, effect.high)
        return f"{self.metric} in {tables.REGION} {tables.text(effect.mean, '%', signed=True)} ({ends})"

    def __str__(self) -> str:
        said = f"{self.first} against {self.second} after {self.scenes} scenes: {self.told}"
        return f"{said}, {self.verdict}{_WHY[self.why]}"

    @property
    def facts(self) -> dict[str, Any]:
        """The same for ``--json``."""
        effect = None if self.look is None else self.look.effect
        return {
            "first": self.first,
            "second": self.second,
            "metric": self.metric,
            "region": tables.REGION,
            "scenes": self.scenes,
            "difference": None if effect is None else effect.mean,
            "interval": None if effect is None else [effect.low, effect.high],
            "verdict": self.verdict,
            "ended": self.why,
        }


def names(scene: Sequence[str] | None, options: Options) -> tuple[str, ...]:
    """The scenes that may be added, in order; without any named, the default ones."""
    with plugins.using(options.plugin):
        root = data_root(options.data)
        found = select(scene, root) if scene is not None else Selection(tuple(growing_scenes(root)))
    for reason, left_out in found.left_out.items():
        Voice.of(options).say(f"without {', '.join(left_out)}: {reason}")
    return found.names


def work(prepare: Prepare, names: Sequence[str], options: Options, is_ablation: bool = False) -> int:
    """Run, look, and add scenes, until the first two methods are told apart; print and report; the exit status.

    Parameters
    ----------
    names
        The scenes, in the order in which they are added.
    """
    clock = _Clock.start(options)
    if (found := len(set(map(witness, names)))) < FEW:  # with other options a scene is no second witness
        raise UserError(f"--until decided adds scenes, and {found} decide nothing: name {FEW} or more by -s")
    ready = prepare(names[: _looks(names)[0]], growth=Growth(names))
    if options.dry_run:
        return running.show_plan(ready, options)
    voice = Voice.of(options)
    running.say_remarks(ready, voice)
    try:
        with locked(ready.folder), running.told_to_end() as write_undisturbed:
            ready, scored, made = _grown(ready, prepare, names, options, clock)
            write_undisturbed()
            stopped = made.why == "interrupted"
            ready = evolve(ready, decision=str(made))
            told = {"decision": made.facts}
            cells = running.publish(ready, is_ablation, voice, stopped, scored=scored, more=told)
            remember(ready, made)
    except (Stopped, OSError) as error:
        return running.stopped_by(error, ready)
    voice.say(str(made))
    if stopped:
        return INTERRUPTED
    # a budget that is spent before any scene is done is no failure
    fine = [*FINAL, "interrupted"] if made.why == "budget" else FINAL
    return DONE if cells["status"].isin(fine).all() else FAILED


def remember(ready: Comparison, made: Decision) -> None:
    """Keep with the tables how the run ended."""
    number = None if made.look is None else made.look.number
    if (found := freshness.made(ready.store)) is not None:
        evolve(found, ended=Ended(made.first, made.second, made.metric, number, made.why)).write(ready.store)


def decided_again(ready: Comparison, scored: Tables, ended: Ended | None) -> Decision | None:
    """The decision of a growing run from tables that are made anew.

    None if the run did not grow, or if what it was decided by is not there, or does not decide it any more.
    """
    among, results = ready.plan.among, tables.labelled(scored.results)
    at, names = _looks(among) if among else [], {str(cell.method) for cell in ready.plan.cells}
    if ended is None or not {ended.first, ended.second} <= names or ended.metric not in set(results["metric"]):
        return None
    with plugins.using(ready.files):
        better = metric_catalogue.better(ended.metric)
    made = Decision(ended.first, ended.second, ended.metric, better, None, 0, ended.why)
    if ended.number is None:
        return None if ended.why == "decided" else made
    if not 0 <= ended.number < len(at):
        return None
    asked = among[: at[ended.number]]
    scenes = [ready.plan.spellings.get(name, name) for name in asked]
    if not set(scenes) <= set(ready.scenes):
        return None
    seen = results[results["scene"].isin(scenes)]
    found = look(ended.number, standing.paired(seen, ended.first, ended.second, ended.metric, better))
    made = evolve(made, look=found, scenes=len(set(map(witness, asked))))
    return made if found.is_decided == (ended.why == "decided") else None


def _grown(
    ready: Comparison, prepare: Prepare, names: Sequence[str], options: Options, clock: "_Clock"
) -> tuple[Comparison, Tables | None, Decision]:
    """Run and look until it ends; the comparison that is left, and its tables if they were made."""
    voice, metric = Voice.of(options), ready.metrics[0]
    first, second = _first_two(ready)
    better = metric_catalogue.better(metric)
    made = Decision(first, second, metric, better, None, 0, "scenes")
    scored: Tables | None = None
    for number, count in enumerate(_looks(names)):
        ready = ready if number == 0 else prepare(names[:count], growth=Growth(names, ready.scenes))
        if _stopped(ready, voice, clock):
            return complete(ready), None, evolve(made, why="budget" if clock.is_spent else "interrupted")
        scored = ready.tables()
        seen = look(number, standing.paired(scored.results, first, second, metric, better))
        made = evolve(
            made,
            look=seen,
            scenes=len(set(map(witness, names[:count]))),
            why="decided" if seen.is_decided else "scenes",
        )
        if seen.is_decided:
            break
        voice.say(f"{made.scenes} scenes: {made.told}: {standing.told(seen.effect)}")
    return ready, scored, made


def _looks(names: Sequence[str]) -> list[int]:
    """After how many of the scenes to look."""
    return places(list(map(witness, names)))


def _stopped(ready: Comparison, voice: Voice, clock: "_Clock") -> bool:
    """Run what is left; True if it was interrupted, or the budget is spent."""
    if clock.is_spent:
        return True
    try:
        with clock.limited():
            return running.run(ready, ready.pending(), voice)
    except KeyboardInterrupt:  # while it looked for what is left
        if clock.is_spent:
            return True
        raise


def _first_two(ready: Comparison) -> tuple[str, str]:
    """The methods whose difference is to be decided."""
    found = list(dict.fromkeys(str(cell.method) for cell in ready.plan.cells))
    if len(found) < 2:
        raise UserError(
            f"--until decided tells the first two methods apart, and there is only {found[0]}: add one by -a"
        )
    return found[0], found[1]


def complete(ready: Comparison) -> Comparison:
    """The comparison with those scenes only on which all methods are done; with all where there are none."""
    outcomes = ready.pending().cells
    lacking = {cell.scene for cell in outcomes}
    cells = tuple(cell for cell in ready.plan.cells if cell.scene not in lacking)
    if not cells:
        return ready
    plan = evolve(ready.plan, cells=cells)
    ready.store.write_plan(plan)
    kept = {cell.scene for cell in cells}
    return evolve(ready, plan=plan, scenes=only(ready.scenes, kept))


@frozen
class _Clock:
    """The budget of a command, from its start."""

    begun: float
    budget: float | None

    @classmethod
    def start(cls, options: Options) -> "_Clock":
        return cls(time.monotonic(), limits.duration("budget", options.budget))

    @property
    def left(self) -> float:
        """Seconds."""
        return float("inf") if self.budget is None else self.budget - (time.monotonic() - self.begun)

    @property
    def is_spent(self) -> bool:
        return self.left <= 0

    @contextmanager
    def limited(self) -> Iterator[None]:
        """A block that ends as Ctrl-C would end it when the budget is spent."""
        if self.budget is None:
            yield
            return
        before = signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, max(self.left, 1e-3))
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
