"""A scene to fetch, and where to."""

from functools import partial
from hashlib import sha256
from pathlib import Path

import pytest
from toy_downloads import FOLDER, PICTURES

from matbench.files.images import has_pixels, pixel_digests
from matbench.scenes import kept
from matbench.scenes.dataset import Download, Remote


@pytest.fixture
def toy(site, tmp_path: Path) -> Download:
    """A scene of four files; the site has nothing yet."""
    files = []
    for name, raw in PICTURES.items():
        (tmp_path / name).write_bytes(raw)
        pixels = next(iter(pixel_digests(tmp_path / name)))
        (tmp_path / name).unlink()
        also = (f"{Path(name).stem}.png",)
        files.append(Remote(name, len(raw), sha256(raw).hexdigest(), also, holds=partial(has_pixels, digest=pixels)))
    return Download("toys/box", FOLDER, tuple(files), site.url, ("zip/box.zip", "box/"))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "data"


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where scenes are kept in a test; there is room for 100 MiB of them."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv(kept.VARIABLE, "100")
    return tmp_path / "cache" / "matbench" / "scenes"
