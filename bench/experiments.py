#!/usr/bin/python3
"""The experiments of Chapters 3 and 4 and those beside them, under both back ends: the table "All experiments" of
docs/results.md.

usage: experiments.py [GRAZE] [--only NAME ...] [--scale X]

Every campaign has seed 1 and runs on one thread. Verdicts are successes among valid traces with Wilson's 95 % interval,
as `graze score` tells them (of the curb, who crossed); times are processor time of the whole campaign, so that what else the machine does
matters little; traces/s are of one core. --scale 0.1 runs a tenth of the particles.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile

BULLET = ["--set", "physics=bullet"]
MODELS = ["--set", "uncertain.contact.model={choice: [sequential_impulse, dantzig, projected_gauss_seidel]}"]
DURATIONS = ["--set", "policies.walk.over={gait.duration: [0.6 s, 1 s, 1.1 s, 1.2 s, 1.5 s]}"]
PICK = BULLET + MODELS + ["--set", "time.step=0.25 ms"]

# name: scenario, particles on lanes, particles on Bullet, what both take, what Bullet takes, what counts, published time
EXPERIMENTS = {
    "strike": ("pendulum_strike", 2000, 2000, [], BULLET, "success", "not told"),
    "sources": ("quadruped_sources", 400, 40, [], BULLET + MODELS, "success", "not told"),
    "pick": ("pick_ball", 400, 40, [], PICK, "success", "about 10 s for 40 on 8 threads"),
    "pick, published": ("pick_ball_published", 400, 40, [], PICK, "success", "about 10 s for 40 on 8 threads"),
    "curb": ("quadruped_curb", 400, 40, [], BULLET + MODELS, "objective_met", "not told"),
    "curb, published": ("quadruped_curb_published", 400, 40, [], BULLET + MODELS, "objective_met", "not told"),
    "transition": ("quadruped_gait_transition", 400, 20, [], BULLET + MODELS, "success", "not told"),
    "duration": ("quadruped_gait_duration", 100, 10, DURATIONS, BULLET + MODELS, "success", "not told"),
    "curb, published controller": ("quadruped_curb_inverse_dynamics", 200, 20, [], BULLET + MODELS, "objective_met", ""),
    "curb, servos": ("quadruped_curb_servos", 200, 20, [], BULLET + MODELS, "objective_met", ""),
    "transition, servos": ("quadruped_gait_transition_servos", 200, 20, [], BULLET + MODELS, "success", ""),
    "duration, servos": ("quadruped_gait_duration_servos", 100, 10, DURATIONS, BULLET + MODELS, "success", ""),
    "push": ("quadruped_push", 400, 100, [], BULLET, "success", ""),
    "terrain": ("quadruped_terrain", 200, 20, [], BULLET + MODELS, "success", ""),
    "rough": ("quadruped_rough", 200, 20, [], BULLET + MODELS, "success", ""),
    "drive": ("quadruped_drive", 64, 16, [], BULLET, "success", ""),
}


def wilson(k, n):
    """95 % interval of a rate, per cent."""
    if n == 0:
        return 0.0, 100.0
    z = 1.959963984540054
    centre, half = (k + z * z / 2) / (n + z * z), z / (n + z * z) * (k * (n - k) / n + z * z / 4) ** 0.5
    return 100 * max(0.0, centre - half), 100 * min(1.0, centre + half)


def call(command):
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(" ".join(command) + "\n" + run.stderr)
    return run.stdout


def campaign(graze, scenario, particles, settings, folder):
    """Scores by policy, and processor time, s."""
    archive = str(pathlib.Path(folder) / "campaign.graze")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call([graze, "run", scenario, "-n", str(particles), "--seed", "1", "--threads", "1", "--quiet", "--force", "-o", archive, *settings])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    scores = json.loads(call([graze, "score", archive, "--json"]))["policies"]
    return scores, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def verdict(score, what):
    k, n = score[what], score["n"]
    low, high = wilson(k, n)
    invalid = f", {score['invalid']} invalid" if score["invalid"] else ""
    return f"{k} of {n} ({low:.0f} to {high:.0f} %{invalid})"


def rows_of(graze, name, scale, folder):
    scenario, lanes, bullet, both, settings, what, published = EXPERIMENTS[name]
    lane_scores, lane_time = campaign(graze, scenario, max(1, round(lanes * scale)), both, folder)
    bullet_scores, bullet_time = campaign(graze, scenario, max(1, round(bullet * scale)), both + settings, folder)
    traces = sum(s["n"] + s["invalid"] for s in lane_scores)
    bullet_traces = sum(s["n"] + s["invalid"] for s in bullet_scores)
    for i, (lane, other) in enumerate(zip(lane_scores, bullet_scores)):
        times = ["", "", "", ""]
        if i == 0:
            times = [f"{lane_time:.2g} s", f"{traces / lane_time:.2g}", f"{bullet_traces / bullet_time:.2g}", published]
        yield [f"`{scenario}`" if i == 0 else "", lane["policy"], verdict(lane, what), verdict(other, what), *times]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("graze", nargs="?", default="graze")
    parser.add_argument("--only", nargs="+", choices=list(EXPERIMENTS), default=list(EXPERIMENTS))
    parser.add_argument("--scale", type=float, default=1.0)
    arguments = parser.parse_args()
    print("| scenario | policy | lanes | Bullet | lanes, time | traces/s | Bullet, traces/s | published time |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.only:
            for row in rows_of(arguments.graze, name, arguments.scale, folder):
                print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
