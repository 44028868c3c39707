"""The program `graze`, called."""
from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
from typing import Iterable, Mapping, Optional, Sequence, Union

from .campaign import Campaign

PathLike = Union[str, "os.PathLike[str]"]
ANSWERS = {0: "done", 1: "a question of `until` was refuted", 4: "`until` is open"}  # exit codes that come with a campaign


class GrazeError(Exception):
    """The program refused or failed. `code`: its exit code (2: wrong input, 3: the machine); the text is what it said."""

    def __init__(self, code: int, text: str):
        super().__init__(text or f"graze ended with exit code {code}")
        self.code = code


def find_program(program: Optional[PathLike] = None) -> str:
    """`program`, or what the environment variable GRAZE names, or `graze` on PATH. Raises FileNotFoundError."""
    wanted = os.fspath(program) if program is not None else os.environ.get("GRAZE", "graze")
    found = shutil.which(wanted)
    if found is None:
        raise FileNotFoundError(
            f"{wanted}: no such program; put graze on PATH (cmake --install), or name it: program='build/release/graze', "
            "or the environment variable GRAZE")
    return found


def run(scenario: PathLike, n: Optional[int] = None, *, output: Optional[PathLike] = None, seed: Optional[int] = None,
        threads: Optional[int] = None, policies: Union[str, Iterable[str]] = (),
        set: Optional[Mapping[str, object]] = None, telemetry: Optional[str] = None, every: Optional[int] = None,
        until: Union[str, Iterable[str]] = (), trust: bool = False, force: bool = False, quiet: bool = True,
        options: Sequence[str] = (), program: Optional[PathLike] = None) -> Campaign:
    """Simulates a campaign by `graze run`, and opens its archive.

    scenario   a YAML file, or the name of a shipped one
    n          particles (default: the scenario's)
    output     directory, or a file ending in .h5 (default: SCENARIO.graze in the working directory)
    policies   names or globs; default: all
    set        values of the scenario by path: {"time.end": "2 s", "contact.friction": 0.8}
    telemetry  "none", "failures", "last" or "all"; every: physics steps between frames
    until      questions that end it: "p >= 0.95". Campaign.answer tells what came of them
    trust      controllers that the scenario names may run: code with your rights
    force      an existing archive is replaced
    quiet      False: progress goes to standard error
    options    further arguments of `graze run`

    Raises GrazeError with the program's message, FileNotFoundError if there is no program.
    """
    name = pathlib.Path(scenario)
    archive = pathlib.Path(output) if output is not None else pathlib.Path(name.stem + ".graze")
    words = [find_program(program), "run", os.fspath(scenario), "-o", os.fspath(archive)]
    for option, value in (("-n", n), ("--seed", seed), ("--threads", threads), ("--telemetry", telemetry),
                          ("--every", every)):
        if value is not None:
            words += [option, str(value)]
    for option, values in (("--policy", policies), ("--until", until)):
        for value in [values] if isinstance(values, str) else values:
            words += [option, value]
    for path, value in (set or {}).items():
        words += ["--set", f"{path}={_as_yaml(value)}"]
    words += [option for option, on in (("--trust", trust), ("--force", force), ("--quiet", quiet)) if on]
    done = subprocess.run([*words, *options], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE if quiet else None, text=True, errors="replace")
    if done.returncode not in ANSWERS:
        raise GrazeError(done.returncode, (done.stderr or "").strip())
    campaign = Campaign(archive)
    campaign.answer = ANSWERS[done.returncode]
    campaign.messages = (done.stderr or "").strip()
    return campaign


def _as_yaml(value: object) -> str:
    """A value as `--set` takes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_as_yaml(one) for one in value) + "]"
    return str(value)
