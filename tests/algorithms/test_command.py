"""Other people's programs: honest, failing, hanging and lying ones."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from places import PROGRAMS

from matbench import Context, Range, Scene
from matbench.algorithms.command import Command
from matbench.comparison import prepare
from matbench.errors import UserError
from matbench.plans.plan import methods
from matbench.plans.plugins import default_algorithms
from matbench.scenes.catalogue import load_scene
from matbench.solving.check_scenes import mirrored
from matbench.solving.method_check import check

MATCHER = (PROGRAMS / "block_matcher.py").read_text()
START = """
import sys, time, os
from pathlib import Path
left, right, ndisp, out = sys.argv[1:5]
"""
LIES = {
    "is no PFM": ("(Path(out) / 'disp0.pfm').write_text('P5 all is well')", "a PFM header is 'Pf'"),
    "is of another size": ("(Path(out) / 'disp0.pfm').write_bytes(b'Pf\\n2 2\\n-1\\n' + bytes(16))", "is 2x2 px, not"),
    "is cut off": ("(Path(out) / 'disp0.pfm').write_bytes(b'Pf\\n240 180\\n-1\\n' + bytes(16))", "is truncated"),
    "holds garbage": (
        "(Path(out) / 'disp0.pfm').write_bytes(b'Pf\\n240 180\\n-1\\n' + b'\\xc3\\x7e\\x99\\x7e' * 43200)",
        "which is no disparity",
    ),
    "is missing": (
        "(Path(out) / 'result.pfm').write_bytes(b'')",
        "wrote no disp0.pfm into its folder {out}: result.pfm",
    ),
    "is a folder": ("(Path(out) / 'disp0.pfm').mkdir()", "wrote no disp0.pfm"),
}


def program(path: Path, source: str) -> str:
    """An executable Python file."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"#!{sys.executable}\n{source}")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def matcher(tmp_path: Path) -> str:
    """A program that keeps to the convention; its path has blanks."""
    return program(tmp_path / "my programs" / "block matcher", MATCHER)


@pytest.fixture(scope="module")
def box() -> Scene:
    return load_scene("synthetic/box[n=5 ref=1]")


def bad(scene: Scene, found: np.ndarray) -> float:
    return 100 * float(np.mean(~(np.abs(found - scene.truth[scene.ref]) * scene.pair_steps <= 1.0001)))


def test_a_program_competes_with_ranges_of_any_sign_and_its_pair_on_either_side(
    matcher: str, box: Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    method = Command(matcher)
    for scene, most in [(box, 5), (load_scene("synthetic/curved[n=5 ref=1]"), 12)]:
        found = method.solve(scene, Context(threads=3)).disparity[1]
        assert bad(scene, found) < most
        assert np.array_equal(method.solve(mirrored(scene), Context()).disparity[3], found[:, ::-1])
    assert "17 disparities, 3 threads" in capfd.readouterr().out


def shifted(least: int, largest: int) -> Scene:
    """A flat wall at disparity `largest` - 1, seen by two views as far as its random columns go."""
    wall = np.random.default_rng(0).integers(0, 256, (24, 80, 3)).astype(np.uint8)
    d = largest - 1
    views = np.stack([wall[:, 10:70], wall[:, 10 + d : 70 + d]])
    truth = {0: np.full((24, 60), d, np.float32)}
    return Scene("wall", views, ("0", "1"), 0, Range(least, largest), truth, 1)


@pytest.mark.parametrize(("least", "largest"), [(-6, -2), (-3, 3), (0, 5), (3, 8)])
def test_a_shifted_range_gives_the_exact_disparity_up_to_the_frame(matcher: str, least: int, largest: int) -> None:
    scene = shifted(least, largest)
    d = largest - 1
    found = Command(matcher).solve(scene, Context()).disparity[0]
    seen = np.zeros(60, bool)
    seen[max(0, d) + 3 : 60 + min(0, d) - 3] = True  # where the other view holds the window, too
    assert (found[:, seen] == d).all()


def test_a_c_program_competes_behind_a_run_script(tmp_path: Path, box: Scene) -> None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    binary = tmp_path / "matcher"
    subprocess.run([compiler, "-O2", PROGRAMS / "block_matcher.c", "-lm", "-o", binary], check=True)
    run = program(tmp_path / "run", (PROGRAMS / "run_c.py").read_text())
    assert bad(box, Command(run).solve(box, Context()).disparity[1]) < 6

    (one,) = methods(f"command[program='{run}' files='{binary}']")
    binary.write_bytes(binary.read_bytes() + b"\0")
    (two,) = methods(f"command[program='{run}' files='{binary}']")
    assert one.code != two.code


def test_arguments_stand_where_they_are_wanted(tmp_path: Path, box: Scene) -> None:
    swapped = MATCHER.replace("sys.argv[1:3]", "sys.argv[4:6]").replace("sys.argv[3]", "'6'").replace(
        "sys.argv[4]", "sys.argv[2].removeprefix('dir=')"
    )  # fmt: skip
    path = program(tmp_path / "swapped", f"import sys\nassert sys.argv[3] == 'a  $HOME;'\n{swapped}")
    args = "--out dir={out} 'a  $HOME;' {left} {right}".replace("--out ", "-o ")
    assert np.isfinite(Command(path, args=args).solve(box, Context()).disparity[1]).any()


def test_only_infinite_and_nan_are_no_answer(tmp_path: Path) -> None:
    source = START + (
        "import numpy as np\n"
        "found = np.array([[0, 1, np.inf], [np.nan, -np.inf, 2.5]], '<f4')\n"
        "(Path(out) / 'disp0_s.pfm').write_bytes(b'Pf\\n3 2\\n-1\\n' + found[::-1].tobytes())"
    )
    scene = Scene("six", np.zeros((3, 2, 3, 3), np.uint8), ("0", "1", "2"), 0, Range(0, 4), {}, 2)
    found = Command(program(tmp_path / "sparse", source)).solve(scene, Context()).disparity[0]
    np.testing.assert_array_equal(found, np.array([[0, 0.5, np.nan], [np.nan, np.nan, 1.25]], np.float32))


@pytest.mark.parametrize("lie", LIES)
def test_a_lying_program_is_told_what_its_map_is(lie: str, tmp_path: Path, box: Scene) -> None:
    source, said = LIES[lie]
    method = Command(program(tmp_path / "liar", START + source))
    with pytest.raises((UserError, RuntimeError)) as error:
        method.solve(box, Context())
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("print('no licence'); print('giving up', file=sys.stderr); sys.exit(3)", "exit status 3"),
        ("os.kill(os.getpid(), 11)", "signal 11"),
    ],
)
def test_a_failing_program_is_quoted(source: str, said: str, tmp_path: Path, box: Scene) -> None:
    method = Command(program(tmp_path / "bad", START + source))
    with pytest.raises(RuntimeError, match=said) as error:
        method.solve(box, Context())
    assert ("giving up" in str(error.value)) == ("exit" in said)


