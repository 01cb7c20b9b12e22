"""The files of translation belong to the texts in the code."""

import importlib.util
import struct
import xml.etree.ElementTree as ET
from pathlib import Path

WORKBENCH = Path(__file__).resolve().parents[2] / "freecad_workbench"
SCRIPT = WORKBENCH / "update_translations.py"


def module():
    spec = importlib.util.spec_from_file_location("update_translations", SCRIPT)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_the_compiled_file_is_that_of_the_text_and_most_is_translated():
    made = module()
    texts = set(made.marked_texts())
    for language in made.LANGUAGES:
        path = made.FOLDER / f"CadSkin_{language}.ts"
        known = made.read_translations(path)
        assert path.with_suffix(".qm").read_bytes() == made.qm_bytes(known)
        assert len(texts & set(known)) > 0.9 * len(texts), "run freecad_workbench/update_translations.py"


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
