#!/usr/bin/python3
"""Where and how hard the feet of a curb campaign strike the curb, of the traces that crossed.

usage: curb_strikes.py ARCHIVE.h5 [POLICY …]

ARCHIVE.h5 is a packed campaign of data/scenarios/quadruped_curb.yaml, run with --set record.events=true. The curb is
1 cm thick about y = -0.2 m; the robot comes from greater y. A touch is a beginning of contact in the archive's events; the
impulse of a whole contact is what the measures (task.measures) have as limit minus margin.
"""

import re
import sys

import h5py
import numpy as np

MIDDLE = -0.2  # m, y of the wall
HALF_WAY = 0.0125  # m, height on the wall above which a foot counts as high


def names(dataset):
    return [text.decode() for text in dataset[:]]


def touches(file, policy, crossed):
    """Beginnings of contact of a foot with the curb in crossing traces, as columns."""
    events = file[f"events/{policy}"]
    parts = names(file["names/colliders"])
    curb = parts.index("curb")
    offset = events["offset"][:]
    trace = np.repeat(np.arange(len(offset) - 1), np.diff(offset.astype(np.int64)))
    columns = {name: events[name][:] for name in ("time", "kind", "a", "b", "feature_a", "feature_b", "impulse", "position")}
    foot = np.where(columns["a"] == curb, columns["b"], columns["a"])
    is_foot = np.array([part.endswith("_FOOT") for part in parts])
    wanted = (columns["kind"] == 0) & ((columns["a"] == curb) | (columns["b"] == curb)) & is_foot[foot] & crossed[trace]
    out = {name: column[wanted] for name, column in columns.items()}
    feature = np.where(out["a"] == curb, out["feature_a"], out["feature_b"])
    label = {code: name for name, code in h5py.check_enum_dtype(events["feature_a"].dtype).items()}
    return {
        "trace": trace[wanted],
        "foot": np.array([parts[i] for i in foot[wanted]]),
        "feature": np.array([label[code] for code in feature]),
        "time": out["time"],
        "impulse": out["impulse"],
        "y": out["position"][:, 1],
        "z": out["position"][:, 2],
    }


def percent(part):
    return f"{100 * np.mean(part):.0f} %" if len(part) else "-"


def by_foot(feet):
    found, count = np.unique(feet, return_counts=True)
    return ", ".join(f"{name} {100 * k / len(feet):.0f} %" for name, k in zip(found, count))


def limits(file):
    """Measures of impulse by name, with their limits in N s and their columns."""
    out = []
    for i, text in enumerate(names(file["requirements/description"])):
        found = re.match(r"impulse between .* below (\S+) N s", text)
        if found:
            out.append((i, float(found.group(1))))
    return out


def report(file, policy):
    traces = file[f"traces/{policy}"]
    crossed = (traces["outcome"][:] != 3) & (traces["objective_margin"][:] >= 0)
    touch = touches(file, policy, crossed)
    side = touch["feature"] == "side"
    n = int(crossed.sum())
    print(f"{policy}: {n} of {len(crossed)} crossed")
    if n == 0:
        return
    print(f"  touched the curb: {len(np.unique(touch['trace']))}; its side: {len(np.unique(touch['trace'][side]))}")
    near = side & (touch["y"] > MIDDLE)
    print(f"  touches of the side: {side.sum()}; on the near side: {percent(touch['y'][side] > MIDDLE)}, "
          f"above {1e3 * HALF_WAY:g} mm: {percent(touch['z'][side] > HALF_WAY)}, "
          f"both: {percent((touch['z'][side] > HALF_WAY) & (touch['y'][side] > MIDDLE))}")
    print(f"  features touched: {by_foot(touch['feature'])}")
    print(f"  feet on the near side: {by_foot(touch['foot'][near])}")
    order = np.flatnonzero(side)[np.argsort(touch["time"][side], kind="stable")]
    trace, place = np.unique(touch["trace"][order], return_index=True)
    first = order[place]
    if len(trace):
        print(f"  first touch of a trace's side: on the near side: {percent(touch['y'][first] > MIDDLE)}, "
              f"above {1e3 * HALF_WAY:g} mm: {percent(touch['z'][first] > HALF_WAY)}; "
              f"{by_foot(touch['foot'][first])}; median time {np.median(touch['time'][first]):.2f} s")
    largest = {}
    for one, impulse in zip(touch["trace"][side], touch["impulse"][side]):
        largest[one] = max(largest.get(one, 0.0), impulse)
    if largest:
        values = 1e3 * np.array(list(largest.values()))
        print(f"  largest impulse of a first step on the side: median {np.median(values):.1f} mN s, "
              f"quartiles {np.quantile(values, 0.25):.1f} and {np.quantile(values, 0.75):.1f}")
    margins = traces["margins"][:]
    for i, limit in limits(file):
        values = 1e3 * (limit - margins[crossed, i])
        text = ", ".join(f"{100 * q:.0f} %: {np.quantile(values, q):.1f}" for q in (0.1, 0.25, 0.5, 0.75, 0.9))
        print(f"  largest impulse of a contact ({names(file['requirements/name'])[i]}), quantiles in mN s: {text}")


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    with h5py.File(sys.argv[1], "r") as file:
        for policy in sys.argv[2:] or names(file["policies/name"]):
            report(file, policy)


if __name__ == "__main__":
    main()
