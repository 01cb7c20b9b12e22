"""PNG from an array, with zlib alone."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

__all__ = ["encode_png"]


def encode_png(pixels: NDArray[np.uint8], *, text: Mapping[str, str] | None = None) -> bytes:
    r"""Return the bytes of a PNG file.

    Parameters
    ----------
    pixels : (height, width, 3) uint8
        sRGB.
    text : mapping of str to str, optional
        Keywords and Latin-1 texts for ``tEXt`` chunks (``Title``, ``Software``).

    References
    ----------
    W3C, Portable Network Graphics (PNG) Specification, third edition, sections 5, 9 (filters), 11.

    Examples
    --------
    >>> encode_png(np.zeros((2, 3, 3), dtype=np.uint8))[:8]
    b'\x89PNG\r\n\x1a\n'
    """
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels, dtype=np.uint8).reshape(height, width * 3)
    # Filter type 1 ("sub"): the difference to the pixel on the left compresses well for smooth pictures.
    filtered = np.ones((height, 1 + width * 3), dtype=np.uint8)
    filtered[:, 1:4] = rows[:, :3]
    filtered[:, 4:] = rows[:, 3:] - rows[:, :-3]
    chunks = [_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), _chunk(b"sRGB", b"\0")]
    for key, value in (text or {}).items():
        chunks.append(_chunk(b"tEXt", key.encode("latin-1") + b"\0" + value.encode("latin-1", "replace")))
    chunks += [_chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)), _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
