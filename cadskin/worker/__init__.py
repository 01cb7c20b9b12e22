"""The worker of the FreeCAD workbench: ``python -m cadskin.worker``.

A job is a folder: ``part.brep`` and ``request.json`` in, ``skin.npz``, ``skin.ply`` and ``result.json`` out.
Messages are JSON lines on standard output, each with the id of its job. DESIGN.md, "The FreeCAD workbench",
has the contract.
"""

from __future__ import annotations

__all__ = ["PROTOCOL"]

PROTOCOL = 1  # of requests and messages; a client with another number is refused
