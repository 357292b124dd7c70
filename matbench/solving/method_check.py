"""What every method owes the harness, tried on small scenes, each in a process of its own (`matbench check`)."""

import os
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from functools import cache
from hashlib import sha256
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Literal

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, unsupported
from matbench.measures.volumes import StoredVolume
from matbench.plans import limits, plugins
from matbench.plans.plan import Method
from matbench.scene import Range, Scene
from matbench.scenes.catalogue import load_scene
from matbench.solving import processes
from matbench.solving.environment import kernels_kept, without_main
from matbench.solving.worker import checked, hide_truth
from matbench.spec import first_line

Verdict = Literal["pass", "fail", "skipped", "note"]

HARNESS = Path(__file__).parents[1]
_TICK = 0.05  # seconds between two looks at a process
ALIKE = 0.99  # share of a map's pixels that must agree
EASY, EITHER_SIGN = "synthetic/box[n=5 ref=1]", "synthetic/curved[n=5 ref=1]"
"""Textured scenes of 240x180 px. The reference view is not in the middle: the field's pair has only one
side there, and so has any choice of views, so that no method has to toss a coin that its mirror image
would toss the other way."""


@frozen
class Finding:
    """What one check found.

    Parameters
    ----------
    check
        Its name.
    demand
        What it asks of a method.
    verdict
        ``skipped`` where the method says that it does not support the scene, or nothing could be
        compared; a ``note`` is no fault.
    reason
        What was found; in a failure, what is wrong.
    """

    check: str
    demand: str
    verdict: Verdict
    reason: str = ""


@frozen(eq=False)
class Answer:
    """What became of one solve; without maps there is either a `reason` or an `error`.

    Parameters
    ----------
    maps
        View -> (H, W) float32 as the harness keeps them.
    digest
        SHA-256 of the estimate: maps, volume, work.
    infinite
        How many pixels of the maps were infinite.
    touched
        Was the scene changed?
    reason
        Why the method does not support the scene.
    error
        What went wrong, in a line.
    output
        What the method printed.
    """

    maps: Mapping[int, NDArray[np.float32]] = field(factory=dict)
    digest: str = ""
    infinite: int = 0
    touched: bool = False
    reason: str = ""
    error: str = ""
    output: str = ""


@frozen(eq=False)
class Trial:
    """One solve: a scene (by its parts, as a process is handed them), seed and threads."""

    name: str
    views: NDArray[np.uint8]
    ref: int
    disparities: Range
    pair_steps: float
    threads: int = 1

    @classmethod
    def of(cls, name: str, scene: Scene, threads: int = 1) -> "Trial":
        return cls(name, scene.views, scene.ref, scene.disparities, scene.pair_steps, threads)

    @property
    def scene(self) -> Scene:
        labels = tuple(str(view) for view in range(len(self.views)))
        return Scene(self.name, self.views, labels, self.ref, self.disparities, {}, self.pair_steps)


def mirrored(scene: Scene) -> Scene:
    """The scene as it is seen in a mirror: columns and the order of the views reversed.

    With x' = W - 1 - x and j' = n - 1 - j, x_j = x_ref - (j - ref) d becomes
    x'_j' = x'_ref' - (j' - ref') d: disparities keep their sign, maps are reversed along their rows.
    """
    last = scene.n - 1
    return evolve(
        scene,
        views=scene.views[::-1, :, ::-1],
        labels=scene.labels[::-1],
        ref=last - scene.ref,
        truth={last - view: truth[:, ::-1] for view, truth in scene.truth.items()},
        regions={name: mask[:, ::-1] for name, mask in scene.regions.items()},
        visible={last - view: seen[::-1, :, ::-1] for view, seen in scene.visible.items()},
        held_out=scene.held_out
        and evolve(scene.held_out, image=scene.held_out.image[:, ::-1], steps=-scene.held_out.steps),
    )


def _small(shape: tuple[int, int], disparities: Range, value: int | None = None) -> Scene:
    """Three views without any truth: random colours, or one grey everywhere."""
    size = (3, *shape, 3)
    pixels = np.random.default_rng(1).integers(0, 256, size) if value is None else np.full(size, value)
    return Scene("small", pixels.astype(np.uint8), ("0", "1", "2"), 1, disparities, {}, 1)


