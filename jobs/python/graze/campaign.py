"""A campaign's archive, read. Columns and units are those of docs/archive.md."""
from __future__ import annotations

import contextlib
import difflib
import json
import operator
import os
import pathlib
import shlex
import struct
from typing import Dict, Iterator, List, Optional, Tuple, Union

import h5py
import numpy as np
import pandas as pd

from .errors import nearest

FORMAT_VERSION = 1
SEAL = struct.Struct("<8sQQ")  # "GRAZEEND", bytes before it, XXH64 of them
EVENT_COLUMNS = ["time", "kind", "a", "b", "feature_a", "feature_b", "impulse", "x", "y", "z"]
PHASE_COLUMNS = ["begin", "end", "a", "b", "feature_a", "feature_b", "peak", "impulse", "slip", "roll"]
OUTCOMES = ["success", "known_failure", "unknown_failure", "invalid"]


class CampaignError(Exception):
    """What is wrong with an archive, or with what was asked of it."""


class Campaign:
    """A directory or a packed file. Tables of traces are read when they are asked for and kept; events, phases and
    telemetry are read one trace at a time and not kept. No file stays open.

    It reads what its files say. Whether they are whole, and whether a stranger's file is harmless, `graze verify` tells.
    """

    answer: Optional[str] = None    # of graze.run with `until`: "held", "refuted" or "open"
    messages: Optional[str] = None  # of graze.run: what the program said, its warnings

    def __init__(self, path: Union[str, "os.PathLike[str]"]):
        self.path = pathlib.Path(path)
        self._main = self._description()
        with self._file(self._main) as file:
            self.attributes: Dict[str, object] = {key: _plain(value) for key, value in file.attrs.items()}
            self._check_version(self._main, "graze-campaign")
            self.policies: List[str] = _texts(file, "policies/name")
            self._watched = _texts(file, "requirements/name")
            measure = file["requirements/measure"][:] if "requirements/measure" in file else np.zeros(len(self._watched))
            self.requirements = [name for name, of in zip(self._watched, measure) if not of]
            self.measures = [name for name, of in zip(self._watched, measure) if of]  # which decide nothing
            units = _texts(file, "requirements/unit") if "requirements/unit" in file else [""] * len(self._watched)
            self.margin_units = dict(zip(self._watched, units))  # of margins, by requirement or measure
            self._names = {key: _texts(file, f"names/{key}") for key in ("colliders", "bodies", "q", "v", "actuators")}
        self._parts = self._find_parts()
        self._places: Dict[str, List[Tuple[pathlib.Path, np.ndarray]]] = {}  # per policy: part, rows that count
        self._where: Dict[str, Dict[int, Tuple[pathlib.Path, int]]] = {}     # per policy and particle: part, row

    def __repr__(self) -> str:
        state = "complete" if self.complete else "incomplete"
        return (f"<graze.Campaign {os.fspath(self.path)!r}: {self.attributes.get('scenario_name', '')}, "
                f"{self.particles} particles, {len(self.policies)} policies, {state}>")

    @property
    def particles(self) -> int:
        """How many were asked for, or answered the questions of --until."""
        return int(self.attributes["particles"])

    @property
    def complete(self) -> bool:
        """Whether every policy has a trace of every particle."""
        begin, end = self._range()
        return all(len(self._index(policy)) == end - begin for policy in self.policies)

    @property
    def parameters(self) -> pd.DataFrame:
        """Of the uncertain parameters, by name: unit, nominal value, distribution, jitter."""
        with self._file(self._main) as file:
            group = file.get("parameters")
            if group is None:
                return pd.DataFrame(columns=["unit", "nominal", "distribution", "jitter"])
            columns = {key: _texts(group, key) for key in ("unit", "distribution", "jitter")}
            return pd.DataFrame({"unit": columns["unit"], "nominal": group["nominal"][:],
                                 "distribution": columns["distribution"], "jitter": columns["jitter"]},
                                index=pd.Index(_texts(group, "name"), name="parameter"))

    @property
    def inputs(self) -> Dict[str, bytes]:
        """The files that the scenario was read from, by path."""
        with self._file(self._main) as file:
            names, offset, data = _texts(file, "inputs/path"), file["inputs/offset"][:], file["inputs/bytes"][:]
        return {name: data[offset[i]:offset[i + 1]].tobytes() for i, name in enumerate(names)}

    def counts(self) -> pd.DataFrame:
        """Per policy: traces by outcome, n (all but the invalid) and rate of success (NaN without traces)."""
        rows = {}
        for policy in self.policies:
            outcome = self.traces(policy)["outcome"].value_counts()
            rows[policy] = {name: int(outcome.get(name, 0)) for name in OUTCOMES}
        out = pd.DataFrame.from_dict(rows, orient="index", columns=OUTCOMES)
        out["n"] = out[OUTCOMES[:3]].sum(axis=1)
        out["rate"] = out["success"] / out["n"].where(out["n"] > 0)
        return out.rename_axis("policy")

    def traces(self, policy: str) -> pd.DataFrame:
        """One row per particle: outcome, violated (the requirement that was violated first, or None), end_time (s),
        objective_margin, digest, sequence (of contacts), invalid_reason."""
        scalars = self._columns(policy, ["outcome", "violated", "end_time", "objective_margin", "digest"])
        codes = scalars["outcome"]
        names = np.array([*self._watched, None], dtype=object)  # -1: the last
        texts = {key: self._listed(policy, key, listed)
                 for key, listed in (("sequence", "sequences/text"), ("invalid_reason", "reasons/text"))}
        return pd.DataFrame({
            "outcome": pd.Categorical.from_codes(codes.astype(np.int8), OUTCOMES),
            "violated": names[scalars["violated"]],
            "end_time": scalars["end_time"], "objective_margin": scalars["objective_margin"],
            "digest": scalars["digest"], **texts}, index=self._particles_of(policy))

    def margins(self, policy: str) -> pd.DataFrame:
        """The least value of the witness of each requirement and measure, by particle; negative: violated."""
        return self._matrix(policy, "margins", self._watched)

    def first_violations(self, policy: str) -> pd.DataFrame:
        """When each requirement and measure was violated first, s, by particle; NaN: never."""
        return self._matrix(policy, "first_violations", self._watched)

    def final_states(self, policy: str) -> pd.DataFrame:
        """Positions and velocities at the end of each trace, by particle; columns ("q", name) and ("v", name)."""
        both = {"q": self._matrix(policy, "final_q", self._names["q"]),
                "v": self._matrix(policy, "final_v", self._names["v"])}
        return pd.concat(both, axis=1)

    def values(self) -> pd.DataFrame:
        """The persistent values of the parameters by particle, in the units of `parameters`."""
        found: Dict[int, np.ndarray] = {}
        for part in self._parts:
            with self._file(part) as file:
                if "particles/values" not in file:
                    continue
                for particle, row in zip(file["particles/particle"][:].tolist(), file["particles/values"][:]):
                    if self._counts(particle):
                        found.setdefault(particle, row)
        if not found and len(self.parameters) > 0 and not self.attributes.get("store_values", 1):
            raise CampaignError(f"{self.path}: keeps no values of parameters; 'graze sample' draws them again from the seed")
        order = sorted(found)
        names = self.parameters.index
        rows = np.array([found[particle] for particle in order]).reshape(len(order), len(names))
        return pd.DataFrame(rows, index=pd.Index(order, name="particle"), columns=names)

    def events(self, policy: str, particle: int) -> pd.DataFrame:
        """Of one trace: time (s), kind, a, b (names of parts), feature_a, feature_b, impulse (N s), x, y, z (m). Of a
        joint's limits, a is the body and b `lower` or `upper`. Empty unless record.events is true."""
        table = self._slice("events", policy, particle)
        if table is None:
            return pd.DataFrame(columns=EVENT_COLUMNS)
        limit = np.char.startswith(table["kind"].astype(str), "limit")
        for side in ("a", "b"):
            table[side] = [self._event_name(side, number, on) for number, on in zip(table[side], limit)]
        table.update(zip("xyz", table.pop("position").T))
        return pd.DataFrame(table, columns=EVENT_COLUMNS)

    def phases(self, policy: str, particle: int) -> pd.DataFrame:
        """Contact phases of one trace: begin, end (s), a, b (names of parts), features, peak, impulse (N s), slip, roll."""
        table = self._slice("phases", policy, particle)
        if table is None:
            return pd.DataFrame(columns=PHASE_COLUMNS)
        for side in ("a", "b"):
            table[side] = [self._names["colliders"][number] for number in table[side]]
        return pd.DataFrame(table, columns=PHASE_COLUMNS)

    def telemetry(self, policy: str, particle: int) -> pd.DataFrame:
        """Frames of one trace, by time (s); columns ("q", name), ("v", name), ("tau", name). Raises CampaignError if the
        campaign kept none of it (record.telemetry)."""
        names = {"q": self._names["q"], "v": self._names["v"], "tau": self._names["actuators"]}
        table = self._slice("telemetry", policy, particle)
        columns = pd.MultiIndex.from_tuples([(kind, name) for kind in names for name in names[kind]])
        if table is None or len(table["time"]) == 0:
            raise CampaignError(f"{self.path}: no telemetry was recorded of particle {particle} under {policy}; record.telemetry "
                                "says of which traces it is: all, failures or none (graze.run(telemetry='all'))")
        rows = np.concatenate([table[kind] for kind in names], axis=1)
        return pd.DataFrame(rows, columns=columns, index=pd.Index(table["time"], name="time"))

    # ---- where things are ----

    def _description(self) -> pathlib.Path:
        if self.path.is_file():
            return self.path
        if not self.path.is_dir():
            raise CampaignError(f"{self.path}: there is no such campaign{_near_file(self.path)}")
        for name in ("campaign.h5", "campaign.copy.h5"):
            if (self.path / name).is_file() and _sealed(self.path / name):
                return self.path / name
        raise CampaignError(f"{self.path}: is no campaign: it has no whole campaign.h5")

    def _resume(self) -> str:
        """The command that goes on with the campaign."""
        outside = any(name.endswith(".sha256") for name in self.inputs)  # sums of controllers' files
        return f"graze resume {shlex.quote(os.fspath(self.path))}{' --trust' if outside else ''}"

    def _find_parts(self) -> List[pathlib.Path]:
        if self.path.is_file():
            return [self.path]
        parts = sorted(file for file in (self.path / "shards").glob("*.h5") if not file.name.startswith("."))
        seals = {part: _sealed(part) for part in parts}
        for part, seal in seals.items():
            if seal is None:
                raise CampaignError(f"{part}: was cut short or changed; '{self._resume()}' mends the campaign")
            self._check_version(part, "graze-shard")
        lost = sorted(name for name, seal in self._manifest().items() if seal not in seals.values())
        if lost:
            raise CampaignError(f"{self.path}: lacks {', '.join(lost[:3])}{', …' if len(lost) > 3 else ''} of its shards; "
                                f"'{self._resume()}' simulates them again")
        return parts

    def _manifest(self) -> Dict[str, Tuple[int, int]]:
        """The seals of the shards that there must be, by name. Torn lines cost nothing but what they say."""
        out = {}
        for file in sorted((self.path / "manifest").glob("*.jsonl")):
            for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
                with contextlib.suppress(ValueError, KeyError, TypeError):
                    entry = json.loads(line)
                    out[str(entry["shard"])] = (int(entry["bytes"]), int(entry["xxh64"], 16))
        return out

    def _check_version(self, file: pathlib.Path, form: str) -> None:
        with self._file(file) as opened:
            found, version = opened.attrs.get("format"), _plain(opened.attrs.get("format_version", 0))
            same = all(_plain(opened.attrs.get(key)) == self.attributes.get(key) for key in ("scenario_sha256", "seed"))
        if found != form:
            raise CampaignError(f"{file}: is no {'campaign' if form == 'graze-campaign' else 'shard'} of Graze")
        if version != FORMAT_VERSION:
            raise CampaignError(f"{file}: has format version {version}, and this package reads {FORMAT_VERSION}")
        if not same:
            raise CampaignError(f"{file}: is of another campaign")

    @staticmethod
    @contextlib.contextmanager
    def _file(path: pathlib.Path) -> Iterator[h5py.File]:
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            raise CampaignError(f"{path}: is no HDF5 file that can be read: {error}") from None
        with file:
            yield file

    def _range(self) -> Tuple[int, int]:
        return int(self.attributes.get("part_begin", 0)), int(self.attributes.get("part_end", self.particles))

    def _counts(self, particle: int) -> bool:
        begin, end = self._range()
        return begin <= particle < end

    def _check_policy(self, policy: str) -> None:
        if not isinstance(policy, str):
            raise CampaignError(f"{self.path}: a policy is named by a text, not {policy!r}; there are: {', '.join(self.policies)}")
        if policy in self.policies:
            return
        raise CampaignError(f"{self.path}: has no policy '{policy}'{nearest(policy, self.policies)}")

    def _index(self, policy: str) -> Dict[int, Tuple[pathlib.Path, int]]:
        """Where the trace of each particle is. One that stands in two shards counts once."""
        self._check_policy(policy)
        if policy not in self._where:
            where: Dict[int, Tuple[pathlib.Path, int]] = {}
            places = []
            for part in self._parts:
                with self._file(part) as file:
                    ids = file.get(f"traces/{policy}/particle")
                    ids = ids[:].tolist() if isinstance(ids, h5py.Dataset) else []
                rows = [row for row, particle in enumerate(ids) if self._counts(particle) and particle not in where]
                where.update((ids[row], (part, row)) for row in rows)
                if rows:
                    places.append((part, np.array(rows)))
            self._places[policy], self._where[policy] = places, where
        return self._where[policy]

    def _particles_of(self, policy: str) -> pd.Index:
        return pd.Index(sorted(self._index(policy)), name="particle")

    def _columns(self, policy: str, names: List[str]) -> Dict[str, np.ndarray]:
        """Datasets of the traces of a policy, from all parts, in the order of their particles."""
        ids = list(self._index(policy))  # in the order of the parts
        order = np.argsort(np.array(ids, dtype=np.int64), kind="stable")
        pieces: Dict[str, List[np.ndarray]] = {name: [] for name in names}
        for part, rows in self._places[policy]:
            with self._file(part) as file:
                for name in names:
                    pieces[name].append(file[f"traces/{policy}/{name}"][:][rows])
        return {name: np.concatenate(list(found))[order] if found else np.empty(0, dtype=np.int64)
                for name, found in pieces.items()}

    def _listed(self, policy: str, name: str, listed: str) -> np.ndarray:
        """A column of numbers of texts, each part's of its own list."""
        ids = list(self._index(policy))
        order = np.argsort(np.array(ids, dtype=np.int64), kind="stable")
        found: List[str] = []
        for part, rows in self._places[policy]:
            with self._file(part) as file:
                texts = np.array(_texts(file, listed), dtype=object)
                found += texts[file[f"traces/{policy}/{name}"][:][rows]].tolist()
        return np.array(found, dtype=object)[order]

    def _matrix(self, policy: str, name: str, columns: List[str]) -> pd.DataFrame:
        rows = self._columns(policy, [name])[name]
        return pd.DataFrame(rows.reshape(-1, len(columns)), index=self._particles_of(policy), columns=columns)

    def _slice(self, kind: str, policy: str, particle: int) -> Optional[Dict[str, np.ndarray]]:
        """The rows of one trace in /events, /phases or /telemetry; None: there are none in its part."""
        try:
            found = self._index(policy).get(operator.index(particle))
        except TypeError:
            raise CampaignError(f"{self.path}: a particle is a whole number, not {particle!r}") from None
        if found is None:
            raise CampaignError(f"{self.path}: has no trace of particle {particle} under policy '{policy}'")
        part, row = found
        with self._file(part) as file:
            group = file.get(f"{kind}/{policy}")
            if group is None or "offset" not in group:
                return None
            first, last = (int(edge) for edge in group["offset"][row:row + 2])
            return {name: _named(data, data[first:last]) for name, data in group.items()
                    if name != "offset" and isinstance(data, h5py.Dataset)}

    def _event_name(self, side: str, number: int, limit: bool) -> str:
        if limit and side == "b":
            return "upper" if number > 0 else "lower"
        return self._names["bodies" if limit else "colliders"][number]


