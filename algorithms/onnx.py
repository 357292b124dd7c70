"""Networks for two views in the ONNX format, run by onnxruntime."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from math import floor, prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench import safe_text
from matbench.algorithm import Context, Estimate
from matbench.algorithms.model_input import CHANNELS, Fit, Frame, Picture, median_of_views
from matbench.algorithms.sgbm import field_partner
from matbench.errors import UserError, one_line
from matbench.files.images import LARGEST
from matbench.files.onnx_file import Model, Port, read_model
from matbench.parameters import flat
from matbench.scene import Scene

if TYPE_CHECKING:
    from onnxruntime import InferenceSession

INSTALL = "pip install 'matbench-stereo[onnx]'"
Views = Literal["pair", "all"]
Layout = Literal["auto", "nchw", "nhwc"]
Device = Literal["cpu", "cuda"]
_KINDS: Mapping[int, Any] = {1: np.float32, 2: np.uint8, 10: np.float16, 11: np.float64}  # the numbers are ONNX's
_PROVIDERS = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider"}
_MOST_CHANNELS = 8  # of an output: a side that is longer is one of the picture


def _installed(_: object, __: Any, model: Path) -> None:
    if find_spec("onnxruntime") is None:
        raise ValueError(f"model={model} takes onnxruntime, which is not installed: {INSTALL}")


@frozen
class Slot:
    """Where images go in a model.

    Parameters
    ----------
    names
        The inputs for the left and the right image; one that takes both.
    sides
        (height, width) that they take, None where any does.
    channels_last
        Are they (batch, height, width, channels)?
    joined
        Along which axis one input takes both images, counted as (batch, channels): 0, 1, or None for two inputs.
    kind
        Type of the numbers.
    """

    names: tuple[str, ...]
    sides: tuple[int | None, int | None]
    channels_last: bool
    joined: int | None
    kind: Any

    def fill(self, left: NDArray[np.float32], right: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
        """What the model is given for two (channels, height, width) images."""
        both = [left[None], right[None]]
        if self.joined is not None:
            both = [np.concatenate(both, axis=self.joined)]
        if self.channels_last:
            both = [np.moveaxis(image, 1, 3) for image in both]
        return {name: np.ascontiguousarray(image, self.kind) for name, image in zip(self.names, both, strict=True)}


def slot_of(model: Model, left: str, right: str, channels: int, layout: Layout) -> Slot:
    """Which inputs of a model take the images, and how.

    Raises
    ------
    UserError
        If that cannot be told, with the model's inputs in words.
    """
    listed = f"its inputs are {', '.join(map(str, model.inputs[:8])) or 'none'}"
    by_name = {port.name: port for port in model.inputs}
    if left or right:
        if missing := [name for name in (left, right) if name not in by_name]:
            raise UserError(f"it has no input {missing[0]!r}; {listed}" if missing[0] else f"name both; {listed}")
        chosen = [by_name[left], by_name[right]]
        if len(by_name) != len({left, right}):
            raise UserError(f"it takes more than two images; {listed}")
    elif len(model.inputs) in (1, 2):
        chosen = sorted(model.inputs, key=lambda port: "right" in port.name.lower())  # else in their own order
    else:
        raise UserError(f"it takes {len(model.inputs)} inputs, not one or two; {listed}")
    first = chosen[0]
    if first.kind not in _KINDS or any(port.kind != first.kind for port in chosen):
        raise UserError(f"its inputs are no numbers of one known type (ONNX's {first.kind}); {listed}")
    shapes = {port.sides or (None,) * 4 for port in chosen}
    if any(len(shape) != 4 for shape in shapes) or len(shapes) != 1:
        raise UserError(f"both images must have four sides, such as 1x3xHxW, and the same ones; {listed}")
    (shape,) = shapes
    many = channels * (2 if len(chosen) == 1 else 1)
    last = layout == "nhwc" or (layout == "auto" and shape[1] not in (channels, many) and shape[3] in (channels, many))
    batch, deep, *sides = (shape[0], shape[3], shape[1], shape[2]) if last else shape
    joined = None if len(chosen) == 2 else 0 if batch == 2 or deep == channels else 1
    wanted = (2 if joined == 0 else 1), (many if joined == 1 else channels)
    if batch not in (None, wanted[0]) or deep not in (None, wanted[1]):
        colours = " or ".join(name for name, number in CHANNELS.items() if number * (many // channels) == deep)
        hint = f": colours={colours.split()[0]}" if colours and batch in (None, 1) else ""
        raise UserError(f"images of {channels} channels do not fit{hint}; {listed}")
    if prod(side or 1 for side in sides) > LARGEST:
        raise UserError(f"it takes more pixels than {LARGEST}; {listed}")
    return Slot(tuple(port.name for port in chosen), (sides[0], sides[1]), last, joined, _KINDS[first.kind])


def plane_of(values: Any, frame: tuple[int, int]) -> NDArray[np.float32] | None:
    """(height, width) the map in an output, of several channels the first; None if it is no map of the frame."""
    found = np.asarray(values)
    if found.dtype.kind not in "fiu":
        return None
    while found.ndim > 2 and found.shape[0] == 1:
        found = found[0]
    if found.ndim == 4 and found.shape[0] == 2:  # of a batch of both images, the left one's
        found = found[0]
    if found.ndim == 3 and found.shape[1:] == frame and found.shape[0] <= _MOST_CHANNELS:
        found = found[0]
    elif found.ndim == 3 and found.shape[:2] == frame and found.shape[2] <= _MOST_CHANNELS:
        found = found[:, :, 0]
    return found.astype(np.float32) if found.shape == frame else None


@lru_cache(maxsize=1)
def _session(path: str, state: tuple[int, int], threads: int, device: Device) -> "InferenceSession":  # noqa: ARG001
    """A loaded model: kept, so that a process that solves several cells loads it once."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4  # what is wrong is told by our own error
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    if _PROVIDERS[device] not in onnxruntime.get_available_providers():
        raise UserError(f"device={device}: onnxruntime has no {_PROVIDERS[device]} here: pip install onnxruntime-gpu")
    return onnxruntime.InferenceSession(path, options, providers=[_PROVIDERS[device]])


