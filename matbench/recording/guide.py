"""The text panel of a recording: what its panels and colours mean."""

from matbench.measures.metrics import METRICS
from matbench.recording import coloring
from matbench.recording.blueprint import Contents
from matbench.recording.perspective import Perspective
from matbench.scene import Scene

MATERIAL = 0.25  # least materiality of a drawn voxel
ERROR_METRIC = next(metric for metric in METRICS if metric.name == "total_bad_1")  # of the maps of single passes


def guide(scene: Scene, rows: tuple[int, ...], contents: Contents) -> str:
    """The text, as Markdown.

    Parameters
    ----------
    rows
        The image rows whose epipolar planes are shown.
    """
    ends = coloring.disparity_ends(scene)
    seen = f"{scene.n} views of {scene.width}x{scene.height} px, reference view {scene.labels[scene.ref]}"
    offset = Perspective.of(scene).offset
    depth = "True perspective, up to scale."
    if offset:
        depth = f"What is at disparity 0 is infinitely far, so {offset:.3g} px were added to every disparity."
    return f"""# {contents.title}

{scene.name}: {seen}, disparities {scene.disparities} px per view step; {scene.pair_steps:g} view steps
make the pair in whose pixels errors are given.

- **Disparity**: {ends[0]:.4g} (dark blue, far) to {ends[1]:.4g} (yellow, near); striped: no answer, grey: truth
  unknown.
- **Error**: 0 (black) to {coloring.WORST:g} px of the pair and more (pale); striped: no answer, grey: truth unknown.
- **Epipolar slices** of row {", ".join(map(str, rows))}: yellow lines in the reference view. Columns are those of the
  leftmost view, beyond its frame too; disparity grows upward. Materiality: white is high. Derivative of the
  energy: red negative (materiality wants to grow), blue positive, black zero.{_channels(contents)}
- **Volumes** are reduced to every k-th row and column; move the slider to walk through the epipolar planes.
- **Surface**: depth is focal length times baseline over disparity. Neither is known: the focal length is drawn as
  the image's width, the nearest disparity at depth 1. {depth} Grey: planes of constant disparity. Coloured: the
  rays on which the views see one and the same point.
- **Disparity space**: columns of the leftmost view, rows, and planes of constant disparity. A pixel's ray is a
  straight line in it, and the rays of all views cross in the target points. Coloured outlines: what each view
  sees of the first row's epipolar plane. Voxels: materialities of at least {MATERIAL:g}, or the answer.
{_numbers(contents)}"""


def _channels(contents: Contents) -> str:
    """What red, green and blue mean in the slices of similarity and visibility."""
    said = ""
    for name in ("similarity", "visibility"):
        channels = next((s.channels[name] for s in contents.slices if name in s.channels), [])
        told = ", ".join(f"{color} {what}" for color, what in zip(("red", "green", "blue"), channels, strict=False))
        said += f"\n  {name.capitalize()}: {told}." if told else ""
    return said


def _numbers(contents: Contents) -> str:
    """Numbers that make no curve as the method told them once, and the error after the last pass."""
    lines = [f"- **{name}**, told once: {values[0]:.4g}" for name, values in contents.told.items() if len(values) == 1]
    if contents.error_rates:
        rates = ", ".join(f"{values[-1]:.2f} % in {region}" for region, values in contents.error_rates.items())
        lines.append(f"- **{ERROR_METRIC.name}** after the last recorded pass: {rates}; large maps are thinned first")
    return "\n".join(lines) + "\n"