def _plain(value: object) -> object:
    """An attribute as Python's own type."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value.item() if isinstance(value, np.generic) else value


def _texts(group: h5py.Group, name: str) -> List[str]:
    return list(group[name].asstr(errors="replace")[:]) if name in group else []


def _named(data: h5py.Dataset, values: np.ndarray) -> np.ndarray:
    """Names instead of the codes of an enumeration."""
    codes = h5py.check_enum_dtype(data.dtype)
    if codes is None:
        return values
    names = {code: name for name, code in codes.items()}
    return np.array([names[code] for code in values.tolist()], dtype=object)


def _sealed(file: pathlib.Path) -> Optional[Tuple[int, int]]:
    """What the seal says, bytes and hash, if it is there and fits the file's length; None: it does not. The hash itself
    is not computed: `graze verify` does that."""
    size = file.stat().st_size
    if size < SEAL.size:
        return None
    with file.open("rb") as opened:
        opened.seek(-SEAL.size, os.SEEK_END)
        letters, length, digest = SEAL.unpack(opened.read())
    return (length, digest) if letters == b"GRAZEEND" and length == size - SEAL.size else None


def _near_file(path: pathlib.Path) -> str:
    with contextlib.suppress(OSError):
        near = difflib.get_close_matches(path.name, [entry.name for entry in path.parent.iterdir()], 1)
        if near:
            return f"; did you mean '{near[0]}'?"
    return ""
