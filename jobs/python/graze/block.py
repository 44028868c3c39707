"""A block of up to eight particles, simulated step by step in this process."""
from __future__ import annotations

import dataclasses
import os
import pathlib
import shutil
import tempfile
import types
import weakref
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import pandas as pd

from .campaign import EVENT_COLUMNS
from .controllers import Policies, WrittenPolicies, needs_trust
from .errors import GrazeError, nearest, whole
from .program import PathLike, overrides
from .shipped import data_folder, scenario_file

MODES = ("stick", "slip", "roll")
MOST_LANES = 8  # of a block


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Contact points of all lanes after a step. A row is a point of two parts; where it is not, in a lane, are NaN and "".

    pair      [point]: names of the two parts (a, b); impulse and normal are those on a
    touching  [point, lane]: whether they press on each other or overlap; False: near, or not there
    mode      [point, lane]: "stick", "slip" or "roll" of those that touch
    gap       [point, lane], m; negative: overlap
    point     [point, 3, lane], m, world
    normal    [point, 3, lane], from b to a, world
    impulse   [point, 3, lane], N s over the last step, on a, world
    """

    pair: List[Tuple[str, str]]
    touching: np.ndarray
    mode: np.ndarray
    gap: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    impulse: np.ndarray

    def __len__(self) -> int:
        return len(self.pair)


class Block:
    """Up to eight particles under one policy, which stand still between two steps. Made by `graze.simulate`.

    Lane i is particle `particles[i]`. Arrays are copies, [quantity, lane], in SI units and world axes; those of a lane whose
    trace has ended stay as they were then. A trace ends as in a campaign: at its time, at its first violated requirement
    (unless the scenario says otherwise), or when it is invalid.
    """

    def __init__(self, inner: Any):
        self._inner = inner
        self._process = os.getpid()
        self._fault: Optional[GrazeError] = None
        facts = inner.facts()
        self.scenario: str = facts["scenario"]          #: its name
        self.policy: str = facts["policy"]              #: its name
        self.particles: List[int] = facts["particles"]  #: [lane]
        self.seed: int = facts["seed"]
        self.step_time: float = facts["step"]           #: s, of the physics
        self.control_time: float = facts["control"]     #: s, between two control steps
        self.end_time: float = facts["end"]             #: s, when traces end that nothing ends before
        self.warnings: List[str] = facts["warnings"]    #: what the scenario's reader has to say
        links = [(name, "m") for name in facts["links"]]
        columns: Dict[str, List[Tuple[str, str]]] = {
            "q": facts["q"], "v": facts["v"], "a": [(name, f"{unit}^2") for name, unit in facts["v"]], "tau": facts["tau"],
            "requirements": facts["requirements"], "objective": facts["objective"], "link_position": links,
            "link_rotation": [(name, "1") for name, _ in links]}
        #: Names of the rows of each array, by the array's name: names["q"] = ["base.qw", …]
        self.names: Dict[str, List[str]] = {kind: [name for name, _ in rows] for kind, rows in columns.items()}
        #: Their units, in the same order.
        self.units: Dict[str, List[str]] = {kind: [unit for _, unit in rows] for kind, rows in columns.items()}
        self._colliders: List[str] = facts["colliders"]

    def __repr__(self) -> str:
        return (f"<graze.Block {self.scenario!r} under {self.policy}, particles {self.particles}, {self.time:.6g} s, "
                f"{int(self.active.sum())} of {len(self.particles)} go on>")

    # Going on.

    def step(self) -> bool:
        """One physics step of every trace that has not ended. Returns whether any goes on.

        Raises GrazeError if a controller fails; the block is of no further use then.
        """
        return self._guarded(self._inner.step)

    def run_until(self, time: float) -> bool:
        """Steps until `time` (s), or until every trace has ended. Returns whether any goes on."""
        try:
            begun = float(time) >= 0
        except (TypeError, ValueError):
            begun = False
        if not begun:
            raise GrazeError(2, f"run_until: {time!r} is no time; a number of seconds from 0 on")
        return self._guarded(self._inner.run_until, float(time))

    def run(self) -> "Block":
        """Steps until every trace has ended."""
        self.run_until(float("inf"))
        return self

    def __iter__(self) -> Iterator["Block"]:
        """The block itself after each step, until every trace has ended."""
        while self.active.any():
            self.step()
            yield self

    def stop(self, lanes: Union[None, int, Sequence[int], np.ndarray] = None) -> None:
        """Ends traces where they are; they are judged as they stand.

        lanes  None: all; one lane or several; or an array [lane] of True and False
        """
        which = np.arange(len(self.particles)) if lanes is None else np.atleast_1d(np.asarray(lanes))
        if which.dtype == bool:
            if which.shape != (len(self.particles),):
                raise GrazeError(2, f"stop: an array of {which.size} truth values for {len(self.particles)} lanes")
            which = np.flatnonzero(which)
        self._guarded(self._inner.stop, [whole(lane, "stop: a lane") for lane in which])

    # What is.

    @property
    def time(self) -> float:
        """s, of the traces that go on (of the longest, when all have ended)."""
        return float(self.times.max())

    @property
    def times(self) -> np.ndarray:
        """[lane], s: where each trace is, or has ended."""
        return self._inner.time

    @property
    def active(self) -> np.ndarray:
        """[lane]: whether its trace goes on."""
        return self._inner.active

    @property
    def q(self) -> np.ndarray:
        """[name, lane]: positions, rows as names["q"]. A floating body has a quaternion (w x y z) and a position (m), a
        joint an angle (rad) or a length (m)."""
        return self._inner.q

    @property
    def v(self) -> np.ndarray:
        """[name, lane]: velocities, rows as names["v"]: of a floating body turning (rad/s), then moving (m/s)."""
        return self._inner.v

    @property
    def a(self) -> np.ndarray:
        """[name, lane]: the change of v in the last step over its time; 0 at the start."""
        return self._inner.a

    @property
    def tau(self) -> np.ndarray:
        """[name, lane]: torques (N m) or forces (N) of the driven joints in the last step; 0 at the start."""
        return self._inner.tau

    @property
    def link_position(self) -> np.ndarray:
        """[link, 3, lane], m: origins of the links, as the URDF has them, each particle's own."""
        return self._inner.link_position.reshape(-1, 3, len(self.particles))

    @property
    def link_rotation(self) -> np.ndarray:
        """[link, 3, 3, lane]: rotation matrices; link_rotation[k, :, :, i] @ (vector in axes of link k) is in world axes."""
        return self._inner.link_rotation.reshape(-1, 3, 3, len(self.particles))

    @property
    def requirements(self) -> np.ndarray:
        """[name, lane]: witnesses of requirements and measures now; >= 0: all is well. units["requirements"] has units."""
        return self._inner.requirements

    @property
    def objective(self) -> np.ndarray:
        """[name, lane]: witnesses of the parts of the objective now."""
        return self._inner.objective

    def row(self, array: str, name: str) -> np.ndarray:
        """One row by its name: row("q", "base.z") is [lane], row("link_position", "BODY0") is [3, lane]."""
        for wanted, known, what in ((array, list(self.names), "there is no array"),
                                    (name, self.names.get(array, []), f"{array} has no row")):
            if wanted not in known:
                raise GrazeError(2, f"{what} '{wanted}'{nearest(wanted, known)}")
        return getattr(self, array)[self.names[array].index(name)]

    @property
    def contacts(self) -> Contacts:
        """Contact points after the last step, with near points."""
        found = self._inner.contacts()
        pair = [(self._colliders[a], self._colliders[b]) for a, b in found.pop("pair")]
        mode = np.array(MODES + ("",), dtype=object)[found.pop("mode")]
        return Contacts(pair=pair, mode=mode, **found)

    def events(self, lane: int) -> pd.DataFrame:
        """Events of a lane's trace so far, with the columns of Campaign.events."""
        return pd.DataFrame(self._inner.events(whole(lane, "events: a lane")), columns=EVENT_COLUMNS)

    def record(self, lane: int) -> Dict[str, object]:
        """How a trace that has ended is judged: outcome, violated, end_time (s), objective_margin, digest (equal to the
        archive's where all steps are), sequence, invalid_reason, stopped, margins and first_violations (s) by requirement.

        Raises GrazeError while it goes on.
        """
        return self._inner.record(whole(lane, "record: a lane"))

    def traces(self) -> pd.DataFrame:
        """Of the traces that have ended, one row per particle, with the columns of Campaign.traces and `stopped`."""
        rows = [self.record(lane) for lane in np.flatnonzero(~self.active)]
        names = ["outcome", "violated", "end_time", "objective_margin", "digest", "sequence", "invalid_reason", "stopped"]
        return pd.DataFrame([[row[name] for name in names] for row in rows], columns=names,
                            index=pd.Index([row["particle"] for row in rows], name="particle"))

    def _guarded(self, act: Callable[..., bool], *arguments: object) -> bool:
        if self._fault is not None:
            raise GrazeError(self._fault.code, f"the block failed before: {self._fault}")
        if os.getpid() != self._process:
            raise GrazeError(2, f"this block belongs to process {self._process}, of which this one is a copy by fork(), and "
                                "which goes on with it; call graze.simulate in this process, too")
        try:
            return act(*arguments)
        except GrazeError as error:
            if act != self._inner.stop:  # a lane that is not there
                self._fault = error
            raise


