"""Claim: every example in README.md and docs/*.md works: blocks of yaml are scenarios that `graze check` takes, blocks of
sh and python run, and so do the commands of transcripts ("$ graze ..."); of `graze VERB --option` and `--set PATH=VALUE` in
running text verbs and options exist and values are taken.

Directives are comments on a line of their own, of the block that follows or, `before` and `file`, of all that follow:

    <!-- example: skip: REASON -->          the block is not run
    <!-- example: base=SCENARIO -->         a fragment of yaml is merged over this scenario (default: BASE)
    <!-- example: save=NAME -->             a whole scenario, or a module of Python that is not run by itself, that is kept
                                            under this name for what follows
    <!-- example: file NAME: CONTENT -->    makes a file; \\n in CONTENT is the end of a line
    <!-- example: before: COMMAND -->       runs a command

All examples of a page run one after the other in a folder of their own, with data/ and bench/ beside them. Campaigns are made small:
`graze` there runs no more than MOST particles, replaces what an example before it wrote, knows no ranks under `mpirun`, and
submits nothing.

usage: examples.py SOURCE PROGRAM [K/N]      N parts of the pages, the K-th of them"""

import os
import pathlib
import re
import stat
import subprocess
import sys
import tempfile

MOST = 20
BASE = "data/scenarios/quadruped_curb.yaml"
SECONDS = 120  # for one line

WRAPPER = r"""#!/usr/bin/python3
import os, re, sys
words = sys.argv[1:]
for i, word in enumerate(words[:-1]):
    if word in ("-n", "--particles") and re.fullmatch(r"\d+", words[i + 1]):
        words[i + 1] = str(min(int(words[i + 1]), {most}))
if words[:1] == ["run"] and "--help" not in words and not {{"-n", "--particles"}} & set(words):
    words += ["-n", "{most}"]
if words[:1] == ["submit"]:
    words.append("--dry-run")
if words[:1] in (["run"], ["replay"], ["sample"], ["pack"], ["report"], ["view"], ["plot"]) and "--help" not in words and "--force" not in words:
    words.append("--force")
os.execv({program!r}, ["graze", *words])
"""
# Controllers in Python need a python3 on PATH that has NumPy, which the one of this test has.
PYTHON = f'#!/bin/sh\nexec {sys.executable} "$@"\n'
MPIRUN = '#!/bin/sh\nwhile [ "$1" != graze ] && [ $# -gt 0 ]; do shift; done\nexec "$@"\n'


class Block:
    """A fenced block: its language, where its first line stands, its lines, and the directive before it."""

    def __init__(self, language, line, directive):
        self.language, self.line, self.directive, self.lines = language, line, directive, []


def blocks_of(text):
    """The blocks and page-wide directives of a page, in order; the latter as (line, directive)."""
    block, directive = None, None
    for number, line in enumerate(text.splitlines(), 1):
        fence = re.match(r"\s*```(\S*)", line)
        comment = re.match(r"\s*<!-- example: (.*?) -->\s*$", line)
        if block is not None:
            if fence:
                yield block
                block = None
            else:
                block.lines.append(line)
        elif fence:
            block = Block(fence.group(1), number + 1, directive)
            directive = None
        elif comment and re.match(r"(file|before)\b", comment.group(1)):
            yield number, comment.group(1)
        elif comment:
            directive = comment.group(1)
        elif line.strip():
            directive = None


