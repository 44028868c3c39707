"""The program `graze`, called."""
from __future__ import annotations

import contextlib
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import warnings
from typing import Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

from .campaign import Campaign
from .controllers import Policies, WrittenPolicies, needs_trust, policies_folder
from .errors import GrazeError, whole
from .shipped import PathLike

ANSWERS = {0: "held", 1: "refuted", 4: "open"}  # what becomes of `until`, by the exit codes that come with a campaign


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
        threads: Optional[int] = None, policy: Optional[Policies] = None, policies: Union[str, Iterable[str]] = (),
        set: Optional[Mapping[str, object]] = None, telemetry: Optional[str] = None, every: Optional[int] = None,
        until: Union[str, Iterable[str]] = (), trust: bool = False, force: bool = False, quiet: bool = True,
        options: Sequence[str] = (), program: Optional[PathLike] = None) -> Campaign:
    """Simulates a campaign by `graze run`, and opens its archive.

    scenario   a YAML file, or the name of a shipped one
    n          particles (default: the scenario's)
    output     directory, or a file ending in .h5 (default: SCENARIO.graze in the working directory)
    policy     in place of the scenario's policies: a class with act(observation, targets) (docs/controllers.md), an
               object of one, or a map of names to these or to what a scenario says of a policy. Source is written into
               the folder OUTPUT.policies beside the archive, where `graze resume` and `graze replay` find it
    policies   names or globs of those that are run; default: all
    set        values of the scenario by path: {"time.end": "2 s", "contact.friction": 0.8}
    telemetry  "none", "failures", "last" or "all"; every: physics steps between frames
    until      questions that end it: "p >= 0.95". Campaign.answer tells what came of them: "held" (all do), "refuted"
               (one is), "open" (n particles did not answer one); None without questions
    trust      controllers that the scenario names may run: code with your rights. Those of `policy` may
    force      an existing archive is replaced
    quiet      False: progress goes to standard error, in a notebook into the cell's output
    options    further arguments of `graze run`

    What the program warned of, such as a controller that fails, is a RuntimeWarning (all of it: Campaign.messages), unless
    it was shown (quiet=False).

    Raises GrazeError with the program's message, FileNotFoundError if there is no program.
    """
    name = pathlib.Path(scenario)
    archive = pathlib.Path(output) if output is not None else pathlib.Path(name.stem + ".graze")
    words = [find_program(program), "run", os.fspath(scenario), "-o", os.fspath(archive)]
    for name_of, option, value in (("n", "-n", n), ("seed", "--seed", seed), ("threads", "--threads", threads),
                                   ("every", "--every", every)):
        if value is not None:
            words += [option, str(whole(value, f"run: {name_of}"))]
    if telemetry is not None:
        words += ["--telemetry", str(telemetry)]
    for option, values in (("--policy", policies), ("--until", until)):
        for value in [values] if isinstance(values, str) else values:
            words += [option, value]
    if isinstance(options, str):
        raise TypeError(f"options: a list of words is meant, {options.split()!r}, not a text")
    if set is not None and not isinstance(set, Mapping):
        raise TypeError(f"set: a map of paths to values is meant, {{'time.end': '2 s'}}, not {type(set).__name__}")
    with _policies(policy, archive) as written:
        for path, value in overrides(set, written):
            words += ["--set", f"{path}={value}"]
        trusted = needs_trust(written, trust) if written else trust
        words += [option for option, on in (("--trust", trusted), ("--force", force), ("--quiet", quiet)) if on]
        return _run([*words, *options], archive, quiet, bool(until))


def overrides(set: Optional[Mapping[str, object]], written: Optional[WrittenPolicies]) -> List[Tuple[str, str]]:
    """Values of the scenario by path, as text in YAML: of a caller, and of his policies."""
    out = [(path, as_yaml(value, path)) for path, value in (set or {}).items()]
    return out + ([("policies", as_yaml(written.settings, "policies"))] if written else [])


@contextlib.contextmanager
def _policies(policy: Optional[Policies], archive: pathlib.Path) -> Iterator[Optional[WrittenPolicies]]:
    """The policies with their source written; it is taken back if no campaign comes of them."""
    written = WrittenPolicies(policy, policies_folder(archive)) if policy is not None else None
    try:
        yield written
    except BaseException:
        if written and not archive.exists():
            written.remove()
        raise


def _run(words: Sequence[str], archive: pathlib.Path, quiet: bool, asked: bool) -> Campaign:
    code, said = _call(words, quiet)
    if code not in ANSWERS:
        raise GrazeError(code, said)
    campaign = Campaign(archive)
    campaign.answer = ANSWERS[code] if asked else None
    campaign.messages = said
    if quiet:
        _warn(said)
    return campaign


def _warn(said: str) -> None:
    """What the program warned of would be seen by nobody: controllers that fail, settings that look wrong."""
    begin = "graze: warning: "
    lines = [line[len(begin):] for line in said.splitlines() if line.startswith(begin)]
    if lines:
        more = f" (and {len(lines) - 1} more, in Campaign.messages)" if len(lines) > 1 else ""
        warnings.warn(lines[0] + more, RuntimeWarning, stacklevel=4)


def _call(words: Sequence[str], quiet: bool) -> Tuple[int, str]:
    """The exit code, and what was said on standard error. Without `quiet` a terminal shows that itself; elsewhere, as in a
    notebook, each line is passed on to sys.stderr."""
    if not quiet and sys.stderr is sys.__stderr__ and sys.stderr.isatty():
        return subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL).returncode, ""
    lines = []
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                          errors="replace") as process:
        try:
            for line in process.stderr or ():
                lines.append(line)
                if not quiet:
                    print(line, end="", file=sys.stderr, flush=True)
        except BaseException:  # interrupted; the program writes down what it has, for `graze resume`
            process.terminate()
            raise
    return process.returncode, "".join(lines).strip()


def as_yaml(value: object, where: str = "") -> str:
    """A value as `--set` takes it: text as it stands, so that units may be written; all else as JSON, which is YAML. Raises
    GrazeError for what a scenario cannot hold; `where` is its path."""
    try:
        return value if isinstance(value, str) else json.dumps(_plain(value, where), ensure_ascii=False, allow_nan=False)
    except RecursionError:
        raise GrazeError(2, f"{where}: holds itself, or maps and lists in too many levels") from None


def _plain(value: object, where: str) -> object:
    """Numbers and arrays of NumPy as Python's own, maps and lists of them."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one, f"{where}.{key}" if where else str(key)) for key, one in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(one, f"{where}[{i}]") for i, one in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise GrazeError(2, f"{where}: {value} is no number of a scenario; these are finite")
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise GrazeError(2, f"{where}: {value!r} is no value that a scenario can hold: numbers, text, True and False, None, lists "
                        "and maps of them")
