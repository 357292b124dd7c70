"""The inside of a keeper: a process that runs no method itself but watches the process that does.

For each cell it has the scene read by a process that does nothing else, and forks a child that gets the
scene's views only and runs the method. So truth was never in the memory of a process that runs a method. The keeper
stores what the child prints, and measures its time and memory. A child that exceeds a limit is killed with all that
it has started. The child writes its answer into a folder of its own; the keeper checks that and takes it in. The
keeper owns the cell's folder, so log and outcome are written whatever the method does.

A keeper is connected to the run by a pipe, its line. When the other end of the line closes, even because
the run was killed, the keeper kills everything below it and ends. So nothing outlives a run.
"""

import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from errno import ENOTDIR, ENOTEMPTY
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from attrs import define, evolve, field

from matbench.errors import UserError, one_line
from matbench.files.removal import remove
from matbench.files.temporary import temporary_folder
from matbench.plans import plugins
from matbench.plans.plan import Cell
from matbench.runs.cell_files import CONFIDENCE, maps_digest, write_cell
from matbench.runs.outcome import FINAL, Outcome
from matbench.runs.store import Store
from matbench.scenes import views_only
from matbench.solving import confinement, errand, intake, memory, processes
from matbench.solving.child import Child, Log
from matbench.solving.control_group import ControlGroup
from matbench.solving.ending import how_it_ended, print_stack
from matbench.solving.stopwatch import Stopwatch
from matbench.solving.worker import MAPS, TOLD, VOLUME, Job, Order

_TICK = 0.05  # seconds between two looks at a process
_TREE_LOOKS = 10  # every tenth look includes the processes that it started: these take longer to find and to measure
_MOST_WORDS = 1 << 12  # bytes of what is said to the run


class Dismissed(Exception):
    """Nobody holds the other end of the keeper's line any more."""


