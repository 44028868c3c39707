#!/usr/bin/python3
"""Tables 12 to 14 of the dissertation for quadruped_waypoints.yaml beside this script: what each controller's trot came to.

usage: chapter7.py [GRAZE] [END] [N]     the program (graze), how long it trots ("30 s"), and how many robots do (1)
       chapter7.py GRAZE END N chatter   Figure 57 instead: two stages and one of the convex program (`regularization`)

With N > 1 each robot's encoders are off by 1e-4 rad, which is enough for their steps to part; the tables then have means over the robots
that did not fall with their 95 % intervals by Student's t, and how many fell.

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
REGULARIZATIONS = ["1e-9", "1e-6", "1e-4", "1e-3", "1e-2"]  # to 1e-6: two stages; 1e-3: one
# Student's t at 97.5 %, of 1, 2, … degrees of freedom; beyond, that of many
STUDENT = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120]
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


def trot(graze, overrides, policies, particles):
    """What each particle of each policy came to, [policy][particle]: measures(), or None where it fell."""
    if particles > 1:
        overrides = [*overrides, "uncertain={robot.joint.*.zero: {normal: {std: 1e-4 rad}}}"]
    sets = [word for text in overrides for word in ("--set", text)]
    chosen = [word for policy in policies for word in ("--policy", policy)]
    out = {policy: [] for policy in policies}
    with tempfile.TemporaryDirectory() as folder:
        archive = f"{folder}/a.graze"
        subprocess.run([graze, "run", SCENARIO, "-n", str(particles), "-o", archive, "--telemetry", "none", *chosen, *sets],
                       check=True, capture_output=True)
        for policy in policies:
            for particle in range(particles):
                told = subprocess.run([graze, "replay", archive, "--particle", str(particle), "--policy", policy, "-o",
                                       f"{folder}/t.csv", "--force"], check=True, capture_output=True, text=True).stdout
                fell = "VIOLATED" in told or "invalid" in told
                out[policy].append(None if fell else measures(f"{folder}/t"))
    return out


def mean(traces, key, digits, factor=1):
    """Mean over the traces that did not fall, with the half width of its interval where there are several."""
    values = np.array([factor * m[key] for m in traces if m and key in m])
    if len(values) == 0:
        return ""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    half = STUDENT[min(len(values) - 2, len(STUDENT) - 1)] * np.std(values, ddof=1) / np.sqrt(len(values))
    return f"{np.mean(values):.{digits}f} ± {half:.{digits}f}"


def row(name, traces):
    """A row of a table."""
    fell = sum(m is None for m in traces)
    cells = [name, mean(traces, "q", 4), mean(traces, "v", 3), mean(traces, "tau", 3), mean(traces, "rate", 1),
             mean(traces, "force", 2), mean(traces, "share", 2, 100), f"{fell} of {len(traces)}"]
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    """Prints a table for each ground."""
    graze = sys.argv[1] if len(sys.argv) > 1 else "graze"
    end = sys.argv[2] if len(sys.argv) > 2 else "30 s"
    particles = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    chatter = sys.argv[4:] == ["chatter"]
    for ground, overrides in GROUNDS.items():
        print(f"\n{ground}\n\n| controller | rad | rad/s | N m | N m/s | force error, N | relative, % | fell |\n" + "|---" * 8 + "|")
        sets = overrides + [f"time.end={end}"]
        if chatter:
            for weight in REGULARIZATIONS:
                weighed = sets + [f"policies.id.control.inverse_dynamics.regularization={weight}"]
                row(f"regularization {weight}", trot(graze, weighed, ["id/qp_coulomb"], particles)["id/qp_coulomb"])
            continue
        for policy, traces in trot(graze, sets, POLICIES, particles).items():
            row(policy, traces)


if __name__ == "__main__":
    main()