@cache
def trials() -> Mapping[str, Trial]:
    """Every scene that is tried, by name."""
    easy, either = (hide_truth(load_scene(name)) for name in (EASY, EITHER_SIGN))
    scenes = {
        "easy": easy,
        "easy again": easy,
        "easy mirrored": mirrored(easy),
        "either sign": either,
        "either sign mirrored": mirrored(either),
        "two views": easy.choose((1, 3)),
        "three views": easy.choose((0, 1, 2)),
        "1x1 px": _small((1, 1), Range(0, 5)),
        "one row": _small((1, 40), Range(-2, 5)),
        "one column": _small((30, 1), Range(0, 5)),
        "narrower than the range": _small((12, 5), Range(0, 12)),
        "constant": _small((24, 48), Range(0, 8), value=128),
    }
    found = {name: Trial.of(name, scene) for name, scene in scenes.items()}
    return {**found, "easy, 3 threads": Trial.of("easy", easy, threads=3)}


@contextmanager
def _printing_to(path: Path) -> Iterator[None]:
    """Send all that this process prints, from Python or from C, to a file."""
    with path.open("w", encoding="utf-8", errors="replace", buffering=1) as log:
        kept = os.dup(1), os.dup(2)
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            with redirect_stdout(log), redirect_stderr(log):
                yield
        finally:
            for saved, number in zip(kept, (1, 2), strict=True):
                os.dup2(saved, number)
                os.close(saved)


def solve(method: Method, files: Sequence[Path], trial: Trial, log: Path) -> Answer:
    """Solve one trial in this process; what the method raises is told in the answer."""
    with _printing_to(log):
        try:
            instance = plugins.algorithm(method.algorithm, files).make(method.params)
            scene, before = trial.scene, trial.views.copy()
            if reason := unsupported(instance, scene):
                return Answer(reason=reason)
            estimate = instance.solve(scene, Context(threads=trial.threads))
            touched = not np.array_equal(scene.views, before)
            maps = checked(estimate, scene)
            infinite = sum(int(np.isinf(values).sum()) for values in estimate.disparity.values())
            volume = b""
            if estimate.volume is not None:
                StoredVolume.of(estimate.volume)  # raises where it could not be kept
                volume = estimate.volume.values.tobytes()
            told = {name: [float(value) for value in values] for name, values in estimate.history.items()}
            work = {name: int(count) for name, count in estimate.work.items()}
            parts = [maps[view].tobytes() for view in sorted(maps)]
            digest = sha256(b"|".join([*parts, volume, repr((sorted(maps), told, work)).encode()])).hexdigest()
            return Answer(maps, digest, infinite, touched)
        except BaseException as error:  # whatever a method raises, SystemExit included
            traceback.print_exc()
            return Answer(error=f"{type(error).__name__}: {first_line(error)}{_where(error)}")


def _where(error: BaseException) -> str:
    """The line of the method, or of what it calls, that raised; nothing where the harness did."""
    frames = [(Path(one.filename), one.lineno) for one in traceback.extract_tb(error.__traceback__)]
    outside = [f" ({path.name}:{line})" for path, line in frames if path.parent.parent != HARNESS]
    return outside[-1] if outside else ""


def _watch(line: Connection, timeout: float, method: Method, files: Sequence[Path], trial: Trial, log: Path) -> None:
    """Have a process below this one solve a trial, send its answer, and end it with all that it has started."""
    processes.stand_apart()  # Ctrl-C is for whoever holds the line
    answers, theirs = Pipe(duplex=False)
    watcher, pid = os.getpid(), os.fork()
    if not pid:
        try:
            processes.die_with_parent(watcher)
            for ours in (line, answers):
                ours.close()
            processes.confine(limits.room())
            own, found = os.getpid(), solve(method, files, trial, log)
            if os.getpid() == own:  # no copy that the method has made of its process
                theirs.send(found)
                os._exit(0)
        finally:
            os._exit(1)
    theirs.close()
    try:
        with suppress(OSError):  # nobody wants it any more
            line.send(_heard(answers, line, pid, timeout))
    finally:
        processes.end_all_below()


