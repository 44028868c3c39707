#!/usr/bin/env python3
"""Refuses two things of one name in sources that are compiled in bundles (GRAZE_UNITY, CMakeLists.txt).

usage: bundles.py [ROOT]

The files of a library or a test program share a translation unit there, and with it their anonymous namespaces: a type, a
constant, a function of the same parameters or a test of one name in two of them does not compile. Aliases of the same type
and of the same namespace may stand twice; what is borrowed from another namespace may not have the name of a type. Nor may
a test's source have a function of its headers again. Before it looks at the sources it proves on made-up ones that it catches
what it is there for. Exit code 1 and one line per offence.
"""

import collections
import pathlib
import re
import sys

# What graze_library() of CMakeLists.txt makes one library of; other folders are one each, as are those of tests.
LIBRARIES = {
    "sampling": ["sampling"],
    "settings": ["engine/settings"],
    "model": ["engine/model"],
    "physics": ["engine", "engine/contact", "engine/dynamics", "engine/lanes", "engine/lane_physics", "engine/bullet",
                "engine/clearance"],
    "control": ["engine/sensing", "engine/actuation", "engine/control", "engine/library", "engine/network"],
    "scenarios": ["scenarios"],
    "simulation": ["simulation"],
    "archive": ["archive", "archive/files", "archive/hdf5", "archive/schema", "archive/directory"],
    "analysis": ["analysis"],
    "jobs": ["jobs/campaign", "jobs/slurm", "jobs/machine", "jobs/cli", "jobs/workers"],
}

RAW_TEXT = re.compile(r'R"(\w*)\(.*?\)\1"', re.S)
ANONYMOUS = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.M | re.S)
DEFINITION = re.compile(
    r"^(?:template <[^\n]*>\n)?(?:\[\[\w+\]\] )?(?:(?:static|inline|constexpr|const|extern) )*"
    r"(?:(?:struct|class|enum class|enum) (?P<type>\w+)|(?:using|namespace) (?P<alias>\w+) = (?P<same>[^;]+);|"
    r"[\w:<>,&*\[\]][\w:<>,&* \[\]]*?[ *&](?P<name>\w+)\s*(?P<what>[(={;\[]))", re.M)
BORROWED = re.compile(r"^using ((?:::)?[\w:]+::(\w+));", re.M)
TEST = re.compile(r"^TEST(?:_F|_P)?\((\w+), (\w+)\)", re.M)
IN_HEADER = re.compile(r"^(?:inline|template <[^\n]*>\n(?:inline )?)[^\n;={]*?\b(\w+)\(", re.M)
WORDS = {"if", "for", "while", "return", "operator", "else", "public", "private", "namespace"}


def parameters(text):
    """The types between the first pair of parentheses."""
    depth = 0
    for i, c in enumerate(text):
        depth += (c == "(") - (c == ")")
        if depth == 0:
            return re.sub(r"\s*\w+(?: = [^,)]+)?(?=[,)])", "", re.sub(r"\s+", " ", text[: i + 1]))
    return text


def calls(text):
    """The types that a function may be called with: all between the parentheses, and without those that have a value."""
    whole = parameters(text)
    signature = re.sub(r"\s+", " ", text.split("{")[0])
    required = re.sub(r", [^,()=]+ = [^,()]+(?=[,)])", "", signature)
    return {whole, parameters(required)}


def defined(text):
    """What a source defines for itself: (name, what must differ where the name is the same, or None: nothing may)."""
    out = set()
    for region in ANONYMOUS.finditer(RAW_TEXT.sub('""', text)):
        inside = region.group(1)
        out |= {(name, "< " + whole.lstrip(":")) for whole, name in BORROWED.findall(inside)}
        for found in DEFINITION.finditer(inside):
            if found["alias"]:
                out.add((found["alias"], "= " + found["same"]))
            elif found["type"]:
                out.add((found["type"], None))
            elif found["name"] not in WORDS and not found.group(0).startswith("using "):
                kinds = calls(inside[found.end() - 1:]) if found["what"] == "(" else {None}
                out |= {(found["name"], kind) for kind in kinds}
    return out | {(f"{suite}.{name}", None) for suite, name in TEST.findall(text)}


