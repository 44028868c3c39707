"""Claim: docs/graze.ipynb runs from top to bottom, and comes out as it stands there.

Usage: notebook.py SOURCE PACKAGES GRAZE [--write]: the folder that holds the package with its compiled module; the program.
--write renews what stands there.
"""
import os
import pathlib
import re
import sys
import tempfile

import nbformat
from nbclient import NotebookClient

SOURCE, PACKAGES, PROGRAM = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
NOTEBOOK = SOURCE / "docs/graze.ipynb"
SECONDS = 300  # for one cell


def run(notebook):
    os.environ.update(GRAZE=str(PROGRAM), PYTHONPATH=str(PACKAGES), PYDEVD_DISABLE_FILE_VALIDATION="1")
    with tempfile.TemporaryDirectory(prefix="graze-notebook-") as folder:
        os.environ.update(IPYTHONDIR=folder, JUPYTER_RUNTIME_DIR=folder)  # of nobody's own settings
        NotebookClient(notebook, timeout=SECONDS, kernel_name="python3", record_timing=False,
                       resources={"metadata": {"path": folder}}).execute()  # raises what a cell raises


def outputs(cell):
    """(text, pictures) of a cell."""
    data = [one.get("data", {}) for one in cell.get("outputs", [])]
    printed = [one["text"] for one in cell.get("outputs", []) if "text" in one]
    text = "\n".join(printed + [one.get("text/plain", "") for one in data])
    return re.sub(r"0x[0-9a-f]+", "0x…", text), sum("image/png" in one for one in data)


def main():
    stored, fresh = nbformat.read(NOTEBOOK, 4), nbformat.read(NOTEBOOK, 4)
    run(fresh)
    if "--write" in sys.argv:
        nbformat.write(fresh, NOTEBOOK)
        return 0
    faults, pictures = 0, 0
    for number, (old, new) in enumerate(zip(stored.cells, fresh.cells), 1):
        pictures += outputs(new)[1]
        if outputs(old) != outputs(new):
            faults += 1
            print(f"{NOTEBOOK}: cell {number} says\n{outputs(old)[0]}\nand comes out as\n{outputs(new)[0]}\n"
                  "--write renews it", file=sys.stderr)
    if pictures == 0:
        faults += 1
        print(f"{NOTEBOOK}: has no picture", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
