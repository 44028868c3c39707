"""Scenarios that come with Graze, by their names."""
from __future__ import annotations

import difflib
import os
import pathlib
import shutil
from typing import Optional, Union

from .errors import GrazeError

PathLike = Union[str, "os.PathLike[str]"]


def scenario_file(given: PathLike, program: Optional[PathLike] = None) -> pathlib.Path:
    """The file itself if it is there or names a folder, else the shipped scenario of that name. Raises GrazeError."""
    name = os.fspath(given)
    if os.sep in name or os.path.lexists(name):
        return pathlib.Path(name)
    data = data_folder(program)
    found = sorted((data / "scenarios").glob("*.yaml")) if data else []
    for file in found:
        if name in (file.name, file.stem):
            return file
    near = difflib.get_close_matches(name, [file.stem for file in found], 1)
    meant = f"; did you mean the shipped scenario '{near[0]}'?" if near else (
        "" if found else ", and no shipped scenarios were found; the environment variable GRAZE_DATA names their folder")
    raise GrazeError(2, f"{name}: there is no such file{meant}")


def data_folder(program: Optional[PathLike] = None) -> Optional[pathlib.Path]:
    """The first folder that has their folder `scenarios`: what GRAZE_DATA names, beside this package, beside the program."""
    told = os.environ.get("GRAZE_DATA")
    here = pathlib.Path(__file__).resolve().parent.parent  # share/graze/python, or jobs/python of the sources
    places = [pathlib.Path(told)] if told else [here.parent, here.parent.parent / "data"]
    found = shutil.which(os.fspath(program) if program is not None else os.environ.get("GRAZE", "graze"))
    if found and not told:
        root = pathlib.Path(found).resolve().parent.parent
        places += [root / "share" / "graze", root.parent / "data"]
    return next((place for place in places if (place / "scenarios").is_dir()), None)
