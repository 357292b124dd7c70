"""Options that several commands share."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from attrs import field, frozen
from cyclopts import Parameter

from matbench.errors import UserError
from matbench.plans import limits
from matbench.plans.settings import Only, Settings

Data = Annotated[
    Path | None,
    Parameter(name="--data", help="Folder of real scenes; else MATBENCH_DATA, else where `fetch` puts them."),
]
Plugins = Annotated[
    list[Path],
    Parameter(
        name="--plugin",
        negative="",
        show_default=False,
        help="Python file with methods, scenes or metrics of your own; may be repeated.",
    ),
]
Metrics = Annotated[
    list[str],
    Parameter(
        name=["--metric", "-m"],
        negative="",
        show_default=False,
        help="Metric of the printed tables, such as `bad_0.25`; may be repeated; `matbench list` names all.",
    ),
]
MetricSet = Annotated[
    str | None, Parameter(name="--metrics", help="What a benchmark reports: `eth3d`, `hci`, `kitti` or `middlebury`.")
]


def many(short: str, long: str, text: str) -> Parameter:
    """An option that takes several values and may be repeated."""
    return Parameter(name=[long, short], consume_multiple=True, negative="", help=text)


@Parameter(name="*")
@frozen
class Options:
    """The options that `compare` and `ablate` share."""

    data: Data = None
    out: Annotated[Path | None, Parameter(help="Run folder; default runs/ and a digest of what is asked for.")] = None
    seed: Annotated[
        list[str],
        Parameter(
            consume_multiple=True, negative="", show_default=False, help="Whole number, one or several; default 0."
        ),
    ] = field(factory=lambda: ["0"])
    plugin: Plugins = field(factory=list)
    metric: Metrics = field(factory=list)
    metrics: MetricSet = None
    timeout: Annotated[
        str, Parameter(help="Seconds that each cell may take, reading, warm-up and recording included; or none.")
    ] = f"{limits.HOUR:g}"
    memory: Annotated[
        str | None, Parameter(help="Memory that each cell may hold, such as 4G; default a share of the machine's.")
    ] = None
    jobs: Annotated[str, Parameter(help="Cells that run at once. Their seconds are then marked as not comparable.")] = (
        "1"
    )
    threads: Annotated[
        str | None, Parameter(help="Threads that each method is given; default the cores, shared out to the jobs.")
    ] = None
    isolation: Annotated[
        str, Parameter(help="process: one for each cell; shared: one for many, for methods that you trust.")
    ] = "process"
    dask: Annotated[
        str | None,
        Parameter(help="Dask scheduler that hands out the cells, tcp://HOST:PORT; or local: JOBS workers here."),
    ] = None
    only: Annotated[
        Only | None,
        Parameter(
            help="`missing`: cells never computed, `failed`: those that did not end well, `all`: every cell again; "
            "default what is not done."
        ),
    ] = None
    steady: Annotated[
        bool,
        Parameter(
            negative="",
            help="Solve again, at the end and one by one, cells that other cells or programs disturbed.",
        ),
    ] = False
    until: Annotated[
        Literal["decided"] | None,
        Parameter(help="Add scenes, in order, until the difference between the first two methods is decided."),
    ] = None
    budget: Annotated[str, Parameter(help="Time after which --until ends all the same, such as 10m.")] = "none"
    published: Annotated[
        bool,
        Parameter(
            negative="",
            help="Show scores as published, in grey and not ranked, beside those of the very same two views and range.",
        ),
    ] = False
    against: Annotated[
        Path | None, Parameter(help="Folder of an earlier run of the same scenes: also tell what has changed since.")
    ] = None
    repeats: Annotated[str, Parameter(help="Solve every cell so often: does a method repeat itself?")] = "1"
    dry_run: Annotated[bool, Parameter(negative="", help="Only say what would run, and why.")] = False
    quiet: Annotated[
        bool,
        Parameter(
            name=["--quiet", "-q"],
            negative="",
            show_default=False,
            help="Print nothing but the run folder, and what failed as errors.",
        ),
    ] = False
    as_json: Annotated[
        bool,
        Parameter(
            name="--json",
            negative="",
            show_default=False,
            help="Print one JSON document at the end: folder, cells, table; progress goes to the error stream.",
        ),
    ] = False

    @property
    def settings(self) -> Settings:
        """The settings of the run, except what is kept of each cell: only `compare` can choose that."""
        return Settings(
            self.data,
            timeout=self.timeout,
            memory=self.memory,
            jobs=self.jobs,
            threads=self.threads,
            isolation=self.isolation,
            dask=self.dask,
            only=self.only,
            steady=self.steady,
            published=self.published,
            metrics=asked_metrics(self.metric, self.metrics, self.plugin),
            against=self.against,
        )

    @property
    def grows(self) -> bool:
        """Are scenes added as the run goes?"""
        if self.until is None and self.budget != "none":
            raise UserError(f"--budget {self.budget} ends what --until decided goes on with: add that, too")
        return self.until is not None

    @property
    def seeds(self) -> list[int]:
        return [whole("seed", one) for one in self.seed]


DEFAULTS = Options()


def whole(name: str, text: str) -> int:
    """A whole number as it was typed; anything else is refused, not rounded."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise UserError(f"{name} {text!r} is not a whole number from 0 to 999999999")
    return int(text)


def asked_metrics(names: Sequence[str], of: str | None = None, files: Sequence[Path] = ()) -> tuple[str, ...]:
    """The names of the metrics that are asked for: those named, then those of a benchmark's set; each once.

    Raises
    ------
    UserError
        If no metric has such a name, in the users' own files neither, or there is no such set.
    """
    from matbench.measures.benchmarks import set_named
    from matbench.plans.plugins import using
    from matbench.results import metric_catalogue

    every = [*names, *(set_named(of).metrics if of is not None else ())]
    with using(files):
        return tuple(dict.fromkeys(metric_catalogue.metric_named(name).name for name in every))


def need_volumes(metrics: Sequence[str], files: Sequence[Path] = ()) -> bool:
    """Does one of these metrics score volumes? Then they must be kept."""
    from matbench.plans.plugins import using
    from matbench.results import metric_catalogue

    with using(files):
        return any(map(metric_catalogue.of_volumes, metrics))
