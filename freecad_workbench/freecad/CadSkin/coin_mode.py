"""The display mode "Deviation": crisp colours per face, any exaggeration, drawn by Coin.

Every pair of mesh vertex and B-rep face has a vertex of its own (`split_mesh`), with its deviation as texture
coordinate into a strip of the 256 colours of the palette. So colours and light end at the edges, bands have
sharp borders inside the triangles, and another range or palette changes four numbers or 256 colours, however
large the mesh is.
"""

from __future__ import annotations

import numpy as np
from pivy import coin

from .colormap import ColorMap
from .result import SkinResult
from .split_mesh import SplitMesh, split_mesh, vertex_normals

__all__ = ["MODE_NAME", "DeviationMode"]

MODE_NAME = "Deviation"
_TEXTURE_ROWS = 2


class DeviationMode:
    """The scene of the display mode of one skin object; `root` goes to ``addDisplayMode``."""

    def __init__(self) -> None:
        self._split: SplitMesh | None = None
        self._result: SkinResult | None = None
        self._scale = coin.SoTexture2Transform()
        self._texture = coin.SoTexture2()
        self._texture_points = coin.SoTextureCoordinate2()
        self._coordinates = coin.SoCoordinate3()
        self._normals = coin.SoNormal()
        self._faces = coin.SoIndexedFaceSet()
        self._lines = coin.SoIndexedLineSet()
        self.root = self._build()

    def _build(self) -> coin.SoSeparator:
        surface = coin.SoSeparator()
        hints = coin.SoShapeHints()
        hints.vertexOrdering = coin.SoShapeHints.COUNTERCLOCKWISE
        hints.shapeType = coin.SoShapeHints.UNKNOWN_SHAPE_TYPE
        hints.faceType = coin.SoShapeHints.CONVEX
        material = coin.SoMaterial()
        # Half of the light comes from the surface itself: the colours must be recognised in the legend.
        material.diffuseColor = (0.6, 0.6, 0.6)
        material.emissiveColor = (0.42, 0.42, 0.42)
        material.specularColor = (0.0, 0.0, 0.0)
        quality = coin.SoComplexity()
        quality.textureQuality = 0.1  # the nearest of the 256 colours: no blending over the border of a band
        self._texture.wrapS = coin.SoTexture2.CLAMP
        self._texture.wrapT = coin.SoTexture2.CLAMP
        self._texture.model = coin.SoTexture2.MODULATE
        bindings = (coin.SoNormalBinding(), coin.SoTextureCoordinateBinding())
        bindings[0].value = coin.SoNormalBinding.PER_VERTEX_INDEXED
        bindings[1].value = coin.SoTextureCoordinateBinding.PER_VERTEX_INDEXED
        offset = coin.SoPolygonOffset()
        for node in (
            hints,
            material,
            quality,
            self._scale,
            self._texture,
            self._texture_points,
            self._normals,
            *bindings,
            offset,
            self._faces,
        ):
            surface.addChild(node)
        root = coin.SoSeparator()
        root.addChild(self._coordinates)
        root.addChild(surface)
        root.addChild(self._edges())
        return root

    def _edges(self) -> coin.SoSeparator:
        edges = coin.SoSeparator()
        light = coin.SoLightModel()
        light.model = coin.SoLightModel.BASE_COLOR
        color = coin.SoBaseColor()
        color.rgb = (0.12, 0.12, 0.14)
        style = coin.SoDrawStyle()
        style.lineWidth = 1.5
        unpickable = coin.SoPickStyle()
        unpickable.style = coin.SoPickStyle.UNPICKABLE
        for node in (light, color, style, unpickable, self._lines):
            edges.addChild(node)
        return edges

    @property
    def split(self) -> SplitMesh | None:
        """The mesh that is drawn; None before the first result."""
        return self._split

    def show(self, result: SkinResult, instance: int, exaggeration: float) -> None:
        """Draw one instance of a result, its deviation enlarged."""
        if self._result is not result:
            self._set_topology(result)
        split = self._split
        points = result.instance_points(instance, exaggeration=exaggeration).astype(np.float32)
        points = points[split.vertex_ids]
        _set_values(self._coordinates.point, points)
        _set_values(self._normals.vector, vertex_normals(points, split.triangles))
        texture_points = np.full((split.n_vertices, 2), 0.5, dtype=np.float32)
        texture_points[:, 0] = split.values(result.corner_deviation[instance])
        _set_values(self._texture_points.point, texture_points)

    def clear(self) -> None:
        """Draw nothing."""
        self._result = self._split = None
        for field in (self._faces.coordIndex, self._lines.coordIndex, self._coordinates.point):
            field.setNum(0)

    def color(self, colors: ColorMap) -> None:
        """Use another range, palette or number of bands."""
        scale, shift = colors.texture_transform()
        self._scale.scaleFactor = (scale, 1.0)
        self._scale.translation = (shift, 0.0)
        row = colors.colors().tobytes()
        size = coin.SbVec2s(len(row) // 3, _TEXTURE_ROWS)
        self._texture.image.setValue(size, 3, row * _TEXTURE_ROWS)

    def _set_topology(self, result: SkinResult) -> None:
        split = split_mesh(result.triangles, result.triangle_face, result.n_points)
        self.clear()
        self._split, self._result = split, result
        _set_values(self._coordinates.point, np.zeros((split.n_vertices, 3), dtype=np.float32))
        _set_values(self._faces.coordIndex, _indexed(split.triangles))
        _set_values(self._lines.coordIndex, _indexed(split.border))


def _indexed(elements: np.ndarray) -> np.ndarray:
    """Return elements as one list of vertices with -1 after each."""
    ended = np.full((len(elements), elements.shape[1] + 1), -1, dtype=np.int32)
    ended[:, :-1] = elements
    return ended.ravel()


def _set_values(field: coin.SoMField, values: np.ndarray) -> None:
    """Replace all values of a field; pivy reads contiguous arrays without a detour over lists."""
    field.setNum(len(values))
    if len(values):
        field.setValues(0, len(values), np.ascontiguousarray(values))
