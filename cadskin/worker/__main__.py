"""``python -m cadskin.worker FOLDER`` or ``python -m cadskin.worker --serve``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one job, or serve a client; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m cadskin.worker", description="Worker of the FreeCAD workbench."
    )
    parser.add_argument("folder", nargs="?", type=Path, help="job folder with request.json")
    parser.add_argument("--serve", action="store_true", help="take jobs from standard input until it closes")
    parser.add_argument("--watch-stdin", action="store_true", help="end when standard input closes")
    parser.add_argument("--idle", type=float, default=1800.0, help="seconds without a job until --serve ends")
    given = parser.parse_args(arguments)
    if given.serve == (given.folder is not None):
        parser.error("give a job folder or --serve")

    from cadskin.worker.channel import Channel, private_output
    from cadskin.worker.parts import PartMemory
    from cadskin.worker.serve import Client, run_job, serve

    channel = Channel(private_output())
    client = Client()
    if given.serve:
        return serve(channel, client.start(), idle=given.idle)
    if given.watch_stdin:
        client.start()
    return 0 if run_job(given.folder, channel, client, PartMemory()) else 1


if __name__ == "__main__":
    sys.exit(main())