def test_what_cannot_be_started_is_refused_in_one_line(tmp_path: Path, matcher: str, box: Scene) -> None:
    plain = tmp_path / "plain"
    plain.write_text("")
    for selector, said in [
        ("command", "program must be given, as command[program=VALUE]"),
        ("command[program=./none]", "'./none' does not exist"),
        (f"command[program={plain}]", "chmod +x"),
        (f"command[program={tmp_path}]", "no executable file"),
        (f"command[program='{matcher}' args='-v']", "lack {left}, {right}, {out}"),
        (f"command[program='{matcher}' files=none.so]", "'none.so' cannot be read"),
    ]:
        with pytest.raises(UserError) as error:
            methods(selector)
        assert said in str(error.value)
        assert "\n" not in str(error.value)
    assert "command" not in default_algorithms()
    wrong = program(tmp_path / "shebang", "")
    Path(wrong).write_text("#!/no/such/interpreter\n")
    with pytest.raises(RuntimeError, match="cannot be started"):
        Command(wrong).solve(box, Context())


def is_gone(pid: int, patience: float = 20) -> bool:
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        time.sleep(0.05)
    return False


def wait_for(path: Path, patience: float = 60) -> int:
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if path.exists() and path.read_text():
            return int(path.read_text())
        time.sleep(0.05)
    raise AssertionError(f"{path} was not written")


HANGS = START + "f = Path(__file__).with_suffix('.pid'); f.write_text(str(os.getpid())); time.sleep(600)"


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's promise is Linux's")
def test_a_hanging_program_ends_with_the_process_that_waits_for_it(tmp_path: Path) -> None:
    hanging = program(tmp_path / "hangs", HANGS)
    code = (
        "import sys; from matbench import Context; from matbench.algorithms.command import Command\n"
        "from matbench.scenes.catalogue import load_scene\n"
        "Command(sys.argv[1]).solve(load_scene('synthetic/box[n=2 size=64x48]'), Context())"
    )
    waiting = subprocess.Popen([sys.executable, "-c", code, hanging])
    try:
        pid = wait_for(tmp_path / "hangs.pid")
        assert psutil.pid_exists(pid)
    finally:
        os.kill(waiting.pid, signal.SIGKILL)
        waiting.wait()
    assert is_gone(pid)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's promise is Linux's")
def test_the_check_passes_an_honest_program_and_ends_a_hanging_one(tmp_path: Path, matcher: str) -> None:
    (method,) = methods(f"command[program='{matcher}']")
    found = {finding.check: finding for finding in check(method)}
    assert {finding.verdict for finding in found.values()} == {"pass", "note"}, found
    (method,) = methods(f"command[program='{program(tmp_path / 'hangs', HANGS)}']")
    found = {finding.check: finding for finding in check(method, timeout=5)}
    assert "no answer within 5 s" in found["answers"].reason
    assert is_gone(wait_for(tmp_path / "hangs.pid"))


def test_cells_of_programs_good_and_bad_and_a_changed_program_is_another_cell(tmp_path: Path, matcher: str) -> None:
    broken = program(tmp_path / "broken", START + "print('out of luck'); sys.exit(4)")
    chosen = [f"command[program='{path}']" for path in (matcher, broken)]

    def cells() -> dict[str, tuple[str, float]]:
        ready = prepare(chosen, "synthetic/box", out=tmp_path / "run")
        ready.run()
        made = ready.tables()
        scores, found = made.results, made.cells
        bad_1 = scores[(scores.metric == "total_bad_1") & (scores.region == "all")].set_index("params").value
        return {params: (status, bad_1.get(params)) for params, status in zip(found.params, found.status, strict=True)}

    good, ill = f"program='{matcher}'", f"program={broken}"
    first = cells()
    assert first[good][0] == "ok"
    assert first[good][1] < 6
    assert first[ill] == ("failed", None)
    logs = "".join(path.read_text() for path in (tmp_path / "run" / "cells").glob("*/log.txt"))
    assert "disparities, " in logs
    assert "out of luck" in logs

    Path(matcher).write_text(Path(matcher).read_text().replace("found[::-1]", "(0 * found[::-1])"))
    assert cells()[good][1] > 20
