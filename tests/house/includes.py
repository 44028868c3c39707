#!/usr/bin/env python3
"""Checks the order of the house: an include may point only to a folder further down the lists below.

usage: includes.py [ROOT]

Before it looks at the sources it proves on a made-up tree that it catches what it is there for. Also refused: project files
included by <> or by a relative name, product code that includes tests or benchmarks, tabs, trailing blanks, files of more
than 500 lines. Exit code 1 and one line per offence.
"""

import pathlib
import re
import sys
import tempfile

FOLDERS = ["jobs", "analysis", "archive", "simulation", "scenarios", "engine", "sampling", "graze"]  # from top to bottom
ROOMS = {  # from top to bottom; what stands in the folder itself stands above its rooms
    "jobs": ["python_module", "cli", "machine", "slurm", "mpi", "page_server", "campaign", "workers"],
    "archive": ["directory", "schema", "hdf5", "files"],
    "engine": ["library", "network", "control", "actuation", "sensing", "clearance", "lane_physics", "bullet", "contact", "physics.cpp",
               "physics.h", "block_physics.cpp", "block_physics.h", "contact_record.h", "dynamics", "model", "lanes",
               "settings"],
}
# Back ends register themselves (engine/physics.h): their headers are known to whoever is named here and to no other file.
BACK_ENDS = {"engine/lane_physics/": ["engine/lane_physics/", "engine/clearance/",
                                      "engine/actuation/"],  # clearance and actuation have its kernels
             "engine/bullet/": ["engine/bullet/"]}
OUTSIDE = ["tests", "bench"]  # may include anything; nothing may include them
GENERATED = {"graze_version.h", "graze_build.h", "python_runner.h"}
# archive/ keeps records; of what makes them it knows these words only.
ARCHIVE = ["archive/", "simulation/", "engine/settings/", "scenarios/judgement.h", "scenarios/source.h"]
LONGEST = 500  # lines

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCES = {".h", ".cpp", ".py", ".sh", ".cmake"}


def place(path):
    """(height of the folder, height of the room in it), larger is higher; None outside the order."""
    parts = path.split("/")
    if parts[0] not in FOLDERS:
        return None
    folder = len(FOLDERS) - FOLDERS.index(parts[0])
    rooms = ROOMS.get(parts[0], [])
    if len(parts) > 1 and parts[1] in rooms:
        return folder, len(rooms) - rooms.index(parts[1])
    # a room that nobody has listed has no place, and neither has a file of engine/ that is not named above
    return None if len(parts) > 2 or parts[0] == "engine" else (folder, len(rooms) + 1)


def include_fault(root, path, bracket, target):
    """What is wrong with one include of the file `path`, or None."""
    top = path.split("/")[0]
    if bracket == "<":
        return "is a file of this project; write it in quotes" if (root / target).is_file() else None
    if target in GENERATED:
        return None
    if not (root / target).is_file():
        return "is no file under the root of the project; includes are rooted there"
    if top in OUTSIDE:
        return None
    if target.split("/")[0] in OUTSIDE:
        return "is a test or benchmark; the product must not know it"
    here, there = place(path), place(target)
    if here is None or there is None:
        return "stands in no folder of the order; add it to the lists at the top of this check"
    if there > here:
        return "stands higher in the order; only folders further down may be included"
    for back_end, known_to in BACK_ENDS.items():
        if target.startswith(back_end) and not path.startswith(tuple(known_to)):
            return "is of a back end, which nothing else may know; it is made by its name (engine/physics.h)"
    if top == "archive" and not target.startswith(tuple(ARCHIVE)):
        return "makes results; archive/ may include records of simulation/ and plain words only"
    return None


def faults_of(root, file):
    path = file.relative_to(root).as_posix()
    lines = file.read_text(encoding="utf-8").split("\n")
    if len(lines) - 1 > LONGEST:
        yield f"{path}: {len(lines) - 1} lines; a file has at most {LONGEST}"
    for number, line in enumerate(lines, 1):
        if "\t" in line:
            yield f"{path}:{number}: a tab; indent with spaces"
        if line != line.rstrip():
            yield f"{path}:{number}: trailing blanks"
        found = INCLUDE.match(line) if file.suffix in {".h", ".cpp"} else None
        fault = found and include_fault(root, path, *found.groups())
        if fault:
            yield f"{path}:{number}: {found.group(2)} {fault}"


def check(root):
    """(number of files, list of faults) of the project at `root`."""
    files = sorted(f for top in FOLDERS + OUTSIDE for f in (root / top).rglob("*")
                   if f.is_file() and (f.suffix in SOURCES or f.name == "CMakeLists.txt"))
    return len(files), [fault for f in files for fault in faults_of(root, f)]


