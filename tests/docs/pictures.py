#!/usr/bin/env python3
"""Claim: docs/scenarios.md names every shipped scenario in a heading, and under each heading that names some there are
commands that run one of them and draw a picture, which is there, small, and shown.

usage: pictures.py SOURCE [GRAZE --write [NAME ...]]: --write draws the pictures anew, or those of these names."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

LARGEST = 60_000  # bytes
PAGE = "docs/scenarios.md"
SECTION = re.compile(r"^### (?P<heading>`[^\n]*)\n(?P<text>.*?)(?=^##|\Z)", re.MULTILINE | re.DOTALL)


def sections(page):
    """(names, commands, picture) of each."""
    for one in SECTION.finditer(page):
        commands = re.search(r"```sh\n(.*?)```", one["text"], re.DOTALL)
        shown = re.search(r"^!\[[^\]]+\]\((scenarios/[^)]+)\)$", one["text"], re.MULTILINE)
        yield re.findall(r"`([^`]+)`", one["heading"]), commands[1] if commands else "", shown[1] if shown else ""


def faults(source):
    page = (source / PAGE).read_text(encoding="utf-8")
    named = []
    for names, commands, picture in sections(page):
        named += names
        where = f"{PAGE}: {', '.join(names)}"
        if not re.search(rf"^graze run {names[0]}\b", commands, re.MULTILINE):
            yield f"{where}: no command runs {names[0]}"
        if picture != f"scenarios/{names[0]}.png" or f"-o {names[0]}.png" not in commands:
            yield f"{where}: shows no picture {names[0]}.png, or no command draws it"
            continue
        file = source / "docs" / picture
        if not file.is_file():
            yield f"{where}: {picture} is not there; --write draws it"
        elif file.stat().st_size > LARGEST:
            yield f"{where}: {picture} has {file.stat().st_size} bytes; at most {LARGEST}"
    shipped = {file.stem for file in (source / "data/scenarios").glob("*.yaml")}
    yield from (f"{PAGE}: no heading names {name}" for name in sorted(shipped - set(named)))
    yield from (f"{PAGE}: {name} is no shipped scenario" for name in sorted(set(named) - shipped))
    shown = {picture for _, _, picture in sections(page)}
    yield from (f"docs/scenarios/{file.name}: no page shows it" for file in sorted((source / "docs/scenarios").iterdir())
                if f"scenarios/{file.name}" not in shown)


def draw(source, graze, only):
    page = (source / PAGE).read_text(encoding="utf-8")
    for names, commands, picture in sections(page):
        if only and names[0] not in only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(graze, pathlib.Path(folder) / "graze")
            environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}", GRAZE_DATA=str(source / "data"))
            subprocess.run(["bash", "-ec", commands], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
            (source / "docs" / picture).write_bytes((pathlib.Path(folder) / f"{names[0]}.png").read_bytes())


def main():
    source = pathlib.Path(sys.argv[1]).resolve()
    if "--write" in sys.argv:
        draw(source, pathlib.Path(sys.argv[2]).resolve(), sys.argv[4:])
    wrong = list(faults(source))
    print("\n".join(wrong) if wrong else "every shipped scenario has its picture")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