@flat
@frozen
class Onnx:
    """A network for two views, from an ONNX file of yours.

    It is given the two images that `sgbm` matches, or with `views=all` the reference view and each other one. Both are
    mirrored where the other view is to the left. If disparities below 0 are to be found, the images are padded on
    opposite sides so that they begin at 0. The answer of each pair is divided by its view steps; of several, the
    median over the views counts, each weighted by its view steps. Answers are kept within the scene's range.

    What the model takes is read from the file: two inputs, or one for both images, one after the other along the
    channels or as a batch; any size, or a fixed one. The model's content decides the answer, and so do files beside it
    that hold its weights. Of those, none may lie outside its folder.

    Where a size is fixed, images are resized to it, or padded (`fit`), and disparities are scaled back. Otherwise edge
    pixels are repeated at the right and at the bottom up to a multiple of `pad`.

    Parameters
    ----------
    model
        The file.
    views
        The field's ``pair``, or ``all`` pairs with the reference view.
    left, right
        Names of the inputs, if they are not in this order or not named so.
    output
        Name of the output, if several could be the map.
    sign
        -1 if the network gives what is nearer the smaller number, such as the flow to the right image.
    pad
        Pixels. Sides become multiples of it, where the model takes any size.
    fit
        Where the model takes one size only: ``resize`` the images to it, or ``pad`` them.
    layout
        Order of the sides where the model does not tell: ``nchw`` or ``nhwc``.
    device
        ``cuda`` for a graphics card, which takes the package onnxruntime-gpu.
    """

    uneven: ClassVar[bool] = True
    by_default: ClassVar[bool] = False
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "imagenet": {"scale": 1.0, "mean": "0.485/0.456/0.406", "std": "0.229/0.224/0.225"},
    }

    model: Path = field(validator=_installed)
    views: Views = field(default="pair", validator=validators.in_(get_args(Views)))
    left: str = ""
    right: str = ""
    output: str = ""
    sign: int = field(default=1, validator=validators.in_((1, -1)))
    picture: Picture = field(factory=Picture)
    pad: int = field(default=32, validator=[validators.ge(1), validators.le(1024)])
    fit: Fit = field(default="resize", validator=validators.in_(get_args(Fit)))
    layout: Layout = field(default="auto", validator=validators.in_(get_args(Layout)))
    device: Device = field(default="cpu", validator=validators.in_(get_args(Device)))

    _slot: Slot = field(init=False, eq=False, repr=False)
    _beside: tuple[Path, ...] = field(init=False, eq=False, repr=False)

    def __attrs_post_init__(self) -> None:
        found = read_model(self.model)
        try:
            slot = slot_of(found, self.left, self.right, CHANNELS[self.picture.colours], self.layout)
        except UserError as error:
            raise UserError(f"model {self.model}: {error}") from None
        if self.output and self.output not in [port.name for port in found.outputs]:
            raise UserError(f"model {self.model} has no output {self.output!r}; {_listed(found.outputs)}")
        object.__setattr__(self, "_slot", slot)
        object.__setattr__(self, "_beside", tuple(self.model.parent / path for path in found.beside))

    @property
    def reads(self) -> Sequence[Path]:
        """The files beside the model that hold its weights."""
        return self._beside

    @property
    def silent(self) -> Mapping[str, str]:
        """The parameters that are not read beside the others -> what they take to be read."""
        fixed = [side is not None for side in self._slot.sides]
        return {
            **({"pad": "a model that takes any size"} if all(fixed) else {}),
            **({"fit": "a model that takes one size only"} if not any(fixed) else {}),
        }

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The map of the reference view.

        Raises
        ------
        UserError
            If onnxruntime cannot load the model, or cannot run it on these images, or none of its outputs, or more than
            one, is a map.
        """
        others = [field_partner(scene)] if self.views == "pair" else [j for j in range(scene.n) if j != scene.ref]
        maps = [self._of_pair(scene, other, context.threads) for other in others]
        found = median_of_views(maps, [abs(scene.steps(other)) for other in others])
        least, largest = scene.disparities.least, scene.disparities.largest
        return Estimate({scene.ref: np.clip(found, least, largest)}, work={"pairs": len(others)})

    def _of_pair(self, scene: Scene, other: int, threads: int) -> NDArray[np.float32]:
        """(H, W) disparities in pixels per view step, from two views."""
        gap, flip = abs(scene.steps(other)), -1 if other < scene.ref else 1
        before = max(0, -floor(scene.disparities.least * gap))
        images = [scene.views[view][:, ::flip] for view in (scene.ref, other)]
        sides = ((before, 0), (0, before))
        left, right = (np.pad(i, ((0, 0), side, (0, 0)), "edge") for i, side in zip(images, sides, strict=True))
        pair = self._run(left, right, threads)[:, before:] - np.float32(before)
        pair[~np.isfinite(pair)] = np.nan
        return np.ascontiguousarray(pair[:, ::flip] / np.float32(gap))

    def _run(self, left: NDArray[np.uint8], right: NDArray[np.uint8], threads: int) -> NDArray[np.float32]:
        """(H, W) disparities of the left image in pixels, nearer is larger."""
        size = left.shape[0], left.shape[1]
        try:
            frame = Frame.of(size, self._slot.sides, self.pad, self.fit)
        except ValueError as error:
            raise UserError(f"model {self.model}: {error}") from None
        given = self._slot.fill(*(frame.put(self.picture.channels(image)) for image in (left, right)))
        try:
            state = self.model.stat()
            session = _session(str(self.model.absolute()), (state.st_mtime_ns, state.st_size), threads, self.device)
            names = [self.output] if self.output else [port.name for port in session.get_outputs()]
            values = session.run(names, given)
        except UserError:
            raise
        except Exception as error:  # whatever onnxruntime raises
            shown = f"{frame.frame[1]}x{frame.frame[0]} px"
            raise UserError(f"model {self.model} cannot be run on images of {shown}: {one_line(error)}") from None
        maps = {n: plane for n, v in zip(names, values, strict=True) if (plane := plane_of(v, frame.frame)) is not None}
        if len(maps) != 1:
            shapes = ", ".join(f"{n} ({'x'.join(map(str, np.shape(v)))})" for n, v in zip(names, values, strict=True))
            many = f"{len(maps)} outputs could be the map" if maps else "no output is a map"
            hint = "choose one by output=NAME: " if maps else ""
            wanted = f"{frame.frame[1]}x{frame.frame[0]} px"
            raise UserError(f"model {self.model}: {many} of {wanted}; {hint}{safe_text.one_line(shapes)}")
        (found,) = maps.values()
        return frame.take(found * np.float32(self.sign))


def _listed(outputs: Sequence[Port]) -> str:
    return f"its outputs are {', '.join(map(str, outputs[:8])) or 'none'}"
