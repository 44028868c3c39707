#!/usr/bin/env python3
"""tables.py SOURCE GRAZE [--write]: the tables of docs/ and data/scenario.schema.json against what the program's own
descriptions say; with --write they are renewed.

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; NAME is a kind of components ("policies") or one of them
("policy gait")."""

import pathlib
import re
import subprocess
import sys

MARKED = re.compile(r"(?P<begin><!-- table: (?P<name>[^\n]*?) -->\n)(?P<table>.*?)(?P<end><!-- end -->)", re.DOTALL)


def told(graze, topic):
    run = subprocess.run([graze, "help", topic], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"graze help {topic}: {run.stderr}")
    return run.stdout


def main():
    source, graze, write = pathlib.Path(sys.argv[1]), sys.argv[2], "--write" in sys.argv[3:]
    pages = {page: page.read_text() for page in sorted((source / "docs").glob("*.md"))}
    names = [match["name"] for text in pages.values() for match in MARKED.finditer(text)]
    new = {
        page: MARKED.sub(lambda m: m["begin"] + told(graze, "table:" + m["name"]) + m["end"], text)
        for page, text in pages.items()
    }
    schema = source / "data/scenario.schema.json"
    pages[schema], new[schema] = schema.read_text(), told(graze, "schema")
    stale = [page for page in pages if pages[page] != new[page]]
    for page in stale:
        if write:
            page.write_text(new[page])
        print(f"{page.relative_to(source)}: {'renewed' if write else 'is not what the program describes'}")
    if stale and not write:
        sys.exit("tests/docs/tables.py SOURCE GRAZE --write renews them")
    print(f"{len(names)} tables: {', '.join(names)}")
    return 0 if names else 1


if __name__ == "__main__":
    sys.exit(main())
