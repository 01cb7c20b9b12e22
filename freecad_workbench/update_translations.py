"""Collect the marked texts of the workbench into the ``.ts`` files, and compile those for Qt.

    python freecad_workbench/update_translations.py [--check]

A translation that is there stays; a new text is added as unfinished; one that is gone is dropped. ``--check``
changes nothing and ends with 1 where a file is not up to date. Only the standard library is needed: Qt's own
tools for Python are in no package that can be counted on.
"""

import argparse
import ast
import struct
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent / "freecad" / "CadSkin"
FOLDER = PACKAGE / "resources" / "translations"
LANGUAGES = ("de",)
_LISTS = ("PALETTES", "RANGE_MODES", "LEGEND_POSITIONS")
_MAGIC = bytes.fromhex("3cb86418caef9c95cd211cbf60a1bddd")
_HASHES, _MESSAGES = 0x42, 0x69
_END, _TRANSLATION, _SOURCE, _CONTEXT, _COMMENT = 1, 3, 6, 7, 8


def marked_texts():
    """Return the (context, text) pairs of the code, the lists that are shown, and the preferences page."""
    found = set()
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in _LISTS:
                found.update(("CadSkin", text) for text in ast.literal_eval(node.value))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                words = [item.value for item in node.args if isinstance(item, ast.Constant)]
                if node.func.id == "QT_TRANSLATE_NOOP" and len(words) == 2:
                    found.add((words[0], words[1]))
                elif node.func.id == "Characteristic" and words:
                    found.add(("CadSkin", words[0].replace("_", " ")))
                elif node.func.id == "translate" and len(words) == 1 == len(node.args):
                    found.add(("CadSkin", words[0]))
    for path in sorted(PACKAGE.rglob("*.ui")):
        root = ET.parse(path).getroot()
        context = root.findtext("class")
        texts = [item.text for item in root.iter("string") if item.text and item.get("notr") != "true"]
        found.update((context, text) for text in texts)
    return sorted(found)


def read_translations(path):
    """Return (context, text) -> translation of a ``.ts`` file."""
    if not path.exists():
        return {}
    known = {}
    for context in ET.parse(path).getroot().iter("context"):
        for message in context.iter("message"):
            text = message.findtext("translation")
            if text:
                known[(context.findtext("name"), message.findtext("source"))] = text
    return known


def ts_text(language, texts, known):
    """Return the content of a ``.ts`` file."""
    root = ET.Element("TS", version="2.1", language=language, sourcelanguage="en")
    for name in sorted({context for context, _ in texts}):
        context = ET.SubElement(root, "context")
        ET.SubElement(context, "name").text = name
        for text in [text for other, text in texts if other == name]:
            message = ET.SubElement(context, "message")
            ET.SubElement(message, "source").text = text
            translation = ET.SubElement(message, "translation")
            translation.text = known.get((name, text))
            if not translation.text:
                translation.set("type", "unfinished")
    ET.indent(root, " ")
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n'
        + ET.tostring(root, encoding="unicode")
        + "\n"
    )


def elf_hash(data):
    """Return the hash by which Qt finds a message."""
    value = 0
    for byte in data:
        value = (value << 4) + byte
        high = value & 0xF0000000
        value = (value ^ (high >> 24)) & ~high & 0xFFFFFFFF
    return value or 1


def qm_bytes(known):
    """Return the content of a ``.qm`` file: Qt's messages behind a table of hashes."""
    messages, table = b"", []
    for (context, text), translation in sorted(known.items()):
        table.append((elf_hash(text.encode("utf-8")), len(messages)))
        messages += _field(_TRANSLATION, translation.encode("utf-16-be")) + _field(_COMMENT, b"")
        messages += _field(_SOURCE, text.encode("utf-8")) + _field(_CONTEXT, context.encode("utf-8"))
        messages += bytes([_END])
    hashes = b"".join(struct.pack(">II", *row) for row in sorted(table))
    return _MAGIC + _field(_HASHES, hashes) + _field(_MESSAGES, messages)


def _field(tag, data):
    return struct.pack(">BI", tag, len(data)) + data


def main():
    """Write the files, or check them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="change nothing, end with 1 where something is old"
    )
    check = parser.parse_args().check
    texts, old = marked_texts(), []
    for language in LANGUAGES:
        path = FOLDER / f"CadSkin_{language}.ts"
        known = {key: text for key, text in read_translations(path).items() if key in set(texts)}
        wanted = {
            path: ts_text(language, texts, known).encode("utf-8"),
            path.with_suffix(".qm"): qm_bytes(known),
        }
        for target, content in wanted.items():
            if not target.exists() or target.read_bytes() != content:
                old.append(target.name)
                if not check:
                    target.write_bytes(content)
        print(f"{language}: {len(known)} of {len(texts)} texts are translated")  # noqa: T201
    if check and old:
        print(f"not up to date: {', '.join(old)}; run {Path(__file__).name}")  # noqa: T201
    return 1 if check and old else 0


if __name__ == "__main__":
    sys.exit(main())
