#!/usr/bin/python3
"""Error against cost of both back ends, each beside its own run at a tiny step: the figure of docs/performance.md.

usage: work_precision.py GRAZE OUT.svg [FOLDER]

Runs `graze steps` on the shipped trot (its base) and arm (its tool) for steps of 0.1 to 10 ms, under every contact model
of both back ends, keeps the tables as CSV in FOLDER (default: beside OUT.svg) and draws them with gnuplot. Takes
about two minutes on one core.
"""

import csv
import pathlib
import subprocess
import sys

STEPS = "0.1ms,0.2ms,0.5ms,1ms,2ms,5ms,10ms"
ENGINES = [
    ("lanes", "complementarity"),
    ("lanes", "complementarity_free"),
    ("lanes", "compliant"),
    ("bullet", "dantzig"),
    ("bullet", "sequential_impulse"),
    ("bullet", "projected_gauss_seidel"),
]


def options_of(*assignments):
    return [word for one in assignments for word in ("--set", one)]


# Unperturbed robots. The trot by joint servos, which both back ends damp implicitly, for two cycles, before its paths
# part for good; the arm without the rotors that Bullet does not know, and without contact, so that one model is
# all. Its servos are stiff, and Bullet's explicit.
STUDIES = {
    "trot": ["quadruped_trot", *options_of("uncertain=~", "time.end=0.6 s", "policies.trot.control={joint_pd: {kp: 20, kd: 0.3}}")],
    "arm": ["arm_follow", "--policy", "servo", *options_of("uncertain=~", "actuators=~", "policies.prescribed=~")],
}


def study(graze, name, engine, model, file):
    options = ["--set", f"physics={engine}", "--set", f"contact.model={model}"]
    run = subprocess.run(
        [graze, "steps", *STUDIES[name], *options, "--steps", STEPS, "--reference", "0.02ms", "--csv"],
        capture_output=True,
        text=True,
    )
    if run.returncode != 0:
        sys.exit(run.stderr)
    file.write_text(run.stdout)


def points(file):
    """(cost in ms per simulated second, error in mm, step in ms) of the steps that are stable."""
    rows = [row for row in csv.DictReader(file.open()) if row["reference"] == "0"]
    return [
        (1e3 * float(row["cost"]), 1e3 * float(row["link_error"]), 1e3 * float(row["step"]))
        for row in rows
        if row["same"] == row["traces"] and row["cost"] and row["link_error"]
    ]


def draw(tables, out):
    """One panel for each study; a line for each engine and model, labelled with steps."""
    script = [
        f'set terminal {"svg" if out.suffix == ".svg" else "pngcairo"} size 1000,460 font "sans-serif,13" background "white"',
        f'set output "{out}"',
        "set multiplot layout 1,2 margins 0.08,0.98,0.13,0.8 spacing 0.1,0.1",
        'set logscale xy; set grid lc rgb "#dddddd"; set border lc rgb "#666666"',
        'set xlabel "processor time per simulated second, ms"; set format "%g"',
    ]
    colours = ["#1b6ca8", "#4fa3d1", "#0d3b66", "#d1495b", "#edae49", "#b07d2b"]
    for panel, (name, title) in enumerate((("trot", "Trot: base of LINKS, 0.6 s, servos"), ("arm", "Arm: tool, 5 s, servos"))):
        data, lines = [], []
        for i, (engine, model) in enumerate(ENGINES):
            found = tables.get((name, engine, model))
            if not found:
                continue
            block = f"$d{panel}_{i}"
            data.append(f"{block} << EOD\n" + "\n".join(f"{x} {y} {step:g}" for x, y, step in found) + "\nEOD")
            key = f"{engine}, {model}" if name == "trot" else engine
            lines.append(f'{block} using 1:2 with linespoints lw 2 pt 7 ps 0.6 lc rgb "{colours[i]}" title "{key}" noenhanced')
            if i in (0, 3):
                lines.append(f'{block} using 1:2:3 with labels left offset 0.6,0.5 font ",10" notitle')
        script += data
        script.append(f'set label 1 "{title}" at graph 0.03,0.06')
        script.append("set key outside top center maxrows 3 samplen 1.5 font ',11'")
        script.append('set ylabel "mean error, mm"' if panel == 0 else "unset ylabel")
        script.append("plot " + ", \\\n  ".join(lines))
    subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    graze, out = sys.argv[1], pathlib.Path(sys.argv[2])
    folder = pathlib.Path(sys.argv[3]) if len(sys.argv) == 4 else out.parent
    tables = {}
    for name in STUDIES:
        for engine, model in ENGINES:
            if name == "arm" and model not in ("complementarity", "dantzig"):
                continue
            file = folder / f"work_precision_{name}_{engine}_{model}.csv"
            if not file.exists():
                study(graze, name, engine, model, file)
            tables[name, engine, model] = points(file)
    draw(tables, out)


if __name__ == "__main__":
    main()
