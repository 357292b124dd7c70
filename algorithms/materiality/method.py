"""The materiality map: parameters, and the way from a scene to an estimate."""

from collections.abc import Mapping
from typing import ClassVar, Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate
from matbench.algorithms.fusion import seen_from
from matbench.algorithms.materiality.binarize import by_plane, by_ray, seen_rays, visible_cost
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.materiality.edges import edge_weights
from matbench.algorithms.materiality.passes import Energy
from matbench.algorithms.materiality.start import start
from matbench.algorithms.semiglobal import SemiGlobal
from matbench.algorithms.similarity import FULL, Matcher, Matching
from matbench.scene import Scene
from matbench.space import Volume

Start = Literal["mean", "soft", "consensus"]
Count = Literal["row", "global"]
Target = Literal["image", "union"]
Optimiser = Literal["gradient", "fista"]
Binarization = Literal["plane", "ray", "volume"]


@frozen
class Materiality(Matching, SemiGlobal):
    """The materiality map (paper; SPEC 1-4): a fuzzy map mu of surface points over disparity space.

    It minimises E = E_data + E_smooth (5) over mu in [0, 1], with

    - visibility V_i(s) = Fr_i(s) * product of (1 - mu(t)) over the nearer points t on the ray (3),
    - E_data = sum over s and pairs (i, j) of (rho_ij(s) - mu(s) V_i(s) V_j(s))^2 (6),
    - E_smooth = count / N (sum mu - N)^2 (7) + across sum w (mu(y + 1) - mu(y))^2
      + along sum w (mu(x + 1) - mu(x))^2 (SPEC 4), edge weights w = exp(-|dI| / edge),

    by projected gradient with the exact derivative of SPEC 2, and reads the map in the reference view.
    Parameters of similarity and reader are those of `Matching` and `SemiGlobal`.

    Parameters
    ----------
    start
        ``mean``: mu = mean rho, as in the paper; ``soft``: exp(sharpness (mean rho - 1)),
        normalised along each ray and averaged over the views; ``consensus`` (SPEC 8): every view is
        read as the control reads the reference, w_i = exp(-sharpness (mean path cost)) normalised
        along its rays says where they end, V_i(d) = 1 - sum of w_i more than a plane nearer what
        they reach, and mu = (sum w_i + 0.025) / (sum V_i + 0.25).
    sharpness
        Of the start.
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
    optimiser
        ``gradient``, or ``fista`` (accelerated, with restarts when E rises).
    passes
        Sweeps over all target points, at most.
    tolerance
        Stop when a pass lowers E by less than this share; 0 = never.
    binarization
        ``plane``: the N most material points of each epipolar plane, then the nearest on each ray
        (the paper; pixels may stay without an answer); ``ray``: argmax of mu V on each ray;
        ``volume``: semi-global over the whole map at once, with the cost of a point
        (sum V_ij (1 - rho_ij) + 0.25 hidden) / (sum V_ij + 0.25) + material (1 - mu), V_ij being the
        product of the visibilities of the pair's views other than the reference.
    hidden
        The cost of a point that no pair sees.
    material
        Weight of mu in the choice of planes; the fraction of a plane is fitted without it.
    """

    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "paper": {
            "views": 4,
            "fineness": 1,
            "pairs": "consecutive",
            "similarity": "ssd",
            "window": 5,
            "sigma": 16.0,
            "truncation": 0.0,
            "start": "mean",
            "count": 0.3,
            "counted": "global",
            "target": "image",
            "across": 0.0,
            "along": 0.0,
            "optimiser": "gradient",
            "passes": 50,
            "binarization": "plane",
        }
    }

    start: Start = field(default="consensus", validator=validators.in_(get_args(Start)))
    sharpness: float = field(default=30.0, validator=validators.gt(0))
    count: float = field(default=0.3, validator=validators.ge(0))
    counted: Count = field(default="row", validator=validators.in_(get_args(Count)))
    target: Target = field(default="image", validator=validators.in_(get_args(Target)))
    across: float = field(default=10.0, validator=validators.ge(0))
    along: float = field(default=6.0, validator=validators.ge(0))
    edge: float = field(default=10.0, validator=validators.gt(0))
    optimiser: Optimiser = field(default="fista", validator=validators.in_(get_args(Optimiser)))
    passes: int = field(default=5, validator=validators.ge(0))
    tolerance: float = field(default=0.0, validator=validators.ge(0))
    binarization: Binarization = field(default="volume", validator=validators.in_(get_args(Binarization)))
    hidden: float = field(default=0.7, validator=validators.ge(0))
    material: float = field(default=0.25, validator=validators.ge(0))

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map, the materialities, and the energies of every pass."""
        matcher, threads, probe = Matcher.of(scene, self), context.threads, context.probe
        space = matcher.space
        rho = matcher.all(threads)
        if probe.active:
            for p, (i, j) in enumerate(matcher.pairs):
                values = rho[:, p].astype(np.float32) / np.float32(FULL)
                probe.volume(
                    f"similarity/{matcher.indices[i]}-{matcher.indices[j]}", Volume(space, values, matcher.indices)
                )
        energy = self._energy(matcher, rho, threads)
        compared = matcher.comparisons
        if self.start == "consensus":
            compared += sum(seen_from(matcher, view).ray_comparisons for view in range(space.views))
            mu = consensus(matcher, self, self.sharpness, threads)
        else:
            mu = start(matcher, rho, self.start == "soft", self.sharpness, threads)

        def tell(step: int, energies: dict[str, float], now: NDArray[np.float32], slopes: NDArray[np.float32]) -> None:
            probe.iteration(
                step,
                {name: value for name, value in energies.items() if name != "restart"},
                volume=Volume(space, now, matcher.indices),
                derivative=Volume(space, slopes.copy(), matcher.indices),
                disparity=self._disparity(matcher, now, rho, threads),
            )

        descent = Descent(self.passes, self.optimiser == "fista", energy.safe_step, self.tolerance, threads)
        mu, history, passes = descent.run(energy, mu, tell if probe.active else None)
        return Estimate(
            disparity={scene.ref: self._disparity(matcher, mu, rho, threads)},
            volume=Volume(space, mu, matcher.indices),
            history=history,
            work={
                "passes": passes,
                "point_updates": passes * mu.size,
                "pair_similarities": compared,
            },
        )

    def _target(self, matcher: Matcher) -> float:
        """N: how many materialities one epipolar plane should hold."""
        space = matcher.space
        if self.target == "image":
            return float(space.samples)
        return space.samples + (space.views - 1) * abs(space.first + space.last) / 2

    def _energy(self, matcher: Matcher, rho: NDArray[np.uint8], threads: int) -> Energy:
        space = matcher.space
        if self.across or self.along:
            weights = edge_weights(matcher.rows, space, self.edge, threads)
        else:
            weights = (np.ones((space.rows, 0, 0), np.uint8), np.ones((space.rows, 0, 0), np.uint8))
        return Energy(
            space=space,
            pairs=matcher.pairs,
            rho=rho,
            target=self._target(matcher),
            count=self.count,
            per_row=self.counted == "row",
            across=self.across,
            along=self.along,
            weights=weights,
        )

    def _disparity(
        self, matcher: Matcher, mu: NDArray[np.float32], rho: NDArray[np.uint8], threads: int
    ) -> NDArray[np.float32]:
        """(H, W) disparities of the reference view, in pixels per view step of the given scene."""
        view, space = matcher.scene.ref, matcher.space
        if self.binarization == "plane":
            found = by_plane(mu, space, view, self._target(matcher))
        elif self.binarization == "ray":
            found = by_ray(seen_rays(mu, space, view, threads))
        else:
            cost, material = visible_cost(mu, rho, space, matcher.pairs, view, self.hidden, threads)
            extra = np.float32(self.material) * (1 - material) if self.material else None
            found = self.read(cost, matcher.scene.views[view], threads, extra)
        return matcher.disparity(found)
