"""Layer two: every method and kernel against the frozen reference.

Without more, a few rounds that show that every subject works; where tests run side by side, which
switches pytest-benchmark off, a few calls show it. `matbench bench` asks for as many rounds as a
judgement takes, by ``--benchmark-min-rounds``, in several parts: what disturbs a subject for some
seconds does not disturb it in all of them. It reads what the fixture writes.
"""

import time

import cv2
import pytest
from paired import measure
from pytest_benchmark.fixture import BenchmarkFixture
from reference import Reference
from subjects import KERNELS, METHODS, method


@pytest.fixture(scope="module")
def reference() -> Reference:
    cv2.setNumThreads(1)
    return Reference()


@pytest.fixture
def rounds(request: pytest.FixtureRequest) -> int:
    return int(request.config.getoption("--benchmark-min-rounds"))


@pytest.mark.benchmark(timer=time.thread_time, disable_gc=True, group="method")
@pytest.mark.parametrize("name", METHODS)
def test_method(name: str, part: int, benchmark: BenchmarkFixture, reference: Reference, rounds: int) -> None:
    measure(benchmark, method(name), reference, rounds)


@pytest.mark.benchmark(timer=time.thread_time, disable_gc=True, group="kernel")
@pytest.mark.parametrize("name", KERNELS)
def test_kernel(name: str, part: int, benchmark: BenchmarkFixture, reference: Reference, rounds: int) -> None:
    measure(benchmark, KERNELS[name](), reference, rounds)
