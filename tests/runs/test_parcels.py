"""Cells that travel: what comes back is checked."""

import shutil
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
from places import METHODS, ROUGH

from matbench import comparison
from matbench.files.unzip import ArchiveError
from matbench.plans.settings import Settings
from matbench.runs import parcels

SMALL = "synthetic/box[size=96x72]"


def prepare(folder: Path, *algorithms: str, scene: str = SMALL, **settings: object) -> comparison.Comparison:
    return comparison.prepare(
        list(algorithms), scene, out=folder, plugin=[ROUGH, METHODS], settings=Settings(**settings)
    )


def test_what_comes_back_is_checked(tmp_path: Path) -> None:
    ready = prepare(tmp_path / "run", "flat", "noise")
    ready.run()
    store, (cell, other) = ready.store, ready.plan.cells
    whole = parcels.pack(store.cell(cell))
    before = (store.cell(other) / "cell.json").read_bytes()
    shutil.rmtree(store.cell(cell))
    for _ in range(2):  # a cell may come twice
        assert parcels.put(store, cell, whole).status == "ok"

    def parcel(**files: bytes) -> bytes:
        packed = BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for name, content in files.items():
                archive.writestr(name, content)
        return packed.getvalue()

    facts, maps = ((store.cell(cell) / name).read_bytes() for name in ("cell.json", "disparity.npz"))
    hostile = {
        "junk": b"junk",
        "nothing": parcel(),
        "half": whole[: len(whole) // 2],
        "another cell": parcels.pack(store.cell(other)),
        "no maps": parcel(**{"cell.json": facts}),
        "damaged maps": parcel(**{"cell.json": facts, "disparity.npz": maps[:99]}),
        "no facts": parcel(**{"cell.json": b"[]", "disparity.npz": maps}),
        "a folder": parcel(**{"cell.json": facts, "disparity.npz": maps, "sub/log.txt": b"x"}),
        "a bomb": parcel(**{"cell.json": facts, "disparity.npz": maps, "log.txt": b"x" * (2 << 20)}),
    }
    for name, sent in hostile.items():
        with pytest.raises(ArchiveError):
            parcels.put(store, cell, sent)
        assert store.outcome(cell) is not None, name
    outside = {"cell.json": facts, "disparity.npz": maps, "../../evil": b"x", "/evil": b"x", "evil.py": b"x"}
    parcels.put(store, cell, parcel(**outside))
    assert {p.name for p in store.cell(cell).iterdir()} == {"cell.json", "disparity.npz"}
    assert (store.cell(other) / "cell.json").read_bytes() == before
    assert {p.name for p in (tmp_path / "run" / "cells").iterdir()} == {cell.key, other.key}
