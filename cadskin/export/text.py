"""Many numbers to text, quickly."""

from __future__ import annotations

from typing import Any, BinaryIO

from numpy.typing import NDArray

__all__ = ["write_rows"]

_CHUNK = 4096


def write_rows(stream: BinaryIO, template: str, rows: NDArray[Any]) -> None:
    r"""Write every row of ``rows`` (k, c) through a ``%`` template with c places.

    One formatting call serves thousands of rows, which is several times faster than one call per row.

    Examples
    --------
    >>> import io, numpy as np
    >>> stream = io.BytesIO()
    >>> write_rows(stream, "v %d %d\n", np.array([[1, 2], [3, 4]]))
    >>> stream.getvalue()
    b'v 1 2\nv 3 4\n'
    """
    whole = template * _CHUNK
    for start in range(0, len(rows), _CHUNK):
        chunk = rows[start : start + _CHUNK]
        text = whole if len(chunk) == _CHUNK else template * len(chunk)
        stream.write((text % tuple(chunk.ravel().tolist())).encode())