def _heard(answers: Connection, line: Connection, pid: int, timeout: float) -> Answer:
    """What a process that solves a trial has answered, or what became of it."""
    end, sources = time.monotonic() + timeout, [answers, line]
    while time.monotonic() < end:
        ended = processes.reap().get(pid)
        ready = wait(sources, _TICK if ended is None else 0)
        if line in ready:
            return Answer(error="nobody wants to know")
        if answers in ready:
            try:
                found: Answer = answers.recv()
                return found
            except EOFError:
                sources.remove(answers)
        if ended is not None:
            code = os.waitstatus_to_exitcode(ended)
            how = f"signal {-code}" if code < 0 else f"exit status {code}"
            return Answer(error=f"the method ended its process ({how})")
    return Answer(error=f"no answer within {timeout:g} s")


def answer(method: Method, files: Sequence[Path], trial: Trial, timeout: float) -> Answer:
    """Solve one trial in a process of its own, which may hang, end as it likes, or leave others behind."""
    with tempfile.TemporaryDirectory(prefix="matbench-check-") as folder:
        log = Path(folder) / "log.txt"
        line, theirs = Pipe()
        process = get_context("forkserver").Process(target=_watch, args=(theirs, timeout, method, files, trial, log))
        process.start()
        theirs.close()
        try:
            found: Answer = line.recv()
        except EOFError:
            found = Answer(error="the method ended the process that watches it")
        finally:
            line.close()
            process.join()
        said = log.read_bytes()[-2000:].decode("utf-8", "replace").strip() if log.exists() else ""
        return evolve(found, output=said)


def check(
    method: Method,
    files: Sequence[Path] = (),
    timeout: float = 120,
    listen: Callable[[int, int, str], None] | None = None,
) -> list[Finding]:
    """Try a method on all trials and judge its answers.

    Parameters
    ----------
    files
        The users' own files that hold methods.
    timeout
        Seconds that one solve may take; if the first one takes longer, nothing else is tried.
    listen
        Told how many trials are done, how many there are, and the name of the next.
    """
    entry = plugins.algorithm(method.algorithm, files).entry
    wanted, answers = trials(), {}
    module = [] if isinstance(entry, type) else [entry.module]
    with without_main(), kernels_kept():
        processes.start_server(["matbench.solving.method_check", *module])
        for done, (name, trial) in enumerate(wanted.items()):
            if listen is not None:
                listen(done, len(wanted), name)
            answers[name] = answer(method, files, trial, timeout)
            if answers["easy"].error.startswith("no answer within"):
                break
    untried = Answer(reason="not tried, as the first answer did not come")
    return judge({name: answers.get(name, untried) for name in wanted})


def judge(answers: Mapping[str, Answer]) -> list[Finding]:
    """What the answers to all trials say of a method."""
    return [
        _solved("answers", "whole maps of numbers, not all of them NaN", answers, ["easy"], needs_some=True),
        _solved("views", "two, three and five views", answers, ["two views", "three views", "easy"]),
        _solved("negative", "disparities of either sign", answers, ["either sign"], needs_some=True),
        _solved("tiny", "images of any size", answers, ["1x1 px", "one row", "one column", "narrower than the range"]),
        _solved("constant", "images without any texture", answers, ["constant"]),
        _in_range(answers),
        _honest(answers),
        _leaves_input(answers),
        _same("seed", "the same seed gives the same answer", answers, "easy again"),
        _same("threads", "any number of threads gives the same answer", answers, "easy, 3 threads"),
        _mirrored(answers),
        _quiet(answers),
    ]


def _solved(
    name: str, demand: str, answers: Mapping[str, Answer], which: Sequence[str], needs_some: bool = False
) -> Finding:
    wrong = {one: answers[one].error for one in which if answers[one].error}
    wrong |= {one: "NaN everywhere" for one in which if needs_some and _is_empty(answers[one])}
    declined = {one: answers[one].reason for one in which if answers[one].reason}
    verdict: Verdict = "fail" if wrong else "skipped" if declined else "pass"
    return Finding(name, demand, verdict, _listed(wrong or declined))


def _listed(reasons: Mapping[str, str]) -> str:
    """Trial -> reason, as a line in which each reason stands once."""
    found: dict[str, list[str]] = {}
    for trial, reason in reasons.items():
        found.setdefault(reason, []).append(trial)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in found.items())


def _is_empty(found: Answer) -> bool:
    return bool(found.maps) and all(np.isnan(values).all() for values in found.maps.values())


