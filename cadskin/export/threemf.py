"""3MF: the mesh as one object in millimetres, by the 3MF Core Specification 1.3."""

from __future__ import annotations

import zipfile
from typing import BinaryIO
from xml.sax.saxutils import escape, quoteattr

from cadskin.export.content import Content
from cadskin.export.text import write_rows
from cadskin.export.topology import is_closed

__all__ = ["write_3mf"]

_CONTENT_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>\n"
)
_RELATIONSHIPS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rel0" Target="/3D/3dmodel.model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
    "</Relationships>\n"
)
_FIXED_DATE = (1980, 1, 1, 0, 0, 0)  # equal shapes give equal bytes


def write_3mf(stream: BinaryIO, content: Content) -> None:
    """Write a 3MF package: content types, relationship, model.

    A closed mesh is an object of type ``model``; an open one is ``surface``, since the specification asks
    for closed meshes in ``model``. Coordinates have nine significant digits; labels and deviations have no
    place in the core specification.

    References
    ----------
    3MF Core Specification 1.3, sections 2 (package), 3.4 (model), 4.1 (mesh).
    """
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as package:
        package.writestr(_entry("[Content_Types].xml"), _CONTENT_TYPES)
        package.writestr(_entry("_rels/.rels"), _RELATIONSHIPS)
        with package.open(_entry("3D/3dmodel.model"), "w", force_zip64=True) as model:
            _write_model(model, content)  # type: ignore[arg-type]


def _entry(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, _FIXED_DATE)
    info.compress_type = zipfile.ZIP_DEFLATED
    return info


def _write_model(stream: BinaryIO, content: Content) -> None:
    kind = "model" if is_closed(content.triangles) else "surface"
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Title">{escape(_printable(content.name))}</metadata>\n'
        f'<metadata name="Application">{escape(content.provenance["generator"])}</metadata>\n'
        f'<resources>\n<object id="1" name={quoteattr(_printable(content.name))} type="{kind}">\n'
        "<mesh>\n<vertices>\n"
    )
    stream.write(head.encode())
    write_rows(stream, '<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', content.points + 0.0)
    stream.write(b"</vertices>\n<triangles>\n")
    write_rows(stream, '<triangle v1="%d" v2="%d" v3="%d"/>\n', content.triangles)
    stream.write(
        b'</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid="1"/>\n</build>\n</model>\n'
    )


def _printable(text: str) -> str:
    """Return ``text`` without the control characters that XML forbids."""
    return "".join(c for c in text if c.isprintable())
