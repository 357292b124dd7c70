"""Downloading scenes from the sites that publish them. A file is put in its place whole, after a check.

While a scene is fetched, its folder holds a folder ``.fetch`` with what has come so far. If two
processes fetch the same scene, the second waits for the first, by a lock in ``.fetch`` in the data root.
"""

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cached_property
from hashlib import file_digest
from math import inf
from pathlib import Path, PurePosixPath
from typing import Literal
from urllib.parse import quote, urlsplit

from attrs import define, field, frozen

from matbench.errors import UserError, cause
from matbench.files.locking import Busy, held
from matbench.files.remarks import remark_once
from matbench.files.transfer import PATIENCE, NoAnswer, Patience, TransferError, download
from matbench.files.unzip import ArchiveError, members, opened, unpack
from matbench.files.writing import move, settle
from matbench.scenes.dataset import Download, Remote

Event = Literal["scene", "waiting", "bytes"]
Listener = Callable[[Event, str, int, int | None], None]
"""Called with the event, then the scene (or the URL, for "bytes"), then the bytes so far and in all, if known."""

_MISMATCH = "is not the published picture"

SILENT = 2
"""After so many files in a row without an answer, a site is given up."""


@frozen
class Result:
    """What became of one scene.

    Parameters
    ----------
    came, there
        Names of the files that were downloaded now, and of those that were there already.
    missing
        Names of the files that are still not there.
    reasons
        Why they are missing, one line each.
    bytes
        How much was downloaded; parts that an earlier, interrupted fetch left are counted, too.
    """

    download: Download
    folder: Path
    came: tuple[str, ...]
    there: tuple[str, ...]
    missing: tuple[str, ...]
    reasons: tuple[str, ...]
    bytes: int

    @property
    def urls(self) -> tuple[str, ...]:
        """Where the official site has what is missing: archives, and folders of single files."""
        return tuple(self.download.site + source for source in self.download.sources)


class _Stop(Exception):
    """Why every further file would fail in the same way."""


def site_of(mirror: str) -> str:
    """A mirror's URL, checked, with the slash at its end.

    Raises
    ------
    UserError
        If it is not one of http or https.
    """
    if not _is_site(mirror):
        raise UserError(f"mirror {mirror!r} is no address: write http://HOST/PATH/ or https://HOST/PATH/")
    return mirror.rstrip("/") + "/"


def _is_site(mirror: str) -> bool:
    try:
        parts = urlsplit(mirror)
        parts.hostname and parts.hostname.encode("idna")
        parts.port  # noqa: B018
    except ValueError:  # brackets without an end, a port that is no number, a part of a name that is too long
        return False
    return parts.scheme in ("http", "https") and bool(parts.hostname) and not (parts.query or parts.fragment)


def fetch(
    downloads: Sequence[Download],
    root: Path,
    *,
    mirror: str | None = None,
    patience: Patience = PATIENCE,
    listen: Listener = lambda *_: None,
) -> Iterator[Result]:
    """Download scenes, one after the other, and yield what became of each.

    Parameters
    ----------
    root
        The data root; it is made if it is missing.
    mirror
        URL that takes the place of every scene's own site.
    """
    line = _Line(patience, listen)
    stopped = ""
    for one in downloads:
        job = _Job(one, root, mirror or one.site, line)
        listen("scene", one.name, 0, None)
        try:
            if stopped:
                job.look()
                job.reasons.append(stopped)
            else:
                job.run()
        except _Stop as stop:
            stopped = f"not tried: {stop}"
            job.reasons.append(str(stop))
        yield job.result


def look(downloads: Sequence[Download], root: Path) -> Iterator[Result]:
    """As `fetch`, but only look which files are there; nothing is downloaded or written."""
    for one in downloads:
        job = _Job(one, root, one.site, _Line(PATIENCE, lambda *_: None))
        job.look()
        yield job.result


@define
class _Line:
    """The connection to the sites: how patient it is, and how long it has been silent."""

    patience: Patience
    listen: Listener
    silent: int = 0
    bytes: int = 0

    def bring(self, url: str, target: Path, limit: int) -> bool:
        """As `transfer.download`, but gives up a site that stays silent."""
        so_far = 0

        def listen(count: int, total: int | None) -> None:
            nonlocal so_far
            so_far = count
            self.listen("bytes", url, count, total)

        try:
            resumed = download(url, target, limit, self.patience, listen)
        except NoAnswer as error:
            self.silent += 1
            if self.silent >= SILENT:
                raise _Stop(f"{urlsplit(url).netloc} does not answer: {error}") from error
            raise
        except TransferError:
            self.silent = 0
            raise
        self.silent = 0
        self.bytes += so_far
        return resumed