@define
class Keeping:
    """The inside of a keeper: its line, the process that runs methods, and the scene at hand.

    Parameters
    ----------
    place
        A folder of its own, for scenes and answers.
    places
        What removes it at the end, and those that were there before.
    scene
        What the views that lie in `views` are of, the scene's name and its digest, and what the file is known by.
    group
        Counts the memory of the child and of all that it starts, where the system lets this user make one.
    shared
        Files in shared memory that the child has been seen with, where it has no shared memory of its own.
    """

    inbox: Connection
    place: Path
    places: ExitStack
    is_confining: bool
    group: ControlGroup | None
    child: Child | None = None
    scene: tuple[str, str, tuple[int, ...]] | None = None
    shared: set[Path] = field(factory=set)

    @property
    def views(self) -> Path:
        return self.place / "views.npz"

    @property
    def answer(self) -> Path:
        return self.place / "answer"

    def cell(self, job: Job) -> None:
        """Solve a cell; the child stays if it is to solve the next one, too."""
        if self.child is not None and not self.child.suits(job):
            self.end_child()
        limit = job.settings.timeout
        end = None if limit is None else time.monotonic() + limit
        with Store(job.run).building(job.cell) as draft:
            failed = self._read_scene(job, end)
            if failed is not None:
                write_cell(draft, job.cell, evolve(failed, threads=job.threads, alone=job.alone))
                return
            if self.child is not None and self._attempt(job, draft, end):
                return
            # earlier cells may have spoiled a shared process: this cell gets a second chance in a fresh one.
            # Not after a timeout: the cell would take the whole time again.
            plugins.read_ahead(job.cell.method.algorithm, [*job.plugin_files, *filter(None, [job.cell.method.file])])
            self.child = Child.fork(job, self.inbox, self.is_confining)
            if self.group is not None:
                self.group.take(self.child.pid)
            self._attempt(job, draft, end)

    def _read_scene(self, job: Job, end: float | None) -> Outcome | None:
        """Have the scene's views written, unless they lie there; what the cell comes to where they cannot be."""
        wanted = job.cell.scene, job.cell.scene_digest
        if self.scene == (*wanted, _known_by(self.views)):
            return None
        self.scene = None
        if not _is_folder(self.place):  # a method has the right to remove it, or to put something else there
            self.place = self.places.enter_context(temporary_folder())
        remove(self.views)
        if job.views is not None and _copied(*job.views, self.views, job.cell):
            self.scene = (*wanted, _known_by(self.views))
            return None
        name, data, views, files = job.cell.scene, job.settings.data, self.views, job.plugin_files

        def read() -> None:
            from matbench.scenes.catalogue import load_scene

            scene = load_scene(name, data, files)
            if scene.digest != wanted[1]:
                raise UserError(f"{name} is not what it was when the run was planned")
            views_only.write_views(scene, views)

        try:
            said = self._errand(read, end)
        except errand.Late:
            return Outcome("timeout", reason=f"stopped after {job.settings.timeout:g} s")
        if said:
            return Outcome("failed", reason=said)
        self.scene = (*wanted, _known_by(self.views))
        return None

    def _attempt(self, job: Job, draft: Path, end: float | None) -> bool:
        """Fill a cell's folder by what the child answers; whether that settles the cell.

        A child that is not fit for another cell is ended, with all that it started.
        """
        assert self.child is not None, "the caller has seen to that"  # noqa: S101
        log, watch, stays = Log(self.child.output), Stopwatch(self.child.pid), False
        remove(self.answer)
        self.answer.mkdir()
        try:
            outcome = self._watch(self.child, job, end, log, watch)
            stays = outcome is None and self.child.is_fit and job.settings.isolation == "shared"
        finally:
            # first kill, then drain, then close: else output is lost, or the child still prints into a closed pipe
            if not stays:
                processes.kill_descendants()
            log.drain()
            if not stays:
                self.end_child()
        _empty(draft)  # where it was within reach, the method may have put anything there
        if outcome is None:
            outcome = self._taken(job, draft, watch, end)
        if outcome.status != "ok":
            _empty(draft)
        ran_on = {"run folder": "read-only for methods" if self.is_confining else "within reach of methods"}
        outcome = evolve(outcome, threads=job.threads, alone=job.alone, ran_on=ran_on)
        write_cell(draft, job.cell, outcome, log=log.whole())
        return stays or outcome.status in FINAL or outcome.status == "timeout"

    def _watch(self, child: Child, job: Job, end: float | None, log: Log, watch: Stopwatch) -> Outcome | None:
        """Wait until the child has answered: None, or what the cell comes to without an answer.

        Raises
        ------
        Dismissed
            If the line ends meanwhile.
        OSError
            If the child could not write its answer.
        """
        limit, kills = job.settings.memory_each(), memory.kills_for_memory()
        sources: list[Any] = [self.inbox, child.output, child.line]
        watch.begin_warm_up()
        with suppress(OSError):  # it has ended already: seen below
            child.line.send(Order(job, self.views, self.answer))
        looks, next_look = 0, time.monotonic()
        while True:
            ready = wait(sources, _TICK)
            if self.inbox in ready:  # no second job comes before the answer: it can only be the end
                raise Dismissed
            if child.output in ready and not log.take():
                sources.remove(child.output)  # a closed pipe is always ready, and `wait` would not wait any more
            if child.line in ready:
                try:
                    if _heard(child, watch):
                        return None
                except EOFError:
                    sources.remove(child.line)
                except ValueError:
                    return Outcome(
                        "crashed", reason="the method wrote into a file of the harness that it had not opened"
                    )
            if child.pid in (ended := processes.reap()):
                log.drain()
                return how_it_ended(ended[child.pid], log, kills)
            now = time.monotonic()
            if end is not None and now > end:
                print_stack(child, log)
                return Outcome("timeout", reason=f"stopped after {job.settings.timeout:g} s")
            if now < next_look:
                continue
            # a method that prints all the time wakes `wait` at once; its memory is still read every _TICK only
            looks, next_look = looks + 1, now + _TICK
            used = memory.used(child.pid, whole_tree=looks % _TREE_LOOKS == 0)
            if self.group is not None:
                used = max(used, self.group.used() or 0.0)
            if not self.is_confining and looks % _TREE_LOOKS == 0:
                self.shared |= memory.left_in_shared_memory(child.pid)
            watch.take_memory(used)
            if used > limit:
                print_stack(child, log)
                return Outcome("out-of-memory", reason=f"stopped: it held {used:.0f} MiB, {limit} MiB are its limit")

    def _taken(self, job: Job, draft: Path, watch: Stopwatch, end: float | None) -> Outcome:
        """Check what the child has left and take it in; what the cell comes to."""
        try:
            outcome = intake.outcome(self.answer)
            if outcome.status != "ok":
                return outcome
            if not intake.take(self.answer / MAPS, draft / MAPS):
                raise ValueError("it has left no maps")
            if self.scene is None or self.scene[2] != _known_by(self.views):
                raise ValueError("the views of its scene were changed")
            scene = views_only.read_views(self.views)
            maps = intake.maps(draft / MAPS, scene)
            intake.take(self.answer / VOLUME, draft / VOLUME)
            sure = ""
            if intake.take(self.answer / CONFIDENCE, draft / CONFIDENCE):
                sure = maps_digest(intake.confidence(draft / CONFIDENCE, scene))
            outcome = watch.timed(evolve(outcome, maps=maps_digest(maps), confidence=sure), job.threads)
            if job.settings.record is not None and not job.cell.repeat and not outcome.reason:
                outcome = self._record(job, draft, outcome, scene.height, end)
        except errand.Late:
            return Outcome("timeout", reason=f"stopped after {job.settings.timeout:g} s")
        except (OSError, Dismissed):
            raise
        except Exception as error:  # whatever can be raised for a file that may hold anything
            return Outcome("failed", reason=f"its answer cannot be used: {one_line(error)}")
        return outcome

    def _record(self, job: Job, draft: Path, outcome: Outcome, height: int, end: float | None) -> Outcome:
        """Have a recording made of what the method told; the outcome with what was recorded, or why nothing was."""
        assert job.settings.record is not None, "the caller has looked"  # noqa: S101
        heard, name, data, files = self.place / TOLD, job.cell.scene, job.settings.data, job.plugin_files
        remove(heard)
        if not intake.take(self.answer / TOLD, heard):
            return evolve(outcome, reason="not recorded: it has told nothing")

        def record() -> None:
            from matbench.recording import rrd, told
            from matbench.scenes.catalogue import load_scene

            scene = load_scene(name, data, files)
            rrd.record_told(draft / "recording.rrd", scene, told.read_told(heard), title=str(job.cell))

        said = self._errand(record, end)
        remove(heard)
        if said:
            return evolve(outcome, reason=f"not recorded: {said}")
        return evolve(outcome, recorded=job.settings.record.at(height))

    def _errand(self, work: Callable[[], None], end: float | None) -> str:
        try:
            return errand.run(work, self.inbox, end)
        except EOFError as error:
            raise Dismissed from error

    def end_child(self) -> None:
        """End the process that runs methods, and all that it has started."""
        if self.child is not None:
            processes.kill_descendants()
            self.child.close()
            self.child = None
        for left in self.shared:
            with suppress(OSError):
                left.unlink()
        self.shared.clear()


