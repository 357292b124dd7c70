"""What a method is given and what it returns: the one interface of the harness."""

from collections.abc import Mapping, Sequence
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.scene import Scene
from matbench.space import Volume


@frozen(eq=False)
class Estimate:
    """What a method returns.

    Parameters
    ----------
    disparity
        View index -> (H, W) float32, pixels per view step, NaN where the method has no answer.
        The reference view must be among them.
    volume
        Materialities or occupancies, if the method has them; visibilities follow from them.
    history
        Name -> one number per pass, such as energies.
    work
        Name -> exact count, the same on every machine: passes, point updates, ...
    seconds
        What the method took elsewhere, if it only brings answers that it found there, or None if nobody knows. By
        default it has worked here, and what counts is what is measured.
    confidence
        View index -> (H, W) float32 in [0, 1]: how sure the method is of its disparities, the higher the surer. Only
        the order within a map counts. NaN where it does not know. If there is any, the reference view is among them.
    device_seconds, device_mb
        What it took of a device, such as a graphics card, as the method says: seconds of work, and the most memory at
        once, MiB. Nobody else measures it; it is shown and not ranked. `seconds` is the wall time, as of any method.
    """

    disparity: Mapping[int, NDArray[np.float32]]
    volume: Volume | None = None
    history: Mapping[str, Sequence[float]] = field(factory=dict)
    work: Mapping[str, int] = field(factory=dict)
    seconds: float | Literal["measured"] | None = "measured"
    confidence: Mapping[int, NDArray[np.float32]] = field(factory=dict)
    device_seconds: float | None = None
    device_mb: float | None = None


class Probe:
    """What a method tells while it works. This one listens to nothing; a recording does.

    Ask `active` before preparing anything costly: recorded solves are never timed.
    """

    active: bool = False

    def volume(self, name: str, volume: Volume) -> None:
        """A volume worth looking at, such as ``similarity/0-1`` (pair of view indices)."""

    def iteration(
        self,
        step: int,
        energies: Mapping[str, float],
        volume: Volume | None = None,
        derivative: Volume | None = None,
        disparity: NDArray[np.float32] | None = None,
    ) -> None:
        """The state after pass `step`: energies, volume, dE/dmu and the reference view's map.

        `derivative` holds any real numbers, not only those in [0, 1].
        """


@frozen
class Context:
    """How to solve: everything that is neither the scene nor a parameter of the method.

    Parameters
    ----------
    seed
        For every random choice; the same seed must give the same estimate.
    threads
        How many threads to use; the estimate must not depend on it.
    probe
        Where to tell what happens.
    volume
        Whether the estimate's volume is looked at; a method that needs none itself may save it otherwise.
    """

    seed: int = 0
    threads: int = 1
    probe: Probe = field(factory=Probe)
    volume: bool = True


@runtime_checkable
class Algorithm(Protocol):
    """A method: an attrs class or dataclass whose fields are its parameters.

    A field whose type is an attrs class is a group: what is typed are that class's fields, by their own names.

    Optional besides `solve`:

    ``unsupported_reason(self, scene) -> str | None``
        Why this scene cannot be solved; its cell is then skipped, not failed.
    ``uneven: bool``
        Does it use ``scene.places``, so that views may lie at uneven steps? A method that does not say so is
        only given scenes whose views lie at even steps; the others are skipped.
    ``presets: ClassVar[Mapping[str, Mapping[str, object]]]``
        Named sets of parameters, chosen as ``name[preset=paper]``.
    ``by_default: ClassVar[bool]``
        Does a built-in method run where none is named? It does unless this is False.
    ``silent: Mapping[str, str]``
        The parameters that nothing reads beside the values of the others -> what they take to be read, such
        as ``{"sharpness": "start=soft"}``. One of them that is typed is refused in one line.
    ``reads: Sequence[Path]``
        Files besides its own code whose content decides its answers, such as a program or weights; folders, too.
        A parameter that is a path needs not be among them. (Its old name is ``code_files``.)
    ``reads_for(self, scene) -> Sequence[Path]``
        Further files, whose content decides the answer for this scene only, such as its ready-made map.
    """

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """Estimate the disparities of the scene's reference view, at least."""
        ...


def unsupported(method: Algorithm, scene: Scene) -> str:
    """Why a method says that it cannot solve a scene; empty if it does not say so."""
    if not scene.is_even and not getattr(method, "uneven", False):
        two = sorted((scene.ref, scene.ref + (1 if scene.ref + 1 < scene.n else -1)))
        some = "+".join(scene.labels[view] for view in two)
        return f"it takes views at even steps, and these lie at {scene.where}: views={some} chooses two of them"
    asked = getattr(method, "unsupported_reason", None)
    return str(asked(scene) or "") if asked else ""
