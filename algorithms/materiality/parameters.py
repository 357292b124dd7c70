"""The parameters of materiality alone, and which of them nothing reads beside the others."""

from collections.abc import Mapping
from typing import Literal, get_args

from attrs import field, frozen, validators

from matbench.algorithms.parameters import unread
from matbench.algorithms.similarity import Matching

Start = Literal["mean", "soft", "consensus"]
Count = Literal["row", "global"]
Target = Literal["image", "union"]
Optimiser = Literal["fixed_point", "gradient", "fista"]
Binarization = Literal["plane", "ray", "volume", "maps"]
Terms = Literal["squares", "linear"]
Confidence = Literal["materiality", "costs", "both"]


@frozen
class Solver:
    """Where the map starts, how it is solved for, and how disparities are taken from it. A group of parameters.

    Parameters
    ----------
    start
        ``mean``: mu = mean rho, as in the paper; ``soft``: exp(sharpness (mean rho - 1)),
        normalised along each ray and averaged over the views; ``consensus``: of the rays that
        reach a point, the share that ends there (`consensus`), by the maps of all views that the
        control infers.
    sharpness
        Of the ``soft`` start.
    optimiser
        ``fixed_point`` of visibility and materiality, ``gradient`` descent of E, or ``fista``
        (accelerated, with restarts when E rises). Where nothing couples epipolar planes (`counted` per
        row and `across` 0), each descends, restarts and stops on its own.
    passes
        At the fixed point, how often the maps of all views are inferred anew after the start; else sweeps over
        all target points. In either case at most.
    tolerance
        Stop when a pass lowers E by less than this share, or, at the fixed point, changes less than
        this share of the pixels by more than half a plane; 0 = never.
    binarization
        ``plane``: the N most material points of each epipolar plane, then the nearest on each ray
        (the paper; pixels may stay without an answer); ``ray``: argmax of mu V on each ray;
        ``volume``: semi-global over the whole map at once, with the cost of a point
        (sum V_ij (1 - rho_ij) + 0.25 hidden) / (sum V_ij + 0.25) + material (1 - mu), V_ij being the
        product of the visibilities of the pair's views other than the reference; at the fixed point
        the maps of the last pass are the answer; ``maps``, of a descent: rays of all views end where mu V is
        largest, and all maps are then inferred as by a pass of the fixed point.
    visibility
        At the fixed point, whether V says which pairs and rays count at a point. If not, whatever has it in its frustum
        does: costs are those of the start, from the better half of the similarities, and mu is the share of all rays
        through the point that end there.
    material
        Weight of mu in the cost of a point, wherever disparities are inferred semi-globally by it.
    confidence
        What says how sure an answer is. ``materiality``: the chance that the ray ends there, mu V over the planes
        within one of the answer; ``costs``: how far the cost of the answer lies below that of the next best plane
        (`peak_ratio`); or the product of ``both``. A descent of E, and a start that is not passed on, have only the
        first.
    """

    start: Start = field(default="consensus", validator=validators.in_(get_args(Start)))
    sharpness: float = field(default=30.0, validator=validators.gt(0))
    optimiser: Optimiser = field(default="fixed_point", validator=validators.in_(get_args(Optimiser)))
    passes: int = field(default=1, validator=validators.ge(0))
    tolerance: float = field(default=0.0, validator=validators.ge(0))
    binarization: Binarization = field(default="volume", validator=validators.in_(get_args(Binarization)))
    visibility: bool = True
    material: float = field(default=0.15, validator=validators.ge(0))
    confidence: Confidence = field(default="costs", validator=validators.in_(get_args(Confidence)))

    @property
    def descends(self) -> bool:
        """Whether it is the energy that is minimised."""
        return self.optimiser != "fixed_point"

    @property
    def infers(self) -> bool:
        """Whether maps of all views are inferred from costs on the way."""
        return self.start == "consensus" or (self.passes > 0 and not self.descends)


@frozen
class EnergyTerms:
    """What the energy is made of, besides its data. A group of parameters; the fixed point reads `target` at most.

    Parameters
    ----------
    form
        ``squares`` as in (6) and (8), or ``linear``, (16) and (17): the same where materialities are 0 or 1, but
        without reward for what lies between.
    count
        lambda of the count term (7).
    counted
        One count term for every epipolar plane (``row``) or one for the whole map (``global``).
    target
        N of one epipolar plane: the samples of an image row (``image``), or of the union of the
        frustums in the middle plane (``union``).
    across
        lambda_y: ties adjacent epipolar planes, the paper's future work; 0 leaves them apart.
    along
        lambda_x: ties neighbours of a row.
    edge
        Grey levels of difference over which those ties weaken to 1/e.
    """

    form: Terms = field(default="squares", validator=validators.in_(get_args(Terms)))
    count: float = field(default=0.3, validator=validators.ge(0))
    counted: Count = field(default="row", validator=validators.in_(get_args(Count)))
    target: Target = field(default="image", validator=validators.in_(get_args(Target)))
    across: float = field(default=10.0, validator=validators.ge(0))
    along: float = field(default=6.0, validator=validators.ge(0))
    edge: float = field(default=10.0, validator=validators.gt(0))


def silent(matching: Matching, solver: Solver, energy: EnergyTerms) -> Mapping[str, str]:
    """The parameters that nothing reads beside these -> what they take to be read.

    Inference is left out as far as the window decides (`Inference.silent`).
    """
    descends, some = solver.descends, solver.passes > 0
    infers = solver.infers or (descends and solver.binarization == "maps")
    by_volume, by_maps = (descends and solver.binarization == kind for kind in ("volume", "maps"))
    minimises = descends and some
    inference = "start=consensus or binarization=maps" if descends else "start=consensus or passes above 0"
    minimisation = "passes above 0" if descends else "optimiser=gradient or fista"
    ties = energy.across > 0 or energy.along > 0
    fewest = 3 if descends else 2  # a pass is compared with the one before, and the last need not be stopped
    takes = {
        "adaptive": (infers, inference),
        "mending": (infers, inference),
        "surfaces": (infers, inference),
        **dict.fromkeys(
            ("hidden", "small_step", "large_step", "contrast"),
            (infers or by_volume, f"{inference} or volume" if descends else inference),
        ),
        "sharpness": (solver.start == "soft", "start=soft"),
        "confidence": (
            infers and not descends,
            "optimiser=fixed_point" if descends else inference,
        ),
        "tolerance": (solver.passes >= fewest, f"passes above {fewest - 1}"),
        "visibility": (some and not descends, "optimiser=fixed_point" if descends else "passes above 0"),
        "binarization": (descends or solver.binarization != "maps", "optimiser=gradient or fista"),
        "material": (
            by_volume or by_maps if descends else some,
            "binarization=volume or maps" if descends else "passes above 0",
        ),
        "target": (
            solver.binarization == "plane" or (minimises and energy.count > 0),
            "binarization=plane, or optimiser=gradient or fista with count above 0",
        ),
        **dict.fromkeys(("form", "count", "counted", "across", "along", "edge"), (minimises, minimisation)),
    }
    if minimises:
        takes["counted"] = energy.count > 0 or energy.across == 0, "count above 0 or across=0"
        takes["edge"] = ties, "across or along above 0"
    found = unread(takes)
    colours = {"colour"} if minimises and ties else set()  # the edges that weaken the ties are those of the colours
    return {name: why for name, why in matching.silent.items() if name not in colours} | found
