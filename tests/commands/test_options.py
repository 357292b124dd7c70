"""Options that several commands share."""

from pathlib import Path

import pytest

SMALL = "synthetic/box[size=96x72]"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--timeout 0", "timeout '0' is not a positive number of seconds, such as 600, or none"),
        ("--timeout=-1", "timeout '-1' is not a positive"),
        ("--timeout x", "timeout 'x' is not a positive"),
        ("--timeout nan", "timeout 'nan' is not a positive"),
        ("--memory '3 bananas'", "memory '3 bananas' is not an amount such as 512 (MiB), 512M or 4G"),
        ("--memory 0", "memory '0' is not an amount"),
        ("--jobs 0", "jobs '0' is not a whole number from 1 to 256"),
        ("--threads 1000", "threads '1000' is not a whole number from 1 to 256"),
        ("--isolation none", "isolation 'none' is not process or shared"),
        ("-m bad_1 -m bad_0", "metric bad_0: 0 is not a number from 0.001 to 1000 of at most 6 digits"),
        ("-m bad_x", "unknown metric 'bad_x': did you mean 'bad_@'? Possible: a50, "),
        ("--metrics kitty", "unknown metrics 'kitty': did you mean 'kitti'? Possible: eth3d, hci, kitti, middlebury"),
    ],
)
def test_limits_that_make_no_sense_are_refused(
    line: str, said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import shlex

    from matbench.cli import main

    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["compare", "-a", "sgbm", "-s", SMALL, *shlex.split(line)])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith(f"matbench: {said}")
    assert not list(tmp_path.iterdir())


def test_metrics_by_name_and_by_set_each_once() -> None:
    from matbench.commands.options import Options, asked_metrics, need_volumes

    assert asked_metrics(["bad_3.0", "total_bad_2", "bad_3"], "middlebury")[:3] == (
        "bad_3",
        "total_bad_2",
        "total_bad_0.5",
    )
    assert Options(metric=["d1"]).settings.metrics == ("d1",)
    assert Options().settings.metrics == ()
    assert need_volumes(["bad_3", "surface_f_1"])
    assert not need_volumes(["bad_3"])
