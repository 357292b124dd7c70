"""Remarks on what a file system does not offer: work goes on, and each is made once."""

import warnings

_made: set[str] = set()


def remark_once(text: str) -> None:
    """Warn, unless this process has said so before: of Python's own filters, libraries make that forget."""
    if text not in _made:
        _made.add(text)
        warnings.warn(text, stacklevel=3)
