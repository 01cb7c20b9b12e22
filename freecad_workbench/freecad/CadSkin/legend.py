"""The legend in the 3D view: part of the scene, so that it is in every picture that is saved of it."""

from __future__ import annotations

from pivy import coin

from .colormap import ColorMap
from .display import LEGEND_POSITIONS
from .legend_picture import LegendText, draw_legend
from .qt import QtGui

__all__ = ["Legend"]

_MARGIN = 14


class Legend:
    """A legend in a corner of every view of a document; `root` goes below the object's annotation node.

    It is drawn on top with a camera whose unit is the pixel, which a callback fits to the size of the
    view before each drawing.
    """

    def __init__(self) -> None:
        self._size = (1, 1)
        self._position = LEGEND_POSITIONS[0]
        self._viewport: tuple[int, int] = (0, 0)
        self._camera = coin.SoOrthographicCamera()
        self._place = coin.SoTranslation()
        self._texture = coin.SoTexture2()
        self._corners = coin.SoCoordinate3()
        self._texture_corners = coin.SoTextureCoordinate2()
        self._switch = coin.SoSwitch()
        self._drawing = coin.SoSwitch()
        self._callback = coin.SoCallback()
        self.root = self._build()

    def _build(self) -> coin.SoNode:
        self._callback.setCallback(self._before_each_action)
        self._camera.viewportMapping = coin.SoCamera.LEAVE_ALONE
        self._camera.nearDistance = -1.0
        self._camera.farDistance = 1.0
        light = coin.SoLightModel()
        light.model = coin.SoLightModel.BASE_COLOR
        depth = coin.SoDepthBuffer()
        depth.test = False
        depth.write = False
        color = coin.SoBaseColor()
        color.rgb = (1.0, 1.0, 1.0)
        unpickable = coin.SoPickStyle()
        unpickable.style = coin.SoPickStyle.UNPICKABLE
        quality = coin.SoComplexity()
        quality.textureQuality = 0.1  # pixel by pixel
        self._texture.model = coin.SoTexture2.REPLACE
        self._texture.wrapS = coin.SoTexture2.CLAMP
        self._texture.wrapT = coin.SoTexture2.CLAMP
        square = coin.SoFaceSet()
        square.numVertices.setValue(4)
        for node in (
            self._camera,
            light,
            depth,
            color,
            unpickable,
            quality,
            self._place,
            self._texture,
            self._texture_corners,
            self._corners,
            square,
        ):
            self._drawing.addChild(node)
        self._drawing.whichChild = coin.SO_SWITCH_NONE
        root = coin.SoSeparator()
        root.renderCaching = coin.SoSeparator.OFF
        root.boundingBoxCaching = coin.SoSeparator.OFF
        root.addChild(self._callback)
        root.addChild(self._drawing)
        self._switch.addChild(root)
        self._switch.whichChild = coin.SO_SWITCH_NONE
        return self._switch

    @property
    def visible(self) -> bool:
        """Whether it is drawn."""
        return self._switch.whichChild.getValue() == coin.SO_SWITCH_ALL

    def set_visible(self, visible: bool) -> None:
        """Draw it or not; the position ``Hidden`` has the last word."""
        shown = visible and self._position != "Hidden"
        self._switch.whichChild = coin.SO_SWITCH_ALL if shown else coin.SO_SWITCH_NONE

    def update(self, colors: ColorMap, text: LegendText, position: str) -> None:
        """Draw the picture anew and put it into a corner."""
        picture = draw_legend(colors, text, scale=_screen_scale())
        self._size = (picture.width(), picture.height())
        self._position = position if position in LEGEND_POSITIONS else LEGEND_POSITIONS[0]
        self._viewport = (0, 0)
        _fill_texture(self._texture, picture, self._texture_corners)
        width, height = self._size
        self._corners.point.setValues(0, 4, [(0, 0, 0), (width, 0, 0), (width, height, 0), (0, height, 0)])
        if self._position == "Hidden":
            self.set_visible(False)

    def _before_each_action(self, _data: object, action: coin.SoAction) -> None:
        """Be there for drawing only: the legend has no place in space, and must not count in its extent."""
        drawn = action.isOfType(coin.SoGLRenderAction.getClassTypeId())
        self._drawing.enableNotify(False)
        self._drawing.whichChild = coin.SO_SWITCH_ALL if drawn else coin.SO_SWITCH_NONE
        self._drawing.enableNotify(True)
        if not drawn:
            return
        pixels = coin.SoViewportRegionElement.get(action.getState()).getViewportSizePixels().getValue()
        viewport = (int(pixels[0]), int(pixels[1]))
        if viewport != self._viewport:
            self._viewport = viewport
            self._fit(*viewport)

    def _fit(self, width: int, height: int) -> None:
        """Make one unit one pixel and move the picture to its corner, without asking for another drawing."""
        left = _MARGIN if "left" in self._position else width - _MARGIN - self._size[0]
        bottom = _MARGIN if "Bottom" in self._position else height - _MARGIN - self._size[1]
        for node in (self._camera, self._place):
            node.enableNotify(False)
        self._camera.height = float(height)
        self._camera.aspectRatio = width / max(height, 1)
        self._camera.position = (width / 2.0, height / 2.0, 0.0)
        self._place.translation = (float(left), float(bottom), 0.0)
        for node in (self._camera, self._place):
            node.enableNotify(True)


def _screen_scale() -> float:
    screen = QtGui.QGuiApplication.primaryScreen() if hasattr(QtGui, "QGuiApplication") else None
    if screen is None:
        return 1.0
    return max(1.0, screen.logicalDotsPerInch() / 96.0) * screen.devicePixelRatio()


def _fill_texture(
    texture: coin.SoTexture2, picture: QtGui.QImage, texture_corners: coin.SoTextureCoordinate2
) -> None:
    """Put a picture into a texture whose sides are powers of two, as old OpenGL wants them."""
    width, height = (1 << (side - 1).bit_length() for side in (picture.width(), picture.height()))
    padded = picture.copy(0, picture.height() - height, width, height).mirrored()
    texture.image.setValue(coin.SbVec2s(width, height), 4, bytes(padded.constBits()))
    right, top = picture.width() / width, picture.height() / height
    texture_corners.point.setValues(0, 4, [(0, 0), (right, 0), (right, top), (0, top)])