def clash(one, other):
    """Whether the two may not stand in one translation unit."""
    if one is None or other is None:
        return True
    if one.startswith("<") or other.startswith("<"):
        return False  # borrowed: functions go beside those of other parameters
    aliases = one.startswith("="), other.startswith("=")
    return one != other if all(aliases) else any(aliases) or one == other


def clashes(sources):
    """One line for each name; sources: {file: text}."""
    seen = collections.defaultdict(list)
    for file, text in sorted(sources.items()):
        for name, kind in sorted(defined(text), key=str):
            for other, before in seen[name]:
                if other != file and clash(kind, before):
                    yield f"{file}: '{name}' stands in {other}, too; rename one, or share it in a header"
                    break
            seen[name].append((file, kind))


def hidden(headers, sources):
    """One line for each function of a test's header that a source has again, of the same name and parameters.

    In a bundle the source's hides the header's from the sources behind it, which compile, and call another function.
    """
    named = {}
    for file, text in sorted(headers.items()):
        for found in IN_HEADER.finditer(text):
            named.setdefault((found.group(1), parameters(text[found.end() - 1:])), file)
    for file, text in sorted(sources.items()):
        for name, kind in sorted(defined(text), key=str):
            if (name, kind) in named:
                yield f"{file}: '{name}' hides that of {named[name, kind]} from other files of its bundle; rename it"


def prove():
    """The check sees what it is there for, and nothing else."""
    unit = "namespace {{\n\n{}\n}}  // namespace\n".format
    cases = [
        ("constexpr int kA = 1;", "constexpr double kA = 2;", 1),
        ("struct A {\n};", "class A {\n};", 1),
        ("int f(int a) { return a; }", "int f(int b) { return b; }", 1),
        ("int f(int a) { return a; }", "int f(double b) { return 1; }", 0),
        ("int f(int a) { return a; }", "int f(int b, int digits = 4) { return b; }", 1),
        ("int f(int a) { return a; }", "int f(int b, int digits) { return b; }", 0),
        ("using A = B;", "using A = B;", 0),
        ("using A = B;", "using A = C;", 1),
        ("using N::A;", "using ::N::A;", 0),
        ("using N::A;", "struct A {\n};", 1),
        ("struct A {\n  int kA = 1;\n};", "struct B {\n  int kA = 1;\n};", 0),
    ]
    for one, other, count in cases:
        found = list(clashes({"a.cpp": unit(one), "b.cpp": unit(other)}))
        assert len(found) == count, (one, other, found)
    header = {"a.h": "namespace a {\ninline int f(int a) {\n  return a;\n}\n}\n"}
    assert len(list(hidden(header, {"b.cpp": unit("int f(int a) { return a; }")}))) == 1
    assert not list(hidden(header, {"b.cpp": unit("int g(int a) { return f(a); }")}))
    assert len(list(clashes({"a.cpp": "TEST(A, B) {\n}\n", "b.cpp": "TEST(A, B) {\n}\n"}))) == 1


def main():
    prove()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    programs = [folders for folders in LIBRARIES.values()]
    programs += [[str(f.relative_to(root))] for f in sorted((root / "tests").rglob("*")) if f.is_dir() and f.name != "fuzz"]
    offences = []
    for folders in programs:
        files = [f for folder in folders for f in (root / folder).glob("*.cpp") if f.name not in ("main.cpp", "kernel.cpp")]
        sources = {str(f.relative_to(root)): f.read_text() for f in files}
        offences += clashes(sources)
        headers = [f for folder in {*folders, "tests"} if folders[0].startswith("tests") for f in (root / folder).glob("*.h")]
        offences += hidden({str(f.relative_to(root)): f.read_text() for f in headers}, sources)
    print("\n".join(offences) or "no two of one name")
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main())