def made_up_tree(root, files):
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")


# Each wrong file with a word of the complaint that it must earn.
RIGHT = {
    "sampling/stream.h": "#include <vector>\n",
    "engine/settings/settings.h": "",
    "engine/model/model.h": '#include "engine/settings/settings.h"\n#include "sampling/stream.h"\n',
    "engine/block_physics.h": '#include "engine/model/model.h"\n',
    "engine/physics.h": '#include "engine/block_physics.h"\n',
    "engine/contact/events.h": '#include "engine/block_physics.h"\n',
    "engine/bullet/back_end.h": '#include "engine/contact/events.h"\n#include "engine/physics.h"\n',
    "engine/lane_physics/kernel.h": '#include "engine/contact/events.h"\n',
    "engine/clearance/gaps.h": '#include "engine/lane_physics/kernel.h"\n',
    "engine/actuation/servo.h": '#include "engine/lane_physics/kernel.h"\n',
    "engine/control/policy.h": '#include "engine/physics.h"\n#include "engine/control/gait.h"\n',
    "engine/control/gait.h": "",
    "scenarios/task.h": '#include "engine/control/policy.h"\n',
    "simulation/trace.h": '#include "scenarios/task.h"\n',
    "archive/reader.h": '#include "simulation/trace.h"\n#include "engine/settings/settings.h"\n',
    "archive/hdf5/column.h": '#include "archive/files/seal.h"\n',
    "archive/files/seal.h": "",
    "jobs/campaign/communicator.h": "",
    "jobs/cli/run.cpp": '#include "jobs/campaign/communicator.h"\n',
    "jobs/main.cpp": '#include "graze_version.h"\n#include "scenarios/task.h"\n',
    "tests/jobs/main.cpp": '#include "jobs/run.h"\n',
    "jobs/run.h": "",
    "jobs/cli/words.h": "",
}
WRONG = {
    "sampling/up.h": ('#include "engine/model/model.h"\n', "higher"),
    "engine/model/up.cpp": ('  #  include "engine/control/policy.h"\n', "higher"),
    "engine/model/physics.h": ('#include "engine/physics.h"\n', "higher"),
    "engine/bullet/up.h": ('#include "engine/control/gait.h"\n', "higher"),
    "engine/physics.cpp": ('#include "engine/bullet/back_end.h"\n', "higher"),
    "engine/lane_physics/other.h": ('#include "engine/bullet/back_end.h"\n', "back end"),
    "engine/actuation/other.h": ('#include "engine/bullet/back_end.h"\n', "back end"),
    "engine/sensing/other.h": ('#include "engine/lane_physics/kernel.h"\n', "back end"),
    "engine/clearance/other.h": ('#include "engine/bullet/back_end.h"\n', "back end"),
    "simulation/facts.cpp": ('#include "engine/bullet/back_end.h"\n', "back end"),
    "archive/up.h": ('#include "jobs/run.h"\n', "higher"),
    "archive/engine.h": ('#include "engine/physics.h"\n', "records"),
    "archive/files/up.h": ('#include "archive/hdf5/column.h"\n', "higher"),
    "archive/files/top.h": ('#include "archive/reader.h"\n', "higher"),
    "jobs/campaign/up.h": ('#include "jobs/cli/words.h"\n#include "jobs/campaign/communicator.h"\n', "higher"),
    "jobs/newroom/a.h": ('#include "sampling/stream.h"\n', "no folder"),
    "engine/newroom/a.h": ('#include "sampling/stream.h"\n', "no folder"),
    "jobs/angled.h": ("#include <scenarios/task.h>\n", "quotes"),
    "jobs/relative.cpp": ('#include "run.h"\n', "rooted"),
    "jobs/test.h": ('#include "tests/helper.h"\n', "must not know"),
    "tests/helper.h": ("int a;\n\tint b;\n", "tab"),
    "tests/blank.py": ("x = 1 \n", "trailing"),
    "bench/long.cpp": ("\n" * 501, "501 lines"),
}


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        made_up_tree(root, RIGHT)
        count, faults = check(root)
        assert count == len(RIGHT) and not faults, faults
        made_up_tree(root, {name: text for name, (text, _) in WRONG.items()})
        faults = check(root)[1]
        for name, (_, word) in WRONG.items():
            assert any(f.startswith(name) and word in f for f in faults), f"{name}: not caught"
        assert len(faults) == len(WRONG), faults


def main():
    self_test()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]).resolve()
    count, faults = check(root)
    print("\n".join(faults + [f"{count} files, {len(faults)} faults"]))
    return 1 if faults or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
