"""The materiality map: parameters, and the way from a scene to an estimate."""

from collections.abc import Mapping
from typing import ClassVar, Literal, get_args

import numpy as np
from attrs import field, frozen, validators
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate, Probe
from matbench.algorithms.fusion import seen_from
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.materiality.binarize import by_plane, by_ray, seen_rays, visible_cost
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.materiality.edges import edge_weights
from matbench.algorithms.materiality.passes import Energy
from matbench.algorithms.materiality.start import start
from matbench.algorithms.readings import Readings
from matbench.algorithms.similarity import FULL, Matcher, Matching
from matbench.scene import Scene
from matbench.space import Volume

Start = Literal["mean", "soft", "consensus"]
Count = Literal["row", "global"]
Target = Literal["image", "union"]
Optimiser = Literal["fixed_point", "gradient", "fista"]
Binarization = Literal["plane", "ray", "volume"]


@frozen
class Materiality(Matching, Readings):
    """The materiality map (ICIP 2014): a fuzzy map mu of surface points over disparity space.

    It minimises E = E_data + E_smooth (5) over mu in [0, 1], with

    - visibility V_i(s) = Fr_i(s) * product of (1 - mu(t)) over the nearer points t on the ray (3),
    - E_data = sum over s and pairs (i, j) of (rho_ij(s) - mu(s) V_i(s) V_j(s))^2 (6),
    - E_smooth = count / N (sum mu - N)^2 (7) + across sum w (mu(y + 1) - mu(y))^2 +
      along sum w (mu(x + 1) - mu(x))^2 (8), edge weights w = exp(-|dI| / edge),

    by projected gradient with the exact derivative (9), and reads the map in the reference view.
    The default solver is a fixed point instead (13-15): the maps of all views say how far their rays
    reach, so V and mu follow; with these all views are read again, as far as other views see each point.
    A pass lowers the reader's energy (`SemiGlobal.energy`) under the costs of that pass: ``energy_before``
    and ``energy`` in the history, with the share of pixels that ``changed``. As the reader only comes near
    the least, a pass after the first may end up to 2 % above where it began.
    Numbers are those of the equations in docs/concepts/materiality.md.
    Parameters of similarity and reader are those of `Matching` and `Readings`; those of the energy
    (`count` to `edge`) say nothing at the fixed point, but for `target` where planes are binarised alone.

    Parameters
    ----------
    start
        ``mean``: mu = mean rho, as in the paper; ``soft``: exp(sharpness (mean rho - 1)),
        normalised along each ray and averaged over the views; ``consensus``: of the rays that
        reach a point, the share that ends there (`consensus`), by the maps of all views that the
        control reads.
    sharpness
        Of the ``soft`` start.
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
        ``fixed_point`` of visibility and materiality, ``gradient`` descent of E, or ``fista``
        (accelerated, with restarts when E rises). Where nothing couples epipolar planes (`counted` per
        row and `across` 0), each descends, restarts and stops on its own.
    passes
        Readings of all views after the start, or sweeps over all target points, at most.
    tolerance
        Stop when a pass lowers E by less than this share, or, at the fixed point, changes less than
        this share of the pixels by more than half a plane; 0 = never.
    binarization
        ``plane``: the N most material points of each epipolar plane, then the nearest on each ray
        (the paper; pixels may stay without an answer); ``ray``: argmax of mu V on each ray;
        ``volume``: semi-global over the whole map at once, with the cost of a point
        (sum V_ij (1 - rho_ij) + 0.25 hidden) / (sum V_ij + 0.25) + material (1 - mu), V_ij being the
        product of the visibilities of the pair's views other than the reference; at the fixed point
        that is the last reading.
    material
        Weight of mu where planes are chosen.
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
            "alike": 0.0,
        },
        "descent": {"views": 5, "optimiser": "fista", "passes": 5},
    }

    start: Start = field(default="consensus", validator=validators.in_(get_args(Start)))
    sharpness: float = field(default=30.0, validator=validators.gt(0))
    count: float = field(default=0.3, validator=validators.ge(0))
    counted: Count = field(default="row", validator=validators.in_(get_args(Count)))
    target: Target = field(default="image", validator=validators.in_(get_args(Target)))
    across: float = field(default=10.0, validator=validators.ge(0))
    along: float = field(default=6.0, validator=validators.ge(0))
    edge: float = field(default=10.0, validator=validators.gt(0))
    optimiser: Optimiser = field(default="fixed_point", validator=validators.in_(get_args(Optimiser)))
    passes: int = field(default=1, validator=validators.ge(0))
    tolerance: float = field(default=0.0, validator=validators.ge(0))
    binarization: Binarization = field(default="volume", validator=validators.in_(get_args(Binarization)))
    material: float = field(default=0.25, validator=validators.ge(0))

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map, the materialities, and what every pass came to."""
        matcher = Matcher.of(scene, self)
        if self.optimiser == "fixed_point":
            return self._fixed_point(matcher, context)
        return self._descent(matcher, context)

    def _fixed_point(self, matcher: Matcher, context: Context) -> Estimate:
        space, threads, probe = matcher.space, context.threads, context.probe
        if probe.active:
            self._tell_similarities(matcher, matcher.all(threads), probe)
        every = sum(seen_from(matcher, view).ray_comparisons for view in range(space.views))
        history: dict[str, list[float]] = {"changed": [], "energy_before": [], "energy": []}
        if self.start == "consensus":
            maps, compared = self.first(matcher, threads), every
            held = self.volume_bytes(matcher, again=self.passes > 0)
        else:
            compared = matcher.comparisons
            rho = matcher.all(threads)
            mu = start(matcher, rho, self.start == "soft", self.sharpness, threads)
            held = mu.nbytes + max(rho.nbytes, self.volume_bytes(matcher, again=True) if self.passes else 0)
            del rho
            rays = [by_ray(seen_rays(mu, space, view, threads)) for view in range(space.views)]
            # a view in which nothing is material ends in the farthest plane
            maps = np.nan_to_num(np.stack([fill_from_background(found) for found in rays]))
        for number in range(self.passes):
            found, *energies = self.again(matcher, maps, self.material, threads)
            compared += every
            changed = float(np.mean(np.abs(found - maps) > 0.5))
            told = dict(zip(history, (changed, *energies), strict=True))
            for name, value in told.items():
                history[name].append(value)
            maps = found
            if probe.active:
                probe.iteration(
                    number,
                    told,
                    volume=Volume(space, consensus(space, maps, threads), matcher.indices),
                    disparity=matcher.disparity(maps[matcher.scene.ref]),
                )
            if self.tolerance and changed < self.tolerance:
                break
        wanted = context.volume or probe.active or self.binarization != "volume"
        solid = consensus(space, maps, threads) if wanted else None
        answer = maps[matcher.scene.ref]
        if solid is not None and self.binarization != "volume":
            answer = self._binarize(matcher, solid, threads)
        return Estimate(
            disparity={self._reference(matcher): matcher.disparity(answer)},
            volume=None if solid is None else Volume(space, solid, matcher.indices),
            history=history,
            work={"passes": len(history["changed"]), "pair_similarities": compared, "volume_bytes": held},
        )

    def _descent(self, matcher: Matcher, context: Context) -> Estimate:
        space, threads, probe = matcher.space, context.threads, context.probe
        rho = matcher.all(threads)
        if probe.active:
            self._tell_similarities(matcher, rho, probe)
        energy = self._energy(matcher, rho, threads)
        compared = matcher.comparisons
        if self.start == "consensus":
            compared += sum(seen_from(matcher, view).ray_comparisons for view in range(space.views))
            mu = consensus(space, self.first(matcher, threads), threads)
        else:
            mu = start(matcher, rho, self.start == "soft", self.sharpness, threads)

        def tell(step: int, energies: dict[str, float], now: NDArray[np.float32], slopes: NDArray[np.float32]) -> None:
            probe.iteration(
                step,
                {name: value for name, value in energies.items() if name != "restart"},
                volume=Volume(space, now, matcher.indices),
                derivative=Volume(space, slopes.copy(), matcher.indices),
                disparity=matcher.disparity(self._read(matcher, now, rho, threads)),
            )

        descent = Descent(self.passes, self.optimiser == "fista", energy.safe_step, self.tolerance, threads)
        mu, history, passes, updates = descent.run(energy, mu, tell if probe.active else None)
        fixed = rho.nbytes + mu.nbytes + sum(weights.nbytes for weights in energy.weights)
        read = self.volume_bytes(matcher, again=True) if self.binarization == "volume" else 0
        return Estimate(
            disparity={self._reference(matcher): matcher.disparity(self._read(matcher, mu, rho, threads))},
            volume=Volume(space, mu, matcher.indices),
            history=history,
            work={
                "passes": passes,
                "point_updates": updates,
                "pair_similarities": compared,
                "volume_bytes": fixed + max(mu.nbytes, read),
            },
        )

    @staticmethod
    def _reference(matcher: Matcher) -> int:
        """Index of the reference view in the scene that was given."""
        return matcher.indices[matcher.scene.ref]

    @staticmethod
    def _tell_similarities(matcher: Matcher, rho: NDArray[np.uint8], probe: Probe) -> None:
        for p, (i, j) in enumerate(matcher.pairs):
            values = rho[:, p].astype(np.float32) / np.float32(FULL)
            name = f"similarity/{matcher.indices[i]}-{matcher.indices[j]}"
            probe.volume(name, Volume(matcher.space, values, matcher.indices))

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

    def _binarize(self, matcher: Matcher, mu: NDArray[np.float32], threads: int) -> NDArray[np.float32]:
        """(H, W) planes on the reference view's rays, from the materialities alone."""
        view, space = matcher.scene.ref, matcher.space
        if self.binarization == "plane":
            return by_plane(mu, space, view, self._target(matcher))
        return by_ray(seen_rays(mu, space, view, threads))

    def _read(
        self, matcher: Matcher, mu: NDArray[np.float32], rho: NDArray[np.uint8], threads: int
    ) -> NDArray[np.float32]:
        """(H, W) planes on the reference view's rays."""
        if self.binarization != "volume":
            return self._binarize(matcher, mu, threads)
        view, space = matcher.scene.ref, matcher.space
        cost, material = visible_cost(mu, rho, space, matcher.pairs, view, self.hidden, threads)
        cost += np.float32(self.material) * (1 - material)
        return self.read(cost, matcher.scene.views[view], threads)
