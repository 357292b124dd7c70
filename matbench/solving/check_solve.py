"""One solve of `matbench check`, in a process of its own (`matbench.solving.apart`)."""

import json
import os
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, unsupported
from matbench.errors import failure
from matbench.files.plain import NotPlain, open_plain
from matbench.files.temporary import temporary_folder
from matbench.measures.volumes import StoredVolume
from matbench.plans import limits
from matbench.plans.plan import Method, plugin_of
from matbench.solving import memory
from matbench.solving.apart import NoAnswer, call_apart
from matbench.solving.check_scenes import Trial
from matbench.solving.returned import checked_confidence, checked_maps

_FACTS = {"digest": str, "infinite": int, "touched": bool, "reason": str, "error": str}
_LAST = 2000  # bytes of what a method prints


@frozen(eq=False)
class Answer:
    """The result of one solve: maps, or the `reason` why the method declined, or an `error`.

    Parameters
    ----------
    maps
        View -> (H, W) float32, as the harness stores them; empty without an answer.
    digest
        SHA-256 of the estimate: maps, confidence, volume, history and work.
    infinite
        How many pixels of the maps were infinite; in `maps` these are NaN.
    touched
        Did the method write into the views?
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


@contextmanager
def _printing_to(path: Path) -> Iterator[None]:
    """Send everything that this process prints, from Python or from C, to a file."""
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


def solve_here(method: Method, files: Sequence[Path], trial: Trial, log: Path) -> Answer:
    """Solve one trial in this process; an exception of the method becomes the answer's `error`."""
    with _printing_to(log):
        try:
            instance = plugin_of(method, files).make(method.params)
            scene, before = trial.scene, trial.views.copy()
            if reason := unsupported(instance, scene):
                return Answer(reason=reason)
            estimate = instance.solve(scene, Context(threads=trial.threads))
            touched = not np.array_equal(scene.views, before)
            maps = checked_maps(estimate, scene)
            infinite = sum(int(np.isinf(values).sum()) for values in estimate.disparity.values())
            volume = b""
            if estimate.volume is not None:
                StoredVolume.of(estimate.volume)  # raises where it could not be kept
                volume = estimate.volume.values.tobytes()
            told = {name: [float(value) for value in values] for name, values in estimate.history.items()}
            work = {name: int(count) for name, count in estimate.work.items()}
            sure = checked_confidence(estimate, scene)
            parts = [values.tobytes() for found in (maps, sure) for _, values in sorted(found.items())]
            digest = sha256(
                b"|".join([*parts, volume, repr((sorted(maps), sorted(sure), told, work)).encode()])
            ).hexdigest()
            return Answer(maps, digest, infinite, touched)
        except BaseException as error:  # whatever a method raises, SystemExit included
            traceback.print_exc()
            return Answer(error=failure(error))


def _solve(method: Method, files: Sequence[Path], trial: Trial, log: Path) -> bytes:
    """Solve one trial in the new process, whose memory is limited and filled; what goes wrong before is told, too."""
    try:
        memory.confine(limits.room())
        memory.fill_fresh(trial.garbage)
    except Exception as error:
        return _packed(Answer(error=failure(error)))
    return _packed(solve_here(method, files, trial, log))


def _packed(answer: Answer) -> bytes:
    """An answer as an ``.npz``."""
    facts = {name: getattr(answer, name) for name in _FACTS}
    arrays: dict[str, Any] = {f"view_{view}": values for view, values in answer.maps.items()}
    content = BytesIO()
    np.savez(content, facts=np.array(json.dumps(facts)), **arrays)
    return content.getvalue()


def _unpacked(content: bytes) -> Answer:
    """The answer that `_packed` made. The method's process may have sent anything: nothing in it is executed."""
    try:
        with np.load(BytesIO(content), allow_pickle=False) as arrays:
            facts = json.loads(str(arrays["facts"]))
            maps = {int(name[len("view_") :]): arrays[name] for name in arrays.files if name != "facts"}
        kinds = {name: type(value) for name, value in facts.items()}
        if kinds != _FACTS or any(values.dtype != np.float32 for values in maps.values()):
            raise ValueError
    except Exception:  # whatever numpy, zipfile and json raise
        return Answer(error="the method sent something else than an answer")
    return Answer(maps, **facts)


def solve_apart(method: Method, files: Sequence[Path], trial: Trial, timeout: float) -> Answer:
    """Solve one trial in a process of its own, which may hang, crash, or leave others behind.

    Parameters
    ----------
    files
        The users' own files with methods.
    timeout
        Seconds that the solve may take.
    """
    with temporary_folder() as folder:
        log = folder / "log.txt"
        try:
            found = _unpacked(call_apart(_solve, (method, files, trial, log), timeout))
        except NoAnswer as error:
            found = Answer(error=str(error))
        return evolve(found, output=_end_of(log))


def _end_of(log: Path) -> str:
    """What a process has printed last; nothing where something else than its plain file lies there by now."""
    with suppress(OSError, NotPlain), open_plain(log, follow=False) as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - _LAST))
        return file.read(_LAST).decode("utf-8", "replace").strip()
    return ""
