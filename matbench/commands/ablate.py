"""`matbench ablate`: what each switch of a method does, all else equal."""

from functools import partial
from pathlib import Path
from typing import Annotated

from attrs import evolve
from cyclopts import App

from matbench.commands.options import DEFAULTS, Options, many, need_volumes, whole

app = App(name="ablate", help_epilogue="", help_format="markdown")


@app.default
def ablate(
    selector: str,
    *,
    scene: Annotated[
        list[str] | None, many("-s", "--scene", "Scene or pattern, as for `compare`; the more, the better.")
    ] = None,
    options: Options = DEFAULTS,
) -> int:
    """Run every combination of a method's parameters and tell what each factor does.

    Differences are paired by scene, all else equal; intervals and effect sizes are over scenes.
    The first value of a parameter is the base that the others are compared with. Options of scenes may vary, too:
    what takes three numbers or more gives curves.

    **Examples**

    `matbench ablate 'materiality[pairs=all,consecutive binarization=plane,volume]' -s 'middlebury*/*' --data DATA`

    `matbench ablate algorithms/ablations/pairs.toml --data DATA`

    `matbench ablate 'materiality[pairs=all,consecutive]' --until decided --budget 10m`

    `matbench ablate 'materiality[views=0]' -s 'middlebury*/*[views=2,3,5,7,9]' --data DATA`

    Parameters
    ----------
    selector
        Method with several values for its parameters, or a TOML file with `algorithms` and `scenes`.
    """
    from matbench import comparison
    from matbench.commands import running
    from matbench.plans.plan import methods
    from matbench.plans.request import read_request
    from matbench.results import ablation

    settings = options.settings
    algorithms: list[str] = [selector]
    if selector.endswith(".toml"):
        algorithms, listed = read_request(Path(selector))
        scene = scene or listed
    chosen = methods(algorithms, options.plugin)
    ablation.check_varies(chosen, scene or ())
    prepare = partial(
        comparison.prepare,
        algorithms,
        settings=evolve(settings, volumes=need_volumes(settings.metrics, options.plugin)),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
        repeats=whole("repeats", options.repeats),
        write=not options.dry_run,
    )
    is_ablation = any(ablation.factors(chosen).values())
    if options.grows:
        from matbench.commands import growing

        return growing.work(prepare, growing.names(scene, options), options, is_ablation)
    ready = prepare(scene)
    return running.show_plan(ready, options) if options.dry_run else running.work(ready, options, is_ablation)