@define(slots=False)
class _Job:
    """One scene while it is fetched."""

    download: Download
    root: Path
    site: str
    line: _Line
    there: dict[str, str] = field(factory=dict)  # file of the registry -> as what it lies there
    came: dict[str, str] = field(factory=dict)
    blocked: dict[str, str] = field(factory=dict)  # file of the registry -> what lies in its place
    reasons: list[str] = field(factory=list)
    bytes: int = 0

    @cached_property
    def folder(self) -> Path:
        return self.root / self.download.folder

    @cached_property
    def stage(self) -> Path:
        return self.folder / ".fetch"

    @property
    def missing(self) -> list[Remote]:
        return [f for f in self.download.files if f.name not in {*self.there, *self.came, *self.blocked}]

    @property
    def result(self) -> Result:
        missing = [f.name for f in self.download.files if f.name not in {*self.there, *self.came}]
        return Result(
            self.download,
            self.folder,
            tuple(self.came.values()),
            tuple(self.there.values()),
            tuple(missing),
            (*self.blocked.values(), *self.reasons) if missing else (),
            self.bytes,
        )

    def run(self) -> None:
        """Bring what is missing, from one source after the other."""
        before = self.line.bytes
        try:
            self.look()
            if self.missing:
                with self._locked():
                    self.look()  # another fetch may have brought some meanwhile
                    if self.missing:
                        self._bring()
        except OSError as error:
            raise _Stop(_in_words(error, self.root)) from error
        finally:
            self.bytes = self.line.bytes - before

    def _bring(self) -> None:
        self.stage.mkdir(parents=True, exist_ok=True)
        try:
            for source in self.download.sources:
                if self.missing:
                    url = self.site + quote(source)
                    (self._from_folder if source.endswith("/") else self._from_archive)(url)
        finally:
            self._tidy()

    @contextmanager
    def _locked(self) -> Iterator[None]:
        locks = self.root / ".fetch"
        locks.mkdir(parents=True, exist_ok=True)
        lock = locks / f"{quote(str(self.download.folder), safe='')}.lock"
        with ExitStack() as stack:
            try:
                taken = stack.enter_context(held(lock))
            except Busy:
                self.line.listen("waiting", self.download.name, 0, None)
                taken = stack.enter_context(held(lock, patience=inf))
            if not taken:
                remark_once(f"nothing can be locked under {self.root}: start no second fetch there meanwhile")
            yield

    def _tidy(self) -> None:
        """Leave only parts that can be gone on with while files are missing, and no empty folder."""
        for path in self.stage.iterdir():
            if not (self.missing and path.suffix in (".part", ".zip") and path.stat().st_size):
                path.unlink()
        for folder in (self.stage, self.folder):
            if not any(folder.iterdir()):
                folder.rmdir()

    def look(self) -> None:
        """See what is there already."""
        for file in self.download.files:
            found = [name for name in file.names if os.path.lexists(self.folder / name)]
            wrong = [name for name in found if not _is(file, self.folder / name)]
            if wrong:
                what = "a folder" if (self.folder / wrong[0]).is_dir() else "not the published file"
                self.blocked[file.name] = f"{self.folder / wrong[0]} is {what}: move it away, then fetch again"
            elif found:
                self.there[file.name] = found[0]

    def _from_folder(self, url: str) -> None:
        for file in self.missing:
            problems = []
            for name in (*file.names, *file.offered_as):
                problems.append(self._single(file, url + quote(name), self.stage / name))
                if file.name in self.came:
                    break
            else:
                self.reasons.append(max(problems, key=lambda problem: _MISMATCH in problem))

    def _single(self, file: Remote, url: str, path: Path) -> str:
        """Place a file that lies alone at `url`; what is wrong if it could not be."""
        resumed = True
        while resumed:  # a part that came earlier may be of another file
            try:
                resumed = self.line.bring(url, path, _most(file))
            except TransferError as error:
                return f"{url}: {error}"
            if _is(file, path):
                self._place(file, path, path.name)
                return ""
            path.unlink()
        return f"{url}: {_MISMATCH}"

    def _from_archive(self, url: str) -> None:
        """Place what is missing and in the archive at `url`."""
        path = self.stage / url.rpartition("/")[2]
        resumed, problem = True, ""
        while resumed and self.missing:  # a part that came earlier may be of another archive
            try:
                resumed = self.line.bring(url, path, sum(map(_most, self.download.files)))
                problem = self._unpack(path)
            except TransferError as error:
                resumed, problem = False, str(error)
            except ArchiveError as error:
                problem = str(error)
            path.unlink(missing_ok=True)
        if problem:
            self.reasons.append(f"{url}: {problem}")

    def _unpack(self, path: Path) -> str:
        """Place what is missing and in the archive; what is wrong with the rest."""
        problems: list[str] = []
        absent: list[str] = []
        left = sum(map(_most, self.download.files))
        draft = self.stage / "unpacked"
        with opened(path) as archive:
            for file in self.missing:
                found = members(archive, (*file.names, *file.offered_as))
                for info in found:
                    draft.unlink(missing_ok=True)
                    try:
                        left -= unpack(archive, info, draft, min(left, _most(file)))
                    except ArchiveError as error:
                        problems.append(str(error))
                        continue
                    if _is(file, draft):
                        self._place(file, draft, PurePosixPath(info.filename).name)
                        break
                    problems.append(f"{info.filename} {_MISMATCH}")
                if not found:
                    absent.append(file.name)
        if absent:
            problems.append(f"holds no plain file {', '.join(absent)}")
        return "; ".join(problems)

    def _place(self, file: Remote, path: Path, name: str) -> None:
        """Move a checked file that was offered as `name` to its place."""
        if name not in file.names:
            name = PurePosixPath(file.name).stem + PurePosixPath(name).suffix
        with path.open("rb+") as written:
            settle(written.fileno())
        move(path, self.folder / name)
        self.came[file.name] = name


def _most(file: Remote) -> int:
    """Most bytes of a file that holds the same picture in another format."""
    return 4 * file.bytes + (1 << 20)


def _is(file: Remote, path: Path) -> bool:
    """Are these the bytes of the file, or is it the same picture in another format?"""
    if not path.is_file():
        return False
    with path.open("rb") as content:
        digest = file_digest(content, "sha256").hexdigest()
    return digest == file.sha256 or file.holds(path)


def _in_words(error: OSError, root: Path) -> str:
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        free = shutil.disk_usage(root).free if root.exists() else 0
        return f"there is no space left under {root} ({free / 1e6:.1f} MB free): make some, then fetch again"
    return f"{error.filename or root} cannot be used: {cause(error)}"
