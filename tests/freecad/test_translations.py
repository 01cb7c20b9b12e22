"""The files of translation belong to the texts in the code."""

import importlib.util
import struct
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

WORKBENCH = Path(__file__).resolve().parents[2] / "freecad_workbench"
SCRIPT = WORKBENCH / "update_translations.py"


def module():
    spec = importlib.util.spec_from_file_location("update_translations", SCRIPT)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_files_are_up_to_date():
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--check"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


def test_every_command_and_characteristic_is_marked():
    texts = set(module().marked_texts())
    assert ("CadSkin_Probe", "Probe value") in texts
    assert ("CadSkin", "surface profile") in texts
    assert ("CadSkin", "Symmetric") in texts


def test_messages_are_where_the_table_says():
    made = module()
    known = {("A", "one"): "eins", ("B", "one"): "Eins", ("A", "zwölf"): "12"}
    data = made.qm_bytes(known)
    assert data.startswith(made._MAGIC)
    length = struct.unpack_from(">I", data, 17)[0]
    rows = list(struct.iter_unpack(">II", data[21 : 21 + length]))
    assert rows == sorted(rows)
    assert len(rows) == 3
    messages = data[21 + length + 5 :]
    for value, offset in rows:
        assert value in {made.elf_hash(text.encode()) for _, text in known}
        assert messages[offset] == made._TRANSLATION


def test_icons_are_plain_drawings():
    icons = sorted((WORKBENCH / "freecad" / "CadSkin" / "resources" / "icons").glob("*.svg"))
    assert len(icons) >= 20
    for path in icons:
        root = ET.parse(path).getroot()
        assert root.get("viewBox") == "0 0 64 64", path.name
        assert not [node for node in root.iter() if node.tag.endswith(("image", "script", "metadata"))], (
            path.name
        )
