#!/usr/bin/python3
"""Where the ball ends in the traces of the picking task, by policy (Figure 11 of the dissertation).

usage: pick_places.py ARCHIVE.h5 PICTURE.png

ARCHIVE.h5 is a campaign of data/scenarios/pick_ball.yaml, written by `graze run … -o ARCHIVE.h5`. Prints where the ball
is held on average, how far that scatters, and where those balls are that were not picked up. gnuplot draws the picture.
"""

import subprocess
import sys

import h5py
import numpy as np

SUCCESS = 0
START = (0.3, 0.14)  # m, of the ball, x and y
REST = -0.0246  # m, height of its centre on the ground

HEAD = """set terminal pngcairo size 1000,400 font "sans,11"
set output "{file}"
set multiplot layout 1,{count}
set xrange [0:70]
set yrange [-4:12]
set xlabel "x, cm"
set ylabel "z, cm"
set key top right
"""
PANEL = """set title "{title}"
plot "-" using 1:2 with points pointtype 7 pointsize 0.4 linecolor "#bb3333" title "not held", \\
     "-" using 1:2 with points pointtype 7 pointsize 0.4 linecolor "#226688" title "held"
"""


def rows(place):
    """x and z in cm, as gnuplot reads them."""
    return "".join(f"{100 * x:.2f} {100 * z:.2f}\n" for x, _, z in place) + "e\n"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with h5py.File(sys.argv[1]) as file:
        script = HEAD.format(file=sys.argv[2], count=len(file["traces"]))
        for policy, traces in file["traces"].items():
            place = traces["final_q"][:, -3:]
            won = traces["outcome"][:] == SUCCESS
            script += PANEL.format(title=f"{policy}: {won.sum()} of {len(won)} held") + rows(place[~won]) + rows(place[won])
            held, lost = 100 * place[won], place[~won]
            if len(held) > 0:
                print(f"{policy}: held at {held.mean(axis=0).round(1)} cm, standard deviation {held.std(axis=0).round(1)} cm")
            if len(lost) == 0:
                continue
            away = 100 * np.linalg.norm(lost[:, :2] - START, axis=1)
            rest = np.mean(np.abs(lost[:, 2] - REST) < 2e-3)
            print(f"{policy}: {len(lost)} not held, {rest:.0%} of them rest on the ground, {np.percentile(away, [25, 50, 75]).round(1)} cm away (quartiles)")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)


if __name__ == "__main__":
    main()
