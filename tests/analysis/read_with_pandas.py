"""Reads a packed campaign with h5py and pandas alone and compares it with `graze score --json`.

Usage: read_with_pandas.py CAMPAIGN.h5 SCORE.json. Prints what differs; exit code 0 if nothing does.
"""
import itertools
import json
import sys

import h5py
import numpy as np
import pandas as pd

S, K, U, INVALID = 0, 1, 2, 3


def table(file, policy, requirements):
    """The traces of one policy, one row per particle."""
    group = file["traces"][policy]
    columns = {name: group[name][:] for name in ("particle", "outcome", "violated", "end_time", "digest")}
    frame = pd.DataFrame(columns).set_index("particle")
    margins = pd.DataFrame(group["margins"][:], index=frame.index, columns=requirements)
    frame["sequence"] = file["sequences/text"].asstr()[:][group["sequence"][:]]
    return frame.join(margins)


def counts(frame, requirements):
    known = frame[frame.outcome == K]
    return {
        "success": int((frame.outcome == S).sum()),
        "known_failure": len(known),
        "unknown_failure": int((frame.outcome == U).sum()),
        "invalid": int((frame.outcome == INVALID).sum()),
        "n": int((frame.outcome != INVALID).sum()),
        "by_requirement": {name: int((known.violated == i).sum()) for i, name in enumerate(requirements)},
    }


def convergence(group, limit):
    """What `score` says of the contact solver, but for the medians: traces, steps, and which are flagged."""
    solver, more = group["solver"][:], group["convergence"][:]
    told = solver[:, 0] > 0
    unconverged, steps = solver[:, 3], more[:, 0]
    flagged = told & (unconverged > limit * steps)
    names = ("success", "known_failure", "unknown_failure", "invalid")
    return {
        "traces": int(told.sum()), "steps": int(steps[told].sum()),
        "unconverged_steps": int(unconverged[told].sum()), "unconverged_traces": int((unconverged[told] > 0).sum()),
        "largest_change": max(solver[told & (unconverged > 0), 2].tolist(), default=None),
        "braked_steps": int(more[told, 2].sum()), "braked_traces": int((more[told, 2] > 0).sum()),
        "flagged": {"all": int(flagged.sum()), "first_particle": min(group["particle"][:][flagged].tolist(), default=None),
                    **{name: int((flagged & (group["outcome"][:] == i)).sum()) for i, name in enumerate(names)}},
    }


def pair(a, b):
    both = a[["outcome"]].join(b[["outcome"]], lsuffix="_a", rsuffix="_b", how="inner")
    both = both[(both.outcome_a != INVALID) & (both.outcome_b != INVALID)] == S
    cross = pd.crosstab(both.outcome_a, both.outcome_b).reindex(
        index=[True, False], columns=[True, False], fill_value=0)
    return {
        "n": len(both), "both": int(cross.loc[True, True]), "only_a": int(cross.loc[True, False]),
        "only_b": int(cross.loc[False, True]), "neither": int(cross.loc[False, False]),
    }


def main(campaign, score_file):
    with open(score_file) as handle:
        score = json.load(handle)
    wrong = []

    def check(what, found, wanted):
        if found != wanted:
            wrong.append(f"{what}: {found} in the file, {wanted} in the score")

    with h5py.File(campaign, "r") as file:
        check("format", file.attrs["format"], "graze-campaign")
        check("name", file.attrs["scenario_name"], score["campaign"])
        check("complete", bool(file.attrs["complete"]), score["complete"])
        requirements = list(file["requirements/name"].asstr()[:])
        check("requirements", requirements, score["requirements"])
        policies = list(file["policies/name"].asstr()[:])
        check("policies", policies, [p["policy"] for p in score["policies"]])
        frames = {policy: table(file, policy, requirements) for policy in policies}
        labels = h5py.check_enum_dtype(file["traces"][policies[0]]["outcome"].dtype)
        check("labels", labels, {"success": S, "known_failure": K, "unknown_failure": U, "invalid": INVALID})
        for policy, wanted in zip(policies, score["policies"]):
            for key, found in counts(frames[policy], requirements).items():
                check(f"{policy}: {key}", found, wanted[key])
            check(f"{policy}: rate", wanted["success"] / wanted["n"], wanted["rate"])
            for key, found in convergence(file["traces"][policy], file.attrs["unconverged_limit"]).items():
                check(f"{policy}: {key}", found, wanted["convergence"][key])
        for (a, b), wanted in zip(itertools.combinations(policies, 2), score["pairs"]):
            for key, found in pair(frames[a], frames[b]).items():
                check(f"{a} and {b}: {key}", found, wanted[key])
        values = pd.DataFrame(file["particles/values"][:], index=file["particles/particle"][:],
                              columns=file["parameters/name"].asstr()[:])
        check("particles", list(values.index), list(range(file.attrs["particles"])))
        if "telemetry" in file:  # a campaign may keep none
            offset = file["telemetry"][policies[0]]["offset"][:]
            check("telemetry", int(offset[-1]), len(file["telemetry"][policies[0]]["q"]))
        check("units", file["traces"][policies[0]]["end_time"].attrs["unit"], "s")
        check("finite", bool(np.isfinite(values.to_numpy()).all()), True)
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
