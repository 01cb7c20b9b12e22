"""What an evaluation needs of the nominal part alone: looked up once, however many made parts follow."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from cadskin.errors import GeometryError, SelectionError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints
    from cadskin.shape import Feature, NominalModel

__all__ = ["Memory", "PartGeometry"]

_Result = TypeVar("_Result")
_KEPT = 4  # results per key: datum B of A|B and of C|B are different associations


@dataclass(frozen=True, eq=False)
class Memory:
    """The last results of functions of arrays: the same arrays again give the same result without work.

    Parameters
    ----------
    results : dict
        Key -> the last few (arrays, result).
    """

    results: dict[Hashable, deque[tuple[tuple[Floats | None, ...], Any]]] = field(default_factory=dict)

    def recall(
        self, key: Hashable, arrays: Sequence[Floats | None], compute: Callable[[], _Result]
    ) -> _Result:
        """Return the result for these very arrays, computed at most once while it is remembered.

        Parameters
        ----------
        key : hashable
            Names the function and everything else that it depends on.
        arrays : sequence of array or None
            Compared bit by bit; never changed afterwards.
        compute : callable
        """
        known = self.results.setdefault(key, deque(maxlen=_KEPT))
        for seen, result in known:
            if len(seen) == len(arrays) and all(map(_same, seen, arrays)):
                return result  # type: ignore[no-any-return]
        found = compute()
        known.append((tuple(arrays), found))
        return found


def _same(one: Floats | None, other: Floats | None) -> bool:
    if one is None or other is None:
        return one is other
    return one is other or np.array_equal(one, other)


@dataclass(frozen=True, eq=False)
class PartGeometry:
    """Features, vertices, triangles and edges of the nominal part by B-rep faces, each worked out once.

    Parameters
    ----------
    nominal : NominalModel
    once : dict
        Results of the nominal part by key.
    """

    nominal: NominalModel
    once: dict[Hashable, Any] = field(default_factory=dict)

    def of_nominal(self, key: Hashable, compute: Callable[[], _Result]) -> _Result:
        """Return what depends on the nominal part only: computed once per key."""
        if key not in self.once:
            self.once[key] = compute()
        return self.once[key]  # type: ignore[no-any-return]

    def feature_of(self, face: int) -> Feature:
        """Return the feature of a B-rep face.

        Raises
        ------
        GeometryError
            There is no such face.
        """
        table = self.of_nominal("features", self._by_face)
        if face not in table:
            raise GeometryError(
                f"the part has no face {face}; it has faces 0 to {len(self.nominal.faces) - 1}"
            )
        return table[face]

    def _by_face(self) -> dict[int, Feature]:
        return {face: feature for feature in self.nominal.features for face in feature.face_indices}

    def features(self, faces: Sequence[int]) -> tuple[Feature, ...]:
        """Return the features of faces, each once."""
        return tuple(dict.fromkeys(self.feature_of(face) for face in faces))

    def indices(self, faces: Sequence[int]) -> tuple[int, ...]:
        """Return the faces of the features of faces."""
        return tuple(index for feature in self.features(faces) for index in feature.face_indices)

    def vertex_ids(self, faces: Sequence[int]) -> Ints:
        """Return the vertices (k,) of the features of faces, in order."""
        features = self.features(faces)
        key = ("vertices", *(feature.id for feature in features))
        return self.of_nominal(
            key, lambda: np.unique(np.concatenate([feature.vertex_ids for feature in features]))
        )

    def triangles(self, faces: Sequence[int]) -> Ints:
        """Return the triangles (t, 3) of the features of faces, in the order of the mesh."""
        features = self.features(faces)
        key = ("triangles", *(feature.id for feature in features))

        def found() -> Ints:
            ids = np.sort(np.concatenate([feature.triangle_ids for feature in features]))
            if not len(ids):
                raise SelectionError(f"the mesh has no triangle with the labels {self.indices(faces)}")
            return np.asarray(self.nominal.surface.triangles[ids])

        return self.of_nominal(key, found)

    def edges(self, faces: Sequence[int]) -> Ints:
        """Return the mesh edges (e, 2) of the features of faces, each once."""
        key = ("edges", *(feature.id for feature in self.features(faces)))
        return self.of_nominal(key, lambda: edges_of(self.triangles(faces)))


def edges_of(triangles: Ints) -> Ints:
    """Return the edges (e, 2) of triangles, each once."""
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.asarray(np.unique(sides, axis=0))
