#!/usr/bin/python3
"""Tables 12 to 14 of the dissertation for quadruped_waypoints.yaml beside this script: what each controller's trot came to.

usage: chapter7.py [GRAZE] [END]   the program (graze), and how long it trots ("30 s")

Errors of joints are means over joints and time of |q_des - q| and |v_des - v|; torques those that joints got, and their
change per second; forces the sum of the feet's normal forces, predicted against simulated, relative to the mean simulated
one. Time is counted from 1 s on, when it trots. A controller that fell has "-".
"""

import csv
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

GROUNDS = {
    "rigid, 0.1": ["contact.friction=0.1"],
    "rigid, 1.4": ["contact.friction=1.4"],
    "rigid by the convex model, 1.4": ["contact.friction=1.4", "contact.model=complementarity_free"],
    "compliant, 0.1": ["contact.friction=0.1", "contact.model=compliant", "contact.stiffness=9320"],
    "compliant, 1.4": ["contact.friction=1.4", "contact.model=compliant", "contact.stiffness=9320"],
}
SCENARIO = str(pathlib.Path(__file__).with_name("quadruped_waypoints.yaml"))
POLICIES = ["id/qp_coulomb", "id/lcp_coulomb", "id-no-slip/qp_no_slip", "id-no-slip/lcp_no_slip", "sensed/0ms", "sensed/1ms",
            "pid"]
START, STEP = 1.0, 1e-3  # s
WANTED = r"^(time|[qv]\.[LR].*rad|tau\.|targets_in_force\.[qv]\.|tracker\.)"


def columns(path, pattern):
    """The columns of a CSV whose names match, [row][column], and their names."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        names = next(rows)
        wanted = [i for i, name in enumerate(names) if re.search(pattern, name)]
        data = [[float(row[i] or "nan") for i in wanted] for row in rows]
    return np.array(data), [names[i] for i in wanted]


def simulated_forces(path, times):
    """The sum of the feet's normal forces at each of the times, N."""
    out = np.zeros(len(times))
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            out[int(round(float(row["time [s]"]) / STEP))] += float(row["normal_impulse [N s]"]) / STEP
    return out


def measures(stem):
    """What a replay came to, or None if it fell."""
    joints, names = columns(f"{stem}.csv", WANTED)

    def pick(prefix):
        return joints[:, [i for i, name in enumerate(names) if name.startswith(prefix)]]

    time = joints[:, 0]
    late = time > START
    goal_q, goal_v = pick("targets_in_force.q."), pick("targets_in_force.v.")
    q, v, tau = pick("q."), pick("v."), pick("tau.")
    # Targets of a row are those of the step that led to it.
    out = {
        "q": np.nanmean(np.abs(goal_q - q)[late]),
        "v": np.nanmean(np.abs(goal_v - v)[late]),
        "tau": np.mean(np.abs(tau)[late]),
        "rate": np.mean(np.abs(np.diff(tau, axis=0))[late[1:]]) / STEP,
    }
    predicted = pick("tracker.")
    if predicted.shape[1]:
        pressed = simulated_forces(f"{stem}.contacts.csv", time)
        off = np.abs(predicted.sum(axis=1) - pressed)[late]
        out["force"], out["share"] = np.nanmean(off), np.nanmean(off) / np.mean(pressed[late])
    return out


def main():
    """Prints a table for each ground."""
    graze = sys.argv[1] if len(sys.argv) > 1 else "graze"
    end = sys.argv[2] if len(sys.argv) > 2 else "30 s"
    for ground, overrides in GROUNDS.items():
        print(f"\n{ground}\n\n| controller | rad | rad/s | N m | N m/s | force error, N | relative |\n|---|---|---|---|---|---|---|")
        with tempfile.TemporaryDirectory() as folder:
            sets = [word for text in overrides + [f"time.end={end}"] for word in ("--set", text)]
            archive = f"{folder}/a.graze"
            subprocess.run([graze, "run", SCENARIO, "-n", "1", "-o", archive, "--telemetry", "none", *sets],
                           check=True, capture_output=True)
            for policy in POLICIES:
                told = subprocess.run([graze, "replay", archive, "--particle", "0", "--policy", policy, "-o", f"{folder}/t.csv", "--force"],
                                      check=True, capture_output=True, text=True).stdout
                m = measures(f"{folder}/t")
                if "VIOLATED" in told:
                    print(f"| {policy} | - | | | | | |")
                    continue
                force = f"{m['force']:.2f} | {100 * m['share']:.2f} %" if "force" in m else "|"
                print(f"| {policy} | {m['q']:.4f} | {m['v']:.3f} | {m['tau']:.3f} | {m['rate']:.1f} | {force} |", flush=True)


if __name__ == "__main__":
    main()
