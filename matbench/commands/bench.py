"""`matbench bench`: is it as fast as it was, is it faster than another commit, and how does its time grow?"""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import attrs
from attrs import field, frozen
from cyclopts import App, Parameter

from matbench.commands.console import DONE, FAILED, Console, print_json, print_text
from matbench.errors import UserError

REGRESSION = 3

app = App(
    name="bench",
    help="Measure the methods' speed: against stored ratios, another commit, or growing scenes.",
    help_epilogue="""\
Times mean little on machines that others use, so every method and kernel is measured in turns with a
frozen reference workload, and what counts is the median of the ratios. What looks slower than the ratio
stored for this kind of machine is measured in turns with the commit that stored it, before it is called so;
where that commit is not at hand, again in fresh processes. On a kind of machine without stored ratios
nothing is judged. Exit status: 0 well, 1 something could not be measured, 2 wrong usage, 3 slower, or
other work than counted before.

**Examples**

`matbench bench`  exact counters of work, then times, judged by what is stored for this kind of machine

`matbench bench --only 'semi*' --only winner`

`matbench bench --update`  accept what is measured now: after an intended change, or on a new kind of machine

`matbench bench --base origin/main`  working tree and another commit in turns: for a pull request

`matbench bench --compile`  compilation, which has a budget of its own

`matbench bench --scaling --out growth`  time against pixels, disparities and views, with figures
""",
    help_format="markdown",
)


@Parameter(name="*")
@frozen
class Choice:
    """What is measured, and how the results are printed."""

    only: Annotated[
        list[str], Parameter(negative="", show_default=False, help="Method, kernel or pattern; may be repeated.")
    ] = field(factory=list)
    rounds: Annotated[int, Parameter(help="Rounds in a process; fewer of what takes long.")] = 25
    margin: Annotated[float, Parameter(help="How much slower is a regression: 0.15 is 15 per cent.")] = 0.15
    markdown: Annotated[bool, Parameter(negative="", help="Print tables in Markdown, for a job summary.")] = False
    as_json: Annotated[bool, Parameter(name="--json", negative="", help="Machine-readable.")] = False


DEFAULTS = Choice()


@app.default
def bench(
    *,
    update: Annotated[
        bool, Parameter(negative="", help="Store what is measured, for this kind of machine, and the counters.")
    ] = False,
    base: Annotated[str | None, Parameter(help="Commit to measure against, such as `origin/main`.")] = None,
    pairs: Annotated[int, Parameter(help="With --base: pairs of processes.")] = 4,
    work: Annotated[bool, Parameter(help="Check, or with --update store, the counters of work.")] = True,
    compile: Annotated[bool, Parameter(negative="", help="Measure compilation, too.")] = False,
    scaling: Annotated[bool, Parameter(negative="", help="Measure how time grows; judges nothing.")] = False,
    seconds: Annotated[float, Parameter(help="With --scaling: about how long at most.")] = 180,
    out: Annotated[Path | None, Parameter(help="With --scaling: folder for figures and tables.")] = None,
    baselines: Annotated[
        Path | None, Parameter(help="Folder of stored ratios; default tests/benchmarks/baselines.")
    ] = None,
    choice: Choice = DEFAULTS,
) -> int:
    """Measure the methods' speed."""
    _check(choice, update, base, pairs, scaling, out, seconds)
    output = _Output(choice)
    if scaling:
        return _grow(choice, seconds, out, output)
    from matbench.bench.measuring import Tree, subjects

    tree = Tree.here()
    with output.progress() as progress:
        names = subjects(tree, choice.only)
        if base is not None:
            status = _against(tree, base, names, pairs, choice, output, progress)
        else:
            judging = _Judging(tree, names, baselines, choice, output, progress)
            status = judging.update(work, compile) if update else judging.check(work, compile)
    output.close()
    return status


def _check(
    choice: Choice, update: bool, base: str | None, pairs: int, scaling: bool, out: Path | None, seconds: float
) -> None:
    if sum((update, base is not None, scaling)) > 1:
        raise UserError("--update, --base and --scaling are three different things: give one of them")
    if update and choice.only:
        raise UserError(f"--update accepts all that is measured: leave out --only {choice.only[0]}")
    if out is not None and not scaling:
        raise UserError(f"--out {out} is for figures of growth: add --scaling")
    if out is not None and out.exists() and not out.is_dir():
        raise UserError(f"--out {out} is a file: name a folder")
    if not 5 <= choice.rounds <= 10000:
        raise UserError(f"rounds {choice.rounds} is not a whole number from 5 to 10000")
    if not 2 <= pairs <= 100:
        raise UserError(f"pairs {pairs} is not a whole number from 2 to 100: one pair has no interval")
    if not 0 < choice.margin <= 10:
        raise UserError(f"margin {choice.margin:g} is not between 0 and 10; 0.15 is 15 per cent")
    if not 1 <= seconds <= 86400:
        raise UserError(f"seconds {seconds:g} is not between 1 and 86400")


