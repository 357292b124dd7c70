"""`matbench compare`: run methods on scenes, score them, write tables and a report."""

from functools import partial
from typing import Annotated

from attrs import evolve
from cyclopts import App, Parameter

from matbench.commands.options import DEFAULTS, Options, many, need_volumes, whole
from matbench.errors import UserError
from matbench.plans.record_option import RecordOption

app = App(name="compare", help_epilogue="", help_format="markdown")


@app.default
def compare(
    *,
    algorithm: Annotated[
        list[str] | None,
        many("-a", "--algorithm", "Method, such as `sgbm` or `materiality[pairs=all,consecutive]`; default seven."),
    ] = None,
    scene: Annotated[
        list[str] | None,
        many(
            "-s", "--scene", "Scene or pattern, such as `middlebury2003/teddy[views=0:9:2]`, `synthetic/*` or `paper`."
        ),
    ] = None,
    record: Annotated[
        list[str] | None,
        Parameter(
            consume_multiple=True,
            negative="",
            help="Also write a recording of every cell for `view`; default of all, "
            "else of some of slices,volumes,space,surface,passes=N.",
        ),
    ] = None,
    row: Annotated[
        str | None,
        Parameter(name=["--row", "--rows"], help="Image rows of the recordings' slices; default the middle one."),
    ] = None,
    volumes: Annotated[
        bool, Parameter(negative="", help="Also keep and score the volumes of methods that have one.")
    ] = False,
    options: Options = DEFAULTS,
) -> int:
    """Run methods on scenes, score them, and write tables and a report.

    Without arguments: seven methods (`matbench list` says which others there are) on twelve small random worlds, and
    on the paper's three where the data folder has them. The same line typed again takes up where it was interrupted.

    **Examples**

    `matbench compare`

    `matbench compare -a sgbm -a materiality -s middlebury2001/venus --data ~/stereo`

    `matbench compare -a 'okutomi_kanade[window=3,5,7]' -s 'synthetic/*' -m bad_2`

    An option of a scene, or a parameter, that takes three numbers or more gives curves. `views=N` is that many views
    as wide as they fit, `baseline=N` how many view steps apart the outermost are:

    `matbench compare -a okutomi_kanade -s 'middlebury2003/teddy[views=3 baseline=2,4,6]' --data DATA`

    Recordings of chosen rows, or of chosen parts only:

    `matbench compare -a materiality -s synthetic/box --record --rows 60,120,180`

    `matbench compare -a materiality -s synthetic/box --record slices,passes=10`

    Scores of volumes, which are kept; and of predictions of the rightmost view, which is not given:

    `matbench compare -a materiality -s synthetic/box -m surface_f_1`

    `matbench compare -s 'synthetic/*[predict=right]' -m prediction_psnr`

    Four cells at once, none of them longer than ten minutes or larger than 2 GiB; on a Dask cluster:

    `matbench compare --jobs 4 --timeout 600 --memory 2G`

    `matbench compare --dask tcp://head:8786`

    As many worlds as it takes to tell the first two methods apart, for ten minutes at most:

    `matbench compare -a materiality -a multiview_sgm --until decided --budget 10m`

    In a script, where the exit status tells 0 all well, 1 cells failed, 2 wrong usage, 130 interrupted:

    `matbench compare -a sgbm -s synthetic/box --json`
    """
    from matbench import comparison
    from matbench.commands import running
    from matbench.scenes.catalogue import default_scenes

    settings = options.settings
    if row is not None and record is None:
        raise UserError(f"--row {row} chooses what recordings show: add --record")
    if scene is None and not options.grows:
        running.say_missing(default_scenes(options.data)[1], options)
    prepare = partial(
        comparison.prepare,
        algorithm,
        settings=evolve(
            settings,
            record=None if record is None else RecordOption.of(record, row),
            volumes=volumes or need_volumes(settings.metrics, options.plugin),
        ),
        out=options.out,
        seed=options.seeds,
        plugin=options.plugin,
        repeats=whole("repeats", options.repeats),
        write=not options.dry_run,
    )
    if options.grows:
        from matbench.commands import growing

        return growing.work(prepare, growing.names(scene, options), options)
    ready = prepare(scene)
    return running.show_plan(ready, options) if options.dry_run else running.work(ready, options)