def _in_range(answers: Mapping[str, Answer]) -> Finding:
    demand = f"{ALIKE:.0%} of the answers lie in the range, in pixels per view step"
    wrong, parts = {}, {}
    for name in ("easy", "either sign"):
        parts[name] = answers[name]
        bounds = trials()[name].disparities
        answered = [values[~np.isnan(values)] for values in answers[name].maps.values()]
        found = np.concatenate(answered) if answered else np.empty(0, np.float32)
        beyond = (found < bounds.least - 1) | (found > bounds.largest + 1)
        if found.size and beyond.mean() > 1 - ALIKE:
            wrong[name] = f"{beyond.mean():.1%} beyond {bounds} by more than 1, {found.min():g} to {found.max():g}"
    return _seen("range", demand, parts, wrong)


def _honest(answers: Mapping[str, Answer]) -> Finding:
    demand = "no answer is NaN, never infinite"
    wrong = {name: "infinite" for name, found in answers.items() if found.infinite}
    return _seen("honest", demand, answers, wrong)


def _leaves_input(answers: Mapping[str, Answer]) -> Finding:
    demand = "the views are left as they were"
    wrong = {name: "changed" for name, found in answers.items() if found.touched}
    wrong |= {name: found.error for name, found in answers.items() if "read-only" in found.error}
    return _seen("input", demand, answers, wrong)


def _seen(name: str, demand: str, answers: Mapping[str, Answer], wrong: Mapping[str, str]) -> Finding:
    if not wrong and not any(found.maps for found in answers.values()):
        return Finding(name, demand, "skipped", "no answers to look at")
    return Finding(name, demand, "fail" if wrong else "pass", _listed(wrong))


def _pair(name: str, demand: str, answers: Mapping[str, Answer], a: str, b: str) -> Finding | tuple[Answer, Answer]:
    """Two answers to compare, or the finding that there are not two."""
    one, two = answers[a], answers[b]
    if one.maps and two.maps:
        return one, two
    if one.maps and two.error:
        return Finding(name, demand, "fail", f"{b}: {two.error}")
    return Finding(name, demand, "skipped", f"no answer to compare: {one.reason or one.error or two.reason}")


def _same(name: str, demand: str, answers: Mapping[str, Answer], other: str) -> Finding:
    pair = _pair(name, demand, answers, "easy", other)
    if isinstance(pair, Finding):
        return pair
    one, two = pair
    if one.digest == two.digest:
        return Finding(name, demand, "pass", "byte for byte")
    if one.maps.keys() != two.maps.keys():
        return Finding(name, demand, "fail", f"maps of the views {sorted(one.maps)}, then of {sorted(two.maps)}")
    shares = [np.mean(~_alike(one.maps[view], two.maps[view], 0)) for view in one.maps]
    what = (
        f"{max(shares):.2%} of a map's pixels differ" if max(shares) else "the maps are the same, volume or work differ"
    )
    return Finding(name, demand, "fail", what)


def _mirrored(answers: Mapping[str, Answer]) -> Finding:
    demand = f"in a mirror, {ALIKE:.0%} of the pixels are the same within half a plane"
    told = []
    for name in ("easy", "either sign"):
        pair = _pair("mirror", demand, answers, name, f"{name} mirrored")
        if isinstance(pair, Finding):
            told.append(pair)
            continue
        trial = trials()[name]
        last = len(trial.views) - 1
        # planes are a pixel of the field's pair apart
        same = _alike(pair[0].maps[trial.ref], pair[1].maps[last - trial.ref][:, ::-1], 0.5 / trial.pair_steps)
        told.append(Finding("mirror", demand, "pass" if same.mean() >= ALIKE else "fail", f"{name} {same.mean():.2%}"))
    verdicts = {finding.verdict for finding in told}
    verdict: Verdict = "fail" if "fail" in verdicts else "pass" if "pass" in verdicts else "skipped"
    return Finding("mirror", demand, verdict, "; ".join(dict.fromkeys(finding.reason for finding in told)))


def _alike(one: NDArray[np.float32], two: NDArray[np.float32], tolerance: float) -> NDArray[np.bool_]:
    return np.asarray((np.abs(one - two) <= tolerance) | (np.isnan(one) & np.isnan(two)))


def _quiet(answers: Mapping[str, Answer]) -> Finding:
    demand = "nothing is printed; what is goes to the cell's log"
    said = next((found.output for found in answers.values() if found.maps and found.output), "")
    return Finding("quiet", demand, "note" if said else "pass", f"prints {said.splitlines()[0][:60]!r}" if said else "")
