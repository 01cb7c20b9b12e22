"""Which compiled kernels lie in the cache, found without numba: a first command compiles the others."""

from __future__ import annotations

import os
import sys
from pathlib import Path

__all__ = ["KERNELS", "kernels_to_compile"]

# What is compiled at its first use -> (module, function) whose cache file tells that it has been.
KERNELS = {
    "meshing": ("cad/meshing/kernel", "remesh_arrays"),
    "fields": ("deviation/_philox", "_fill"),
    "checks": ("shape/intersections", "_tree_pairs"),
    "pictures": ("view/raster", "fill_triangles"),
}


def kernels_to_compile(*names: str) -> tuple[str, ...]:
    """Return which of the compiled kernels are in none of numba's cache folders, all kinds by default.

    Parameters
    ----------
    *names : str
        Keys of `KERNELS`: ``meshing``, ``fields``, ``checks``, ``pictures``.

    Notes
    -----
    After an update of cadskin a cached one may be old; numba then compiles it again.
    """
    return tuple(name for name in names or KERNELS if not _is_cached(*KERNELS[name]))


def _is_cached(module: str, function: str) -> bool:
    place = Path(__file__).resolve().parent / module
    own = os.environ.get("NUMBA_CACHE_DIR")
    folders = [Path(own)] if own else [place.parent / "__pycache__", _numba_home()]
    pattern = f"{place.name}.{function}-*.nbi"
    return any(True for folder in folders for _ in folder.rglob(pattern))


def _numba_home() -> Path:
    """Return numba's cache folder for packages that lie in a folder that cannot be written."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "numba"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "numba"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "numba"