def inline_of(text):
    """Code in running text, as (line, code)."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*```", line):
            fenced = not fenced
        elif not fenced and not line.lstrip().startswith("<!--"):
            for code in re.findall(r"`([^`]+)`", line):
                yield number, code


class Page:
    def __init__(self, source, program, path, wrong):
        self.source, self.program, self.path, self.wrong = source, program, path, wrong
        self.count = 0

    def run(self):
        text = self.path.read_text()
        with tempfile.TemporaryDirectory() as folder:
            self.folder = pathlib.Path(folder)
            self.furnish()
            for item in blocks_of(text):
                if isinstance(item, Block):
                    self.block(item)
                else:
                    self.directive(*item)
            for line, code in inline_of(text):
                self.inline(line, code)
        return self.count

    def furnish(self):
        (self.folder / "data").symlink_to(self.source / "data")
        (self.folder / "bench").symlink_to(self.source / "bench")
        (self.folder / "build/release").mkdir(parents=True)
        (self.folder / "bin").mkdir()
        wrapper = WRAPPER.format(most=MOST, program=str(self.program))
        for name, content in (("bin/graze", wrapper), ("build/release/graze", wrapper), ("bin/mpirun", MPIRUN),
                              ("bin/python3", PYTHON)):
            path = self.folder / name
            path.write_text(content)
            path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def fail(self, line, what, message):
        where = f"{self.path.relative_to(self.source)}:{line}"
        said = "\n".join("    " + one for one in message.strip().splitlines()[-6:])
        self.wrong.append(f"{where}: {what}\n{said}")

    def shell(self, line, command, codes=(0,)):
        """Runs a command; one that fails is noted."""
        self.count += 1
        environment = dict(os.environ, PATH=f"{self.folder}/bin:{os.environ['PATH']}",
                           PYTHONPATH=str(self.source / "jobs/python"))
        try:
            done = subprocess.run(["bash", "-c", command], cwd=self.folder, env=environment, capture_output=True,
                                  text=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            self.fail(line, command, f"took longer than {SECONDS} s")
            return
        if done.returncode not in codes:
            self.fail(line, command, f"exit code {done.returncode}\n{done.stderr or done.stdout}")

    def directive(self, line, directive):
        if directive.startswith("before:"):
            self.command(line, directive.removeprefix("before:").strip())
            return
        name, content = directive.removeprefix("file").split(":", 1)
        (self.folder / name.strip()).write_text(content.strip().replace("\\n", "\n") + "\n")

    def command(self, line, command):
        # A gate may be missed or undecided with so few particles.
        gate = "--require" in command or "--until" in command
        self.shell(line, command, (0, 1, 4) if gate else (0,))

    def block(self, block):
        directive = block.directive or ""
        if directive.startswith("skip:") and directive.removeprefix("skip:").strip():
            return
        if block.language in ("yaml", "yml"):
            self.scenario(block, directive)
        elif block.language in ("sh", "bash", "shell"):
            self.commands(block.line, block.lines)
        elif block.language in ("python", "py") and directive.startswith("save="):
            (self.folder / directive.removeprefix("save=")).write_text("\n".join(block.lines) + "\n")
        elif block.language in ("python", "py"):
            (self.folder / "example.py").write_text("\n".join(block.lines) + "\n")
            self.shell(block.line, f"{sys.executable} example.py")
        elif block.language in ("", "text", "console"):
            for offset, line in enumerate(block.lines):
                if line.startswith("$ "):
                    self.command(block.line + offset, line[2:])
        else:
            self.fail(block.line, f"a block of '{block.language}'", "is not run: make it sh, yaml, python or text, or say "
                      "<!-- example: skip: REASON --> before it")

    def commands(self, first, lines):
        command, begin = "", first
        for offset, line in enumerate(lines):
            if not command:
                begin = first + offset
            command += line
            if command.endswith("\\"):
                command = command[:-1]
                continue
            if command.strip() and not command.lstrip().startswith("#"):
                self.command(begin, command)
            command = ""

    def scenario(self, block, directive):
        whole = any(line.startswith(("graze:", "include:")) for line in block.lines)
        base = directive.removeprefix("base=") if directive.startswith("base=") else BASE
        head = "" if whole else f"include: {base}\n"
        if directive.startswith("save="):
            (self.folder / directive.removeprefix("save=")).write_text("\n".join(block.lines) + "\n")
        (self.folder / "example.yaml").write_text(head + "\n".join(block.lines) + "\n")
        self.shell(block.line, "graze check example.yaml")

    def inline(self, line, code):
        # Not examples but patterns: left out, or with names for what would stand there.
        code = code.strip()
        if code.startswith("--set "):
            sets = re.findall(r"--set (?:'([^']*)'|(\S+))", code)
            values = [a or b for a, b in sets]
            if any(re.fullmatch(r"path=value|PATH=VALUE", value) or "…" in value for value in values):
                return
            self.shell(line, f"graze check {BASE} {code}")
            return
        words = code.split()
        if "graze" not in words[:-1] or "VERB" in words or "=" in words[0]:
            return
        verb = words[words.index("graze") + 1]
        if not re.fullmatch(r"[a-z]+", verb):
            return
        options = {re.split(r"[=,.)]", word)[0] for word in words if re.match(r"--?[a-z]", word)} - {"-f"}
        for option in sorted(options) or [""]:
            pattern = rf"(^|[ ,]){re.escape(option)}([ ,=]|$)" if option else "."
            self.shell(line, f"graze {verb} --help | grep -qE -- '{pattern}' || "
                       f"{{ echo 'graze {verb} has no option {option}' >&2; exit 1; }}")


def main():
    source, program = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    pages = [source / "README.md", *sorted((source / "docs").glob("*.md"))]
    part, parts = (int(word) for word in sys.argv[3].split("/")) if len(sys.argv) > 3 else (1, 1)
    pages = pages[part - 1 :: parts]
    wrong, count = [], 0
    for path in pages:
        count += Page(source, program, path, wrong).run()
    if count < 30 // parts:
        wrong.append(f"only {count} examples found: the pages are not read as they are meant to be")
    print("\n".join(wrong) if wrong else f"{count} examples of {len(pages)} pages work")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
