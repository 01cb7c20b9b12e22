"""One home for the type aliases (shapes are in the comments, units are mm and rad)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]  # any shape
Points: TypeAlias = NDArray[np.float64]  # (n, 3) mm
Vectors: TypeAlias = NDArray[np.float64]  # (n, 3), unit length where they are normals or directions
Ints: TypeAlias = NDArray[np.int64]  # any shape
Triangles: TypeAlias = NDArray[np.int64]  # (m, 3)
Bools: TypeAlias = NDArray[np.bool_]
RNGLike: TypeAlias = "int | np.random.SeedSequence | np.random.BitGenerator | np.random.Generator | None"
Progress: TypeAlias = Callable[[int, int], Any]  # (done, total); returning False asks to stop
