"""Do all ways of reading a campaign give the same numbers?

Usage: same_numbers.py CAMPAIGN.h5 SCORE.json REPORT.json EXPLAIN.json SCORE.txt. Counts, rates and quantiles are found
anew by h5py and pandas alone and are to agree to the bit; bounds of intervals agree to the bit among the outputs, and
solve Clopper and Pearson's equations; what is printed is what the numbers round to. Prints what differs; exit code 0 if
nothing does.
"""
import collections
import json
import math
import sys

import h5py
import numpy as np
import pandas as pd

S, K, U, INVALID = 0, 1, 2, 3
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95)
wrong = []


def check(what, found, wanted):
    if found != wanted:
        wrong.append(f"{what}: {found}, and {wanted} elsewhere")


def tail(k, n, p):
    """P(X >= k) of n tries that succeed with p each."""
    return math.fsum(math.comb(n, i) * p**i * (1 - p)**(n - i) for i in range(k, n + 1))


def check_interval(what, interval, k, n):
    """Clopper and Pearson at 95 %: each bound leaves a tail of 2.5 %, to the rounding of such sums."""
    low, high = interval
    if n == 0:
        return check(what, [low, high], [0, 1])
    solved = (low == 0 if k == 0 else abs(tail(k, n, low) - 0.025) < 1e-10)
    solved &= (high == 1 if k == n else abs(1 - tail(k + 1, n, high) - 0.025) < 1e-10)
    if not solved:
        wrong.append(f"{what}: {interval} are not the bounds of {k} of {n}")


def quantile(margins, p):
    """docs/statistics.md: linear between the values in their order."""
    if margins.empty:
        return None
    values = np.sort(margins.to_numpy())
    place = p * (len(values) - 1)
    low = int(place)
    high = min(low + 1, len(values) - 1)
    if values[low] == values[high]:
        return values[low]
    return values[low] + (place - low) * (values[high] - values[low])


def printed_rows(text, head):
    """Cells of the table that begins with `head`, by the first one."""
    lines = text.split("\n")
    first = next(i for i, line in enumerate(lines) if line.split()[:len(head)] == head)
    rows = {}
    for line in lines[first + 1:]:
        if not line:
            break
        cells = line.split()
        rows[cells[0]] = cells[1:]
    return rows


def main(campaign, *outputs):
    score, report, explained = (json.load(open(name)) for name in outputs[:3])
    text = open(outputs[3]).read()
    check("score in the report", report["score"], score)
    check("complete", explained["complete"], score["complete"])
    main_table = printed_rows(text, ["policy", "N", "S", "K", "U"])
    known_table = printed_rows(text, ["policy"] + score["requirements"])
    with h5py.File(campaign) as file:
        check("complete in the file", bool(file.attrs["complete"]), score["complete"])
        check("INCOMPLETE is printed", "INCOMPLETE" in text, not score["complete"])
        requirements = list(file["requirements/name"].asstr()[:])
        for p, policy in enumerate(file["policies/name"].asstr()[:]):
            group = file["traces"][policy]
            frame = pd.DataFrame({name: group[name][:] for name in ("outcome", "violated", "objective_margin",
                                                                    "end_time")})
            margins = pd.DataFrame(group["margins"][:], columns=requirements)
            one, other = score["policies"][p], explained["policies"][p]
            check("policy", [one["policy"], other["policy"]], [policy, policy])
            valid = frame[frame.outcome != INVALID]
            counts = {name: int((valid.outcome == code).sum())
                      for name, code in (("success", S), ("known_failure", K), ("unknown_failure", U))}
            counts |= {"n": len(valid), "invalid": len(frame) - len(valid)}
            for name, count in counts.items():
                check(f"{policy}: {name} in score", one[name], count)
                check(f"{policy}: {name} in explain", other[name], count)
            n, success = counts["n"], counts["success"]
            rate = success / n if n else None
            check(f"{policy}: rate in score", one["rate"], rate)
            check(f"{policy}: rate in explain", other["rate"]["rate"], rate)
            check(f"{policy}: interval", other["rate"]["interval"], one["interval"])
            check_interval(policy, one["interval"], success, n)
            low, high = (f"{x:.4f}" for x in one["interval"])
            cells = [str(counts[k]) for k in ("n", "success", "known_failure", "unknown_failure", "invalid")]
            cells += ["-" if rate is None else f"{rate:.4f}", low, "..", high]
            check(f"{policy}: printed", main_table[policy][:len(cells)], cells)
            # Ways to fail: requirement by requirement, and those that the report tells, which differ by culprits, too.
            by = {name: int((valid.violated[valid.outcome == K] == i).sum()) for i, name in enumerate(requirements)}
            decide = {name: by[name] for name in score["requirements"]}
            check(f"{policy}: by requirement", one["by_requirement"], decide)
            check(f"{policy}: by requirement, printed", known_table.get(policy), [str(x) for x in decide.values()])
            ways = collections.Counter()
            for way in report["ways"]:
                if way["policy"] == policy:
                    ways[way["what"] if way["outcome"] == "known failure" else way["outcome"]] += way["traces"]
            wanted = {name: count for name, count in decide.items() if count}
            if counts["unknown_failure"]:
                wanted["unknown failure"] = counts["unknown_failure"]
            if counts["invalid"]:
                wanted["invalid"] = counts["invalid"]
            check(f"{policy}: ways to fail in the report", dict(ways), wanted)
            # Margins.
            columns = [(name, margins[name]) for name in requirements] + [("objective", frame.objective_margin)]
            step, end = file.attrs["step"], file.attrs["end"]
            cut = (frame.outcome == K) & ~(np.round(frame.end_time / step) >= np.round(end / step))
            for (name, column), told, bins in zip(columns, other["margins"], report["margins"]):
                every = column[valid.index].dropna()
                # A margin is judged unless a violation cut the trace short before; the objective is asked at the end.
                kept = np.isfinite(column) & ~(cut & ((column >= 0) | (name == "objective")))
                column = column[valid.index[kept[valid.index]]]
                check(f"{policy}: margin", [told["name"], bins["name"]], [name, name])
                check(f"{policy}: {name}: n", told["n"], len(column))
                for p_of, entry in zip(QUANTILES, told["quantiles"]):
                    check(f"{policy}: {name}: quantile", [entry["p"], entry["margin"]], [p_of, quantile(column, p_of)])
                check(f"{policy}: {name}: below 0", told["below_0"], int((column < 0).sum()))
                check_interval(f"{policy}: {name}", told["interval"], told["below_0"], told["n"])
                counted = next(c for c in bins["policies"] if c["policy"] == policy)["bins"]
                sums = [sum(b[k] for b in counted) for k in range(3)]
                outcomes = valid.outcome[every.index]
                check(f"{policy}: {name}: histogram", sums, [int((outcomes == k).sum()) for k in (S, K, U)])
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
