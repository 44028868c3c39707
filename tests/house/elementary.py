#!/usr/bin/env python3
"""Refuses the C library's sine, exponential and the like where results are computed: bits of a trace must not depend on it.

usage: elementary.py [ROOT]

The project's own are pinned::… of sampling/elementary.h and engine/lanes/scalar.h (docs/determinism.md). + - * /, sqrt, fma,
floor, round, remainder, ldexp and frexp are the same everywhere and free to use. Refused are also those who call the C
library unseen: rotations by angle of Eigen and Bullet, boost's special functions, the standard library's distributions.
Before it looks at the sources it proves on a made-up tree that it catches what it is there for. Exit code 1 and one line per
offence.
"""

import pathlib
import re
import sys
import tempfile

# What computes results. Above it, numbers are only counted, printed and stored.
COMPUTE = ["engine", "sampling", "scenarios", "simulation"]

# The functions themselves; these must not call the C library's either, but their own names stand in them.
PINNED = {"sampling/elementary.h", "sampling/elementary.cpp", "engine/lanes/scalar.h", "engine/lanes/trig.h", "engine/lanes/arc.h",
          "engine/lanes/log.h"}
# Templates on lanes by plain names, which find those of this header.
LANE_HEADER, LANE_NAMES = '#include "engine/lanes/arc.h"', {"atan2", "asin", "acos"}

# What never reaches a trace: (file, name) and why.
ALLOWED = {
    ("engine/control/gait_doubts.cpp", "hypot"): "warns of commands that the legs cannot follow",
    ("engine/model/urdf.cpp", "log"): "is the log of urdfdom's messages, no logarithm",
    ("scenarios/spectrum.cpp", "cbrt"): "tells a cell that is long enough",
    ("scenarios/doubts.cpp", "pow"): "warns of densities in another unit",
    ("sampling/moments.cpp", "boost/math/quadrature/gauss.hpp"): "is a table of nodes and weights",
}

NAMES = ("sin cos tan sincos asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 exp10 expm1 log log2 log10 log1p pow "
         "cbrt hypot erf erfc tgamma lgamma polar").split()
ONE_OF = "(?:" + "|".join(NAMES) + ")"
QUALIFIED = re.compile(rf"(?:\bstd|(?<![\w>])|\bnumext)\s*::\s*({ONE_OF})[fl]?\b")
PLAIN = re.compile(rf"(?<![\w.:>])(?<!->)({ONE_OF})[fl]?\s*\(")
MEMBER = re.compile(rf"\.\s*({ONE_OF})\s*\(\s*\)")  # Eigen's arrays
UNSEEN = re.compile(r"\b(AngleAxis[df]?|Rotation2D[df]?|eulerAngles|canonicalEulerAngles|slerp|angularDistance|bt(?:Sin|Cos|Tan|Asin|"
                    r"Acos|Atan2?|Exp|Log|Pow)|setRotation|setEuler\w*|getEuler\w*|getAngle|std::\w+_distribution)\b|\.(rotate)\s*\(")
BOOST = re.compile(r"#\s*include\s*<(boost/math/[^>]+)>")


def without_comments(text):
    """The code with comments and strings blanked, lines kept."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), text)


def uses(path, text):
    """(line, name) of everything that is refused in a file unless it is allowed."""
    code = without_comments(text)
    lanes = LANE_HEADER in text
    for number, line in enumerate(code.split("\n"), 1):
        if line.lstrip().startswith("#"):
            yield from ((number, name) for name in BOOST.findall(line))
            continue
        found = QUALIFIED.findall(line) + MEMBER.findall(line)
        if path not in PINNED:
            found += [name for name in PLAIN.findall(line) if not (lanes and name in LANE_NAMES)]
        found += [a or b for a, b in UNSEEN.findall(line)]
        yield from ((number, name) for name in found)


def check(root, allowed):
    files = sorted(f for top in COMPUTE for f in (root / top).rglob("*") if f.suffix in {".h", ".cpp"})
    faults, unused = [], dict(allowed)
    for file in files:
        path = file.relative_to(root).as_posix()
        for line, name in uses(path, file.read_text(encoding="utf-8")):
            if (path, name) in allowed:
                unused.pop((path, name), None)
                continue
            faults.append(f"{path}:{line}: {name} computes by the C library, whose bits are its own; use pinned::… of "
                          "engine/lanes/scalar.h or sampling/elementary.h, or allow it in tests/house/elementary.py if it "
                          "reaches no trace")
    faults += [f"tests/house/elementary.py: {path} does not use {name}; do not allow it" for path, name in unused]
    return len(files), faults


RIGHT = """#include <cmath>
// std::sin(x) in words
double f(double x) { return pinned::sin(x) + std::sqrt(x) + std::fma(x, x, x) + basin(x) + graze::sin_cos(x) + a.exp; }
"""
WRONG = ["double y = std::sin(x);", "double y = ::exp(x);", "double y = exp(x);", "auto f = std::log;", "float y = std::sinf(x);",
         "y = x.array().exp();", "R = Eigen::AngleAxisd(q, a).toRotationMatrix();", "p = v.rotate(axis, angle);",
         "y = btSin(x);", "#include <boost/math/special_functions/erf.hpp>", "std::normal_distribution<double> z;",
         "double y = 2*hypot (a, b);", "double y = atan2(a, b);"]


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "engine/lanes").mkdir(parents=True)
        (root / "engine/right.cpp").write_text(RIGHT)
        (root / "engine/lane.h").write_text(LANE_HEADER + "\nT a = atan2(y, x);\n")
        (root / "engine/lanes/scalar.h").write_text("inline double sin(double x);\n")
        count, faults = check(root, {})
        assert count == 3 and not faults, faults
        for wrong in WRONG:
            (root / "engine/wrong.cpp").write_text(wrong + "\n")
            faults = check(root, {})[1]
            assert len(faults) == 1 and faults[0].startswith("engine/wrong.cpp:1: "), (wrong, faults)
        (root / "engine/lanes/scalar.h").write_text("inline double sin(double x) { return std::sin(x); }\n")
        (root / "engine/wrong.cpp").unlink()
        assert len(check(root, {})[1]) == 1, "a pinned function that is not"
        assert len(check(root, {("engine/lanes/scalar.h", "sin"): "", ("engine/right.cpp", "log"): ""})[1]) == 1, "unused"


def main():
    self_test()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]).resolve()
    count, faults = check(root, ALLOWED)
    print("\n".join(faults + [f"{count} files, {len(faults)} faults"]))
    return 1 if faults or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