def simulate(scenario: PathLike, particles: Union[int, Iterable[int]] = 8, *, policy: Union[None, str, Policies] = None,
             n: Optional[int] = None, seed: Optional[int] = None, set: Optional[Mapping[str, object]] = None,
             trust: bool = False, program: Optional[PathLike] = None) -> Block:
    """A block of particles of a scenario, to be simulated step by step in this process, to the bits that `graze run` gives.

    scenario   a YAML file, or the name of a shipped one
    particles  how many, 1 to 8, or their ids
    policy     the name of one of the scenario's policies (needed if there are several), or as for `run`: a class, an object, or
               a map of one name to one of these or to what a scenario says of a policy
    n          particles of the campaign that they are of; matters for Latin hypercubes only (default: the scenario's)
    seed       in place of the scenario's
    set        values of the scenario by path, as for `run`
    trust      controllers that the scenario names may run: code with your rights, from now on in this process. Those of
               `policy` may
    program    the program `graze`, beside which shipped scenarios are looked for

    >>> block = graze.simulate("quadruped_curb", [3, 17], policy="step/3cm")
    >>> for _ in block:
    ...     if block.row("q", "base.z").min() < 0.1:
    ...         block.stop()
    >>> block.traces()

    Raises GrazeError: with code 2 for wrong input, 3 for the machine, or if the compiled module is not there.
    """
    module = _module()
    if isinstance(particles, (int, np.integer)):
        if not 1 <= particles <= MOST_LANES:
            raise GrazeError(2, f"particles: {particles} are asked for; a block has 1 to {MOST_LANES}")
        ids = list(range(particles))
    else:
        ids = [whole(one, "particles: an id") for one in particles]
    for what, value in [("n", n), ("seed", seed), *(("particles", one) for one in ids)]:
        if value is not None and not 0 <= value < (1 << 64 if what == "seed" else 1 << 32):
            raise GrazeError(2, f"{what}: {value} is out of range; it is a whole number from 0 on")
    file = os.fspath(scenario_file(scenario, program))
    module.mean_shipped_names(os.fspath(data_folder(program) or ""))
    name = policy if isinstance(policy, str) else ""
    if policy is None or name:
        return Block(module.Block(file, overrides(set, None), name, ids, n or 0, seed, trust))
    folder = tempfile.mkdtemp(prefix="graze-policies-")
    try:
        written = WrittenPolicies(policy, pathlib.Path(folder))
        block = Block(module.Block(file, overrides(set, written), "", ids, n or 0, seed, needs_trust(written, trust)))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(block, _remove, folder, os.getpid())
    return block


def _remove(folder: str, process: int) -> None:
    """Deletes a block's folder, in the process that made it: its copies by fork() end, too."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def _module() -> types.ModuleType:
    try:
        from . import _block
    except ImportError as error:
        raise GrazeError(3, "graze.simulate needs the compiled module of the package, graze/_block, which is not here for this "
                            f"Python ({error}); build Graze with pybind11-dev and python3-dev installed, and take the package "
                            "from build/release/python (PYTHONPATH) or share/graze/python (pip install)") from error
    return _block