def keep(inbox: Connection) -> None:
    """The keeper's process: solve the jobs that come in, one by one, until the line ends.

    It sends "" after each cell, or why the cell could not be solved or stored.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # through `finally`: the child goes, too
    processes.lead_own_session()  # Ctrl-C is for the run, which then dismisses its keepers
    with ExitStack() as places:
        place = places.enter_context(temporary_folder())
        keeping = Keeping(inbox, place, places, confinement.is_possible(), ControlGroup.make())
        try:
            while True:
                job = inbox.recv()
                try:
                    keeping.cell(job)
                    said = ""
                except (OSError, ValueError) as error:  # the disk is full, say
                    keeping.end_child()
                    said = str(error)
                inbox.send_bytes(said.encode("utf-8", "replace")[:_MOST_WORDS])
        except (EOFError, BrokenPipeError, ConnectionResetError, Dismissed):
            pass
        finally:
            processes.kill_descendants()
            if keeping.group is not None:
                keeping.group.remove()


def _heard(child: Child, watch: Stopwatch) -> bool:
    """Take in what a child says; whether it has answered.

    Raises
    ------
    EOFError
        If nothing more can come.
    ValueError
        If it says what it does not say by itself.
    OSError
        If it could not write its answer.
    """
    try:
        messages = child.messages()
    except OSError as error:
        raise EOFError from error
    for message in messages:
        if message.word == "lost":
            raise OSError(message.reason)
        if message.word == "done":
            child.is_fit = message.is_fit
            return True
        watch.take(message.word)
        with suppress(OSError):
            child.line.send_bytes(b"")
    return False


def _empty(draft: Path) -> None:
    """Remove all that lies in a cell's draft.

    Raises
    ------
    OSError
        If the draft is no folder any more, or something cannot be removed: then nothing is written there.
    """
    if not _is_folder(draft):
        raise NotADirectoryError(ENOTDIR, "a method has replaced the folder", str(draft))
    for half in draft.iterdir():
        remove(half)
    if any(draft.iterdir()):
        raise OSError(ENOTEMPTY, "what a method has put there cannot be removed", str(draft))


def _is_folder(path: Path) -> bool:
    """Is it a folder, and no link to one?"""
    return path.is_dir() and not path.is_symlink()


def _copied(ready: Path, size: int, views: Path, cell: Cell) -> bool:
    """Copy a file of views; whether it is there now, and holds the cell's scene: methods may reach what lies ready."""
    try:
        with ready.open("rb") as file:
            if file.seek(0, os.SEEK_END) != size:
                return False
            file.seek(0)
            views.write_bytes(file.read(size))
        scene = views_only.read_views(views)
        return (scene.name, scene.digest) == (cell.scene, cell.scene_digest)
    except Exception:  # whatever a method has put there: the scene is read anew
        return False


def _known_by(path: Path) -> tuple[int, ...]:
    """What a file is known by: a method that writes into it, or puts another there, changes that."""
    with suppress(OSError):
        facts = path.lstat()
        return facts.st_mode, facts.st_dev, facts.st_ino, facts.st_size, facts.st_ctime_ns
    return ()
