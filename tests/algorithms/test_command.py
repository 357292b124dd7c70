"""Other people's programs: honest, failing, hanging and lying ones."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from places import PROGRAMS
from rigs import uneven
from tools import need

from matbench import Context, Range, Scene
from matbench.algorithm import unsupported
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


SWEEP = (PROGRAMS / "plane_sweep.py").read_text()


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
    (compiler,) = need("compiler")
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
        (f"command[program='{matcher}' files=\"a'\"]", "cannot be split into words"),
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


def sweep(layout: str, kind: str = "depth") -> str:
    return f"{layout} {{{layout}}} {{ref}} {{near}} {{far}} {{out}} {kind}"


@pytest.mark.parametrize(
    ("layout", "kind"), [*((one, "depth") for one in ("json", "colmap", "pmvs", "mvsnet")), ("json", "disp")]
)
def test_a_program_of_all_views_gets_right_cameras_in_every_layout(layout: str, kind: str, tmp_path: Path) -> None:
    method = Command(program(tmp_path / "sweep", SWEEP), args=sweep(layout, kind))
    full = load_scene("synthetic/box[n=6 ref=2 size=96x72]")
    for scene in (full, uneven(full, (0, 2, 5), 2), load_scene("synthetic/curved[n=5 ref=1 size=96x72]")):
        assert not unsupported(method, scene)
        found = method.solve(scene, Context()).disparity[scene.ref]
        assert bad(scene, found) < 14, scene.name  # 40 planes of depth, in windows


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("", "has not one of disp, depth, as pfm, npy, npz, tif, tiff: nothing"),
        ("np.save(out / 'disp.npy', zero); np.save(out / 'depth.npy', zero)", "depth.npy, disp.npy"),
        ("np.save(out / 'disp.npy', zero[1:])", "is 240x179 px, not 240x180 as its view"),
        ("(out / 'depth.pfm').write_text('P5')", "a PFM header is 'Pf'"),
        ("np.save(out / 'depth.npy', np.array([{}], dtype=object))", "cannot be read"),
    ],
)
def test_what_a_program_of_all_views_leaves_is_told(source: str, said: str, tmp_path: Path, box: Scene) -> None:
    head = "import sys\nfrom pathlib import Path\nimport numpy as np\n"
    head += "out, zero = Path(sys.argv[2]), np.zeros((180, 240))\n"
    method = Command(program(tmp_path / "liar", head + source), args="{views} {out}")
    with pytest.raises((UserError, RuntimeError)) as error:
        method.solve(box, Context())
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_depths_that_are_none_are_no_answer(tmp_path: Path) -> None:
    source = (
        "import sys\nimport numpy as np\n"
        "np.save(sys.argv[2] + '/depth.npy', np.array([[0, -1, np.inf], [np.nan, 1, 2]], np.float32))"
    )
    scene = Scene("six", np.zeros((3, 2, 3, 3), np.uint8), ("0", "1", "2"), 0, Range(1, 3), {}, 2)
    found = Command(program(tmp_path / "sparse", source), args="{json} {out}").solve(scene, Context()).disparity[0]
    np.testing.assert_array_equal(found, np.array([[np.nan] * 3, [np.nan, 3, 1.5]], np.float32))


def test_a_link_is_called_by_its_own_name(tmp_path: Path, box: Scene) -> None:
    """As a virtual environment's python is one, which finds its packages by the name."""
    target = program(tmp_path / "target", f"import sys\nprint('called', sys.argv[0])\n{MATCHER}")
    link = tmp_path / "link"
    link.symlink_to(target)
    shell = tmp_path / "shell"
    shell.write_text('#!/bin/sh\necho "called $0"\nexit 3\n')
    shell.chmod(0o755)
    named = tmp_path / "named"
    named.symlink_to(shell)
    with pytest.raises(RuntimeError, match=f"called {named}"):
        Command(str(named)).solve(box, Context())
    assert bad(box, Command(str(link)).solve(box, Context()).disparity[1]) < 5


def test_the_python_of_a_virtual_environment_finds_its_packages(tmp_path: Path, box: Scene) -> None:
    """matbench's own stands in one where it is tried."""
    script = tmp_path / "match.py"
    script.write_text(f"import sys\nassert sys.prefix == {sys.prefix!r}, sys.prefix\n{MATCHER}")
    method = Command(sys.executable, args=f"{script} {{left}} {{right}} {{ndisp}} {{out}}")
    assert bad(box, method.solve(box, Context()).disparity[1]) < 5


def test_relative_files_are_those_of_the_user_and_the_program_works_elsewhere(
    tmp_path: Path, box: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "user").mkdir()
    monkeypatch.chdir(tmp_path / "user")
    (tmp_path / "user" / "weights.txt").write_text("7")
    extra = "import os, sys\nassert open(sys.argv[5]).read() == '7'\nassert not os.listdir()\nopen('left over', 'w')\n"
    program(tmp_path / "user" / "mine", extra + MATCHER)
    method = Command("./mine", args="{left} {right} {ndisp} {out} weights.txt")
    assert bad(box, method.solve(box, Context()).disparity[1]) < 5
    assert sorted(path.name for path in Path.cwd().iterdir()) == ["mine", "weights.txt"]
    assert Path("weights.txt") in method.reads

    chosen = "command[program=./mine args='{left} {right} {ndisp} {out} weights.txt']"
    (before,) = methods(chosen)
    Path("weights.txt").write_text("8")
    (after,) = methods(chosen)
    assert before.code != after.code, "what arguments name counts by its content"


def test_the_check_catches_a_map_that_is_upside_down(tmp_path: Path, matcher: str) -> None:
    turned = MATCHER.replace("found[::-1]", "found")
    assert turned != MATCHER
    (method,) = methods(f"command[program='{program(tmp_path / 'turned', turned)}']")
    found = {finding.check: finding for finding in check(method)}
    assert found["sense"].verdict == "fail"
    assert "upside down" in found["sense"].reason
    assert {finding.verdict for finding in found.values() if finding.check != "sense"} == {"pass", "note"}
