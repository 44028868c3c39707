#!/usr/bin/python3
"""Figure 60 of the dissertation for arm_grasp_box.yaml beside this script: how near the arm stays to its way, and when the box is lost.

usage: grasp.py [GRAZE]   the program (graze)

Errors are means and largest values over the seven joints of the arm and all steps of |q_des - q|. The box counts as lost
after the last step in which a finger pressed.
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

SCENARIO = str(pathlib.Path(__file__).with_name("arm_grasp_box.yaml"))
POLICIES = ["qp-coulomb", "lcp-coulomb", "qp-no-slip", "none", "sensed", "joint-pd"]
JOINTS = ["X_1", "Y_2", "Z_3", "X_4", "Y_5", "Z_6", "X_7"]
FINGERS = ["FINGER00", "FINGER01", "FINGER10", "FINGER11"]
MARGIN = 0.05  # s: no grip pauses for longer


def find(names, *parts):
    """The one column that begins so."""
    found = [name for name in names if name.split(" ")[0] in parts]
    if len(found) != 1:
        raise SystemExit(f"{parts}: {found} of {names}")
    return found[0]


def measures(path):
    """Mean and largest error, rad, and when the box is lost, s."""
    total, count, worst, pressed, end = 0.0, 0, 0.0, 0.0, 0.0
    with open(path, newline="", encoding="utf-8") as file:
        rows = csv.DictReader(file)
        names = rows.fieldnames
        pairs = [(find(names, f"targets_in_force.q.{joint}"), find(names, f"q.{joint}")) for joint in JOINTS]
        time, forces = find(names, "time"), [find(names, f"truth.link_force.{finger}") for finger in FINGERS]
        for row in rows:
            if not row[pairs[0][0]]:
                continue
            for goal, q in pairs:
                off = abs(float(row[goal]) - float(row[q]))
                total, count, worst = total + off, count + 1, max(worst, off)
            end = float(row[time])
            if any(float(row[force]) > 0 for force in forces):
                pressed = end
    return total / count, worst, pressed if pressed < end - MARGIN else math.inf


def main():
    """Prints a table."""
    graze = sys.argv[1] if len(sys.argv) > 1 else "graze"
    print("| friction | controller | mean error, rad | largest | box lost at |\n|---|---|---|---|---|")
    for friction in (1, 100):
        with tempfile.TemporaryDirectory() as folder:
            archive = f"{folder}/a.graze"
            subprocess.run([graze, "run", SCENARIO, "-n", "1", "-o", archive, "--set", f"contact.friction={friction}"],
                           check=True, capture_output=True)
            for policy in POLICIES:
                subprocess.run([graze, "replay", archive, "--particle", "0", "--policy", policy, "-o", f"{folder}/t.csv",
                                "--force"], check=True, capture_output=True)
                mean, worst, lost = measures(f"{folder}/t.csv")
                told = "" if math.isinf(lost) else f"{lost:.2f} s"
                print(f"| {friction} | {policy} | {mean:.5f} | {worst:.4f} | {told} |", flush=True)


if __name__ == "__main__":
    main()
