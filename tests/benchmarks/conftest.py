"""What `matbench bench` is told besides the times: whose code was measured, by which reference, and what failed."""

from pathlib import Path
from typing import Any

import pytest
from reference import digest

import matbench

_failed: dict[str, str] = {}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--subject", action="append", default=[], help="Time this one only; may be repeated.")
    parser.addoption("--parts", type=int, default=1, help="Time all subjects, and all again, so many times.")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "part" in metafunc.fixturenames:
        metafunc.parametrize("part", range(metafunc.config.getoption("--parts", 1)))


def _subject(item: Any) -> str | None:
    call = getattr(item, "callspec", None)
    return None if call is None else call.params.get("name")


def _part(item: Any) -> int:
    call = getattr(item, "callspec", None)
    return 0 if call is None else int(call.params.get("part", 0))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    wanted = config.getoption("--subject", [])
    if wanted:
        items[:] = [item for item in items if _subject(item) in wanted]
    if config.getoption("--parts", 1) > 1:
        items.sort(key=_part)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Any:
    report = yield
    name = _subject(item)
    if call.excinfo is not None and name is not None:
        lines = str(call.excinfo.value).splitlines() or [""]
        _failed[name] = f"{call.excinfo.typename}: {lines[0]}"
    return report


def pytest_benchmark_update_json(config: Any, benchmarks: Any, output_json: dict[str, Any]) -> None:
    output_json["measured"] = {
        "code": str(Path(matbench.__file__).resolve().parents[1]),
        "digest": digest(),
        "failed": _failed,
    }
