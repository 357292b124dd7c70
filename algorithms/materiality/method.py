"""The materiality map: parameters, and the way from a scene to an estimate."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from matbench.algorithm import Context, Estimate, Probe
from matbench.algorithms.holes import fill_from_background
from matbench.algorithms.inference import Inference
from matbench.algorithms.materiality.binarize import by_plane, by_ray, seen_rays, visible_cost
from matbench.algorithms.materiality.consensus import consensus
from matbench.algorithms.materiality.descent import Descent
from matbench.algorithms.materiality.edges import edge_weights
from matbench.algorithms.materiality.objective import Energy
from matbench.algorithms.materiality.parameters import EnergyTerms, Solver, silent
from matbench.algorithms.materiality.sharp import SharpEnergy
from matbench.algorithms.materiality.start import start
from matbench.algorithms.ray_ends import rays_end_near, seen_near
from matbench.algorithms.similarity import FULL, Matcher, Matching
from matbench.parameters import flat
from matbench.scene import Scene
from matbench.space import DisparitySpace, Volume


@flat
@frozen
class Materiality:
    """The materiality map (ICIP 2014): a fuzzy map mu of surface points over disparity space.

    It minimises E = E_data + E_smooth (5) over mu in [0, 1], with

    - visibility V_i(s) = Fr_i(s) * product of (1 - mu(t)) over the nearer points t on the ray (3),
    - E_data = sum over s and pairs (i, j) of (rho_ij(s) - mu(s) V_i(s) V_j(s))^2 (6),
    - E_smooth = count / N (sum mu - N)^2 (7) + across sum w (mu(y + 1) - mu(y))^2 +
      along sum w (mu(x + 1) - mu(x))^2 (8), edge weights w = exp(-|dI| / edge),

    by projected gradient with the exact derivative (9), and takes the disparities of the reference view from mu.
    The default solver is a fixed-point iteration instead (13-15). The maps of all views say where their rays
    end; V and mu follow from that. Then all maps are inferred again, with costs from the views that see each
    point. A pass seeks the maps of least energy (`SemiGlobal.energy`) under the costs of that pass. The history
    holds it as ``energy_before`` and ``energy``, with the share of pixels that ``changed``. Semi-global matching
    only approximates the minimum, so a pass may end up to 3 % above where it began.
    Numbers are those of the equations in docs/concepts/materiality.md.

    Its parameters are in four groups, but are given by their own names: ``Materiality(pairs="all", passes=2)``. A
    parameter without effect beside the others, such as `sharpness` without ``start=soft``, is refused.

    Raises
    ------
    ValueError
        For a value that a parameter does not take, or one that changes nothing.
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
        },
        "descent": {"optimiser": "fista", "passes": 5, "binarization": "maps"},
    }

    matching: Matching = field(factory=Matching)
    inference: Inference = field(factory=Inference)
    solver: Solver = field(factory=Solver)
    energy: EnergyTerms = field(factory=EnergyTerms)

    @property
    def silent(self) -> Mapping[str, str]:
        """Parameter -> what it needs to have an effect, for those without effect beside the others."""
        return {**self.inference.silent(self.matching), **silent(self.matching, self.solver, self.energy)}

    def solve(self, scene: Scene, context: Context) -> Estimate:
        """The reference view's map, the materialities, and the history of the passes."""
        solve = self._descent if self.solver.descends else self._fixed_point
        return solve(Matcher.of(scene, self.matching, context.threads), context)  # no name here: it is given up there

    def _fixed_point(self, matcher: Matcher, context: Context) -> Estimate:
        space, threads, probe = matcher.space, context.threads, context.probe
        if probe.active:
            self._tell_similarities(matcher, matcher.all(threads), probe)
        solver, inference = self.solver, self.inference
        every = inference.comparisons(matcher)
        inferring = inference.volume_bytes(matcher, solver.material if solver.passes else 0.0)
        ratios = np.ones((space.rows, space.width), np.float32)
        history: dict[str, list[float]] = {"changed": [], "energy_before": [], "energy": []}
        if solver.start == "consensus":
            matcher = matcher.on_rays(threads)  # other features make room
            maps, compared = inference.initial_maps(matcher, threads, ratios), every
            held = inferring
        else:
            compared = matcher.comparisons
            rho = matcher.all(threads)
            mu = start(matcher, rho, solver.start == "soft", solver.sharpness, threads)
            held = mu.nbytes + max(rho.nbytes, inferring if solver.passes else 0)
            del rho
            matcher = matcher.on_rays(threads)
            maps = self._rays_end(mu, space, threads)
        for number in range(solver.passes):
            found, *energies = inference.refined_maps(
                matcher, maps, solver.material, threads, ratios, solver.visibility
            )
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
            if solver.tolerance and changed < solver.tolerance:
                break
        wanted = context.volume or probe.active or solver.binarization in ("plane", "ray")
        solid = consensus(space, maps, threads) if wanted else None
        answer = maps[matcher.scene.ref]
        if solid is not None and solver.binarization in ("plane", "ray"):
            answer = self._binarize(matcher, solid, threads)
        sure = ratios
        if solver.confidence != "costs" or not solver.infers:
            ends = rays_end_near(matcher, maps, answer, threads)
            sure = ends * ratios if solver.confidence == "both" else ends
        return Estimate(
            disparity={self._reference(matcher): matcher.disparity(answer)},
            confidence={self._reference(matcher): sure},
            volume=None if solid is None else Volume(space, solid, matcher.indices),
            history=history,
            work={"passes": len(history["changed"]), "pair_similarities": compared, "volume_bytes": held},
        )

    def _descent(self, matcher: Matcher, context: Context) -> Estimate:
        space, threads, probe = matcher.space, context.threads, context.probe
        rho = matcher.all(threads)
        if probe.active:
            self._tell_similarities(matcher, rho, probe)
        solver, energy = self.solver, self._energy(matcher, rho, threads)
        compared = matcher.comparisons
        if solver.start == "consensus":
            compared += self.inference.comparisons(matcher)
            mu = consensus(space, self.inference.initial_maps(matcher, threads), threads)
        else:
            mu = start(matcher, rho, solver.start == "soft", solver.sharpness, threads)

        def tell(step: int, energies: dict[str, float], now: NDArray[np.float32], slopes: NDArray[np.float32]) -> None:
            probe.iteration(
                step,
                {name: value for name, value in energies.items() if name != "restart"},
                volume=Volume(space, now, matcher.indices),
                derivative=Volume(space, slopes.copy(), matcher.indices),
                disparity=matcher.disparity(self._infer(matcher, now, rho, threads)),
            )

        descent = Descent(solver.passes, solver.optimiser == "fista", energy.safe_step, solver.tolerance, threads)
        mu, history, passes, updates = descent.run(energy, mu, tell if probe.active else None)
        fixed = rho.nbytes + mu.nbytes + sum(weights.nbytes for weights in energy.weights)
        compared += self.inference.comparisons(matcher) if solver.binarization == "maps" else 0
        answer = self._infer(matcher, mu, rho, threads)
        sure = seen_near(seen_rays(mu, space, matcher.scene.ref, threads), answer, threads)
        shape = space.rows, space.planes, space.width
        inferring = {  # a volume's costs and materialities are real numbers of all rows, and whole ones as well
            "maps": self.inference.volume_bytes(matcher, solver.material),
            "volume": 2 * matcher.ray_bytes + self.inference.semiglobal.paths(1.0).held(shape),
        }
        return Estimate(
            disparity={self._reference(matcher): matcher.disparity(answer)},
            confidence={self._reference(matcher): sure},
            volume=Volume(space, mu, matcher.indices),
            history=history,
            work={
                "passes": passes,
                "point_updates": updates,
                "pair_similarities": compared,
                "volume_bytes": fixed + max(mu.nbytes, inferring.get(solver.binarization, 0)),
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

    @staticmethod
    def _rays_end(mu: NDArray[np.float32], space: DisparitySpace, threads: int) -> NDArray[np.float32]:
        """(views, H, W) planes where mu V is largest on the rays; where nothing is material, the farthest plane."""
        rays = [by_ray(seen_rays(mu, space, view, threads)) for view in range(space.views)]
        return np.nan_to_num(np.stack([fill_from_background(found) for found in rays]))

    def _target(self, matcher: Matcher) -> float:
        """N: how many materialities one epipolar plane should hold."""
        space = matcher.space
        if self.energy.target == "image":
            return float(space.samples)
        return space.samples + (space.views - 1) * abs(space.first + space.last) / 2

    def _energy(self, matcher: Matcher, rho: NDArray[np.uint8], threads: int) -> Energy:
        space, terms = matcher.space, self.energy
        if terms.across or terms.along:
            weights = edge_weights(matcher.rows, space, terms.edge, threads)
        else:
            weights = (np.ones((space.rows, 0, 0), np.uint8), np.ones((space.rows, 0, 0), np.uint8))
        return (SharpEnergy if terms.form == "linear" else Energy)(
            space=space,
            pairs=matcher.pairs,
            rho=rho,
            target=self._target(matcher),
            count=terms.count,
            per_row=terms.counted == "row",
            across=terms.across,
            along=terms.along,
            weights=weights,
        )

    def _binarize(self, matcher: Matcher, mu: NDArray[np.float32], threads: int) -> NDArray[np.float32]:
        """(H, W) planes on the reference view's rays, from the materialities alone."""
        view, space = matcher.scene.ref, matcher.space
        if self.solver.binarization == "plane":
            return by_plane(mu, space, view, self._target(matcher))
        return by_ray(seen_rays(mu, space, view, threads))

    def _infer(
        self, matcher: Matcher, mu: NDArray[np.float32], rho: NDArray[np.uint8], threads: int
    ) -> NDArray[np.float32]:
        """(H, W) planes on the reference view's rays."""
        if self.solver.binarization == "maps":
            ends = self._rays_end(mu, matcher.space, threads)
            maps, *_ = self.inference.refined_maps(matcher, ends, self.solver.material, threads)
            return np.asarray(maps[matcher.scene.ref])
        if self.solver.binarization != "volume":
            return self._binarize(matcher, mu, threads)
        view, space = matcher.scene.ref, matcher.space
        cost, material = visible_cost(mu, rho, space, matcher.pairs, view, self.inference.fusion.hidden, threads)
        cost += np.float32(self.solver.material) * (1 - material)
        return self.inference.semiglobal.infer(cost, matcher.scene.views[view], threads)