class _Output:
    """Prints tables and lines as text or Markdown; with ``--json``, one document at the end."""

    def __init__(self, choice: Choice) -> None:
        self._choice = choice
        self._console = Console()
        self.document: dict[str, Any] = {}

    def table(self, table: Any) -> None:
        if self._choice.markdown:
            print_text(table.markdown())
        elif not self._choice.as_json:
            self._console.print(table.rich())
            for note in (*table.notes, ""):
                self._console.say(note)

    def say(self, line: str) -> None:
        if not self._choice.as_json:
            self._console.say(f"{line}\n" if self._choice.markdown else line)
        self.document.setdefault("said", []).append(line)

    @contextmanager
    def progress(self) -> Iterator[Callable[[str], None]]:
        """Show progress on the error stream: a status line in a terminal, elsewhere one line for each step."""
        beside = Console(stderr=True)
        if beside.is_interactive:
            with beside.busy("starting") as status:
                yield status.update
        else:
            said = [""]

            def tell(line: str) -> None:
                if (step := line.partition(":")[0]) != said[-1]:
                    said.append(step)
                    beside.say(f"bench: {line}")

            yield tell

    def close(self) -> None:
        if self._choice.as_json:
            print_json(_plain(self.document))


def _plain(value: Any) -> Any:
    """The value with None in place of NaN, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and value != value else value


@frozen
class _Judging:
    """Judges the working tree by the stored counters and ratios."""

    tree: Any
    names: Sequence[str]
    baselines: Path | None
    choice: Choice
    output: _Output
    progress: Callable[[str], None]

    @property
    def _folder(self) -> Path:
        from matbench.bench.baselines import folder

        return self.baselines or folder(self.tree)

    def update(self, work: bool, compile: bool) -> int:
        """Store counters and ratios, always of all subjects: one commit then stands for the whole file."""
        from matbench.bench import baselines, counting, tables
        from matbench.bench.compilation import compile_all

        if work:
            self.progress("counting work")
            counts = counting.counted(self.tree)
            counting.store(self.tree, counts)
            self.output.table(tables.counters(counts))
        made = baselines.establish(self.tree, self.names, self.choice.rounds, self.progress)
        kept = baselines.replaced(self._folder, made)
        compilation = kept.compilation if kept else None
        if compile:
            self.progress("compiling all methods without a cache")
            compilation = compile_all(self.tree).ratio
        stored = attrs.evolve(made, compilation=compilation)
        path = baselines.store_baseline(self._folder, stored)
        self.output.document |= {"stored": str(path), **attrs.asdict(stored)}
        self.output.say(f"stored: {path}")
        return DONE

    def check(self, work: bool, compile: bool) -> int:
        """Check counters and times, and compilation if asked for; the exit status is the worst of them."""
        steps = [self._counters] if work else []
        steps += [self._times]
        steps += [self._compilation] if compile else []
        return max([step() for step in steps])

    def _counters(self) -> int:
        from matbench.bench import counting

        self.progress("counting work")
        now = counting.counted(self.tree)
        if not now:
            self.output.say("no work was counted")
            return FAILED
        changed = counting.changes(counting.stored(self.tree), now)
        self.output.document["work"] = {"counters": now, "changes": changed}
        for line in changed:
            self.output.say(f"other work than before: {line}")
        if changed:
            self.output.say("if that is meant: matbench bench --update stores what is counted now")
        else:
            self.output.say(f"work: {sum(map(len, now.values()))} counters of {len(now)} methods are what they were")
        return REGRESSION if changed else DONE

    def _times(self) -> int:
        from matbench.bench import base, baselines, machine, tables
        from matbench.bench.measuring import sit

        kind = machine.kind()
        self.progress(f"timing {len(self.names)} subjects")
        first = sit(self.tree, self.names, self.choice.rounds)
        stored, why = baselines.matching(self._folder, kind, first.digest)

        def again(suspects: Sequence[str]) -> Any:
            self.progress(f"again, in a fresh process: {', '.join(suspects)}")
            return sit(self.tree, suspects, self.choice.rounds)

        commit = base.last_change(self.tree.code, self._folder / machine.file_name(kind)) if stored else None

        def decide(suspects: Sequence[str]) -> Any:
            try:
                return self._in_turns(suspects, commit, stored)
            except UserError as error:
                self.output.say(f"not measured in turns: {error}")
                return []

        results = baselines.judge(self.names, stored, first, again, decide, self.choice.margin)
        self.output.document |= {
            "machine": kind,
            "judged": stored is not None,
            "accepted": commit,
            "times": [{**attrs.asdict(one), "ratio": one.ratio, "change": one.change} for one in results],
        }
        self.output.table(tables.judged(results))
        failed = [one for one in results if one.verdict == "failed"]
        slower = [one for one in results if one.verdict == "slower"]
        if stored is None:
            self.output.say(f"not judged: {why}; matbench bench --update stores one")
        for one in slower:
            self.output.say(f"slower: {one.name} by {one.change:.1%}, {_how(one, commit)}")
        if len(failed) == len(results):
            self.output.say("nothing was measured")
        return REGRESSION if slower else DONE if results and not failed else FAILED

    def _in_turns(self, suspects: Sequence[str], commit: str | None, stored: Any) -> Any:
        """Measure the working tree in turns with the code whose ratios are stored."""
        from matbench.bench import base
        from matbench.bench.baselines import code_digest

        if commit is None:
            raise UserError("which commit stored the ratios is not known here; is the file committed, the clone whole?")
        with base.base_tree(self.tree, commit, self.progress) as other:
            if code_digest(other.code) != stored.code:
                raise UserError(
                    f"{commit[:8]} stored the ratios of other code than it holds; --update stores them anew"
                )
            return base.compare(
                self.tree, other, suspects, self.choice.margin, base.PAIRS, self.choice.rounds, self.progress
            )

    def _compilation(self) -> int:
        from statistics import median

        from matbench.bench import baselines, machine, tables
        from matbench.bench.compilation import BUDGET, compile_all

        self.progress("compiling all methods without a cache")
        found = compile_all(self.tree)
        stored, _ = baselines.matching(self._folder, machine.kind(), found.digest)
        budget = stored.compilation if stored else None
        ratios = [found.ratio]
        while budget is not None and ratios[0] > BUDGET * budget and len(ratios) < baselines.SITTINGS:
            self.progress(f"compiling again ({len(ratios) + 1} of {baselines.SITTINGS})")
            ratios.append(compile_all(self.tree).ratio)
        self.output.document["compilation"] = {**attrs.asdict(found), "ratios": ratios, "stored": budget}
        self.output.table(tables.compiled(found, budget, median(ratios)))
        if budget is None or median(ratios) <= BUDGET * budget:
            return DONE
        self.output.say(f"slower: compilation takes {median(ratios) / budget:.2f} times what is stored")
        return REGRESSION


def _how(slower: Any, commit: str | None) -> str:
    """How a subject was found to be slower, in words."""
    if slower.against is None:
        return (
            f"in {len(slower.ratios)} processes: {' '.join(f'{r:.4g}' for r in slower.ratios)} for {slower.stored:.4g}"
        )
    return f"{slower.against.low - 1:.1%} to {slower.against.high - 1:.1%}, in turns with {str(commit)[:8]}"


def _against(
    tree: Any,
    name: str,
    names: Sequence[str],
    pairs: int,
    choice: Choice,
    output: _Output,
    progress: Callable[[str], None],
) -> int:
    """Measure the working tree in turns with another commit, and print the verdicts."""
    from matbench.bench import tables
    from matbench.bench.base import base_tree, commit, compare

    digest = commit(tree.code, name)
    with base_tree(tree, digest, progress) as other:
        results = compare(tree, other, names, choice.margin, pairs, choice.rounds, progress)
    verdicts = {one.name: one.verdict(choice.margin) for one in results}
    output.document |= {"base": digest, "times": [{**attrs.asdict(r), "verdict": verdicts[r.name]} for r in results]}
    output.table(tables.compared(results, choice.margin, f"{name} ({digest[:8]})"))
    if all(verdict == "not compared" for verdict in verdicts.values()):
        output.say("nothing was compared")
        return FAILED
    missing = [one for one in results if one.reason and not one.reason.startswith("not in the base")]
    return REGRESSION if "slower" in verdicts.values() else FAILED if missing else DONE


def _grow(choice: Choice, seconds: float, out: Path | None, output: _Output) -> int:
    """Measure and print how time grows with pixels, disparities and views."""
    from matbench.plans import kernels, plugins

    os.environ.setdefault(kernels.VARIABLE, str(plugins.kernel_cache()))  # numba reads it when it is imported
    from matbench.bench import growth, growth_report

    methods = growth.chosen(choice.only)
    with output.progress() as progress:
        found = growth.measure(methods, seconds, progress)
    if not found.points:
        output.say("nothing was measured")
        return FAILED
    for table in (growth_report.exponents(found), growth_report.costs(found)):
        output.table(table)
    output.say(growth_report.machine(found))
    for one in found.left_out:
        output.say(f"without {one}: no time was left; --seconds gives more")
    output.document |= attrs.asdict(found)
    if out is not None:
        for path in growth_report.write_growth(found, out):
            output.say(f"written: {path}")
    output.close()
    return DONE
