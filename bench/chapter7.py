#!/usr/bin/python3
"""Tables 12 to 14 of the dissertation for quadruped_waypoints.yaml: what each controller's trot came to.

usage: chapter7.py [GRAZE] [END] [N]           the program (graze), how long it trots ("30 s"), and how many robots do (1)
       chapter7.py GRAZE END N chatter         Figure 57: two stages and one of the convex program (`regularization`)
       chapter7.py GRAZE END N hills           Figure 58: over hills (quadruped_waypoints_hills.yaml)
       chapter7.py GRAZE END 1 paths FILE.svg  Figure 59: paths of the centre of mass on sticky and on slippery ground

With N > 1 each robot's encoders are off by 1e-4 rad, which is enough for their steps to part; the tables then have means over the robots
that did not fall with their 95 % intervals by Student's t, and how many fell.

Errors of joints are means over joints and time of |q_des - q| and |v_des - v|; torques those that joints got, and their
change per second; forces the sum of the feet's normal forces, predicted against simulated, relative to the mean simulated
one. Time is counted from 1 s on, when it trots. A controller that fell has no numbers.
"""

import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

GROUNDS = {
    "rigid, 0.1": ["contact.friction=0.1"],
    "rigid, 1.4": ["contact.friction=1.4"],
    "rigid by the convex model, 1.4": ["contact.friction=1.4", "contact.model=complementarity_free"],
    "compliant, 0.1": ["contact.friction=0.1", "contact.model=compliant", "contact.stiffness=9320"],
    "compliant, 1.4": ["contact.friction=1.4", "contact.model=compliant", "contact.stiffness=9320"],
}
SCENARIOS = pathlib.Path(__file__).resolve().parent.parent / "data/scenarios"
FLAT, HILLS = str(SCENARIOS / "quadruped_waypoints.yaml"), str(SCENARIOS / "quadruped_waypoints_hills.yaml")
POLICIES = {"id/qp_coulomb": "QP, μ", "id/lcp_coulomb": "LCP, μ", "id-no-slip/qp_no_slip": "QP, ∞",
            "id-no-slip/lcp_no_slip": "LCP, ∞", "sensed/0ms": "ID(t_i−1)", "sensed/1ms": "ID(t_i−2)", "pid": "PID"}
WAYPOINTS = [[0, 0], [0.25, 0], [0, 0.25], [0, -0.25], [-0.25, 0], [0.25, 0]]  # m; the first leg, and then round
REGULARIZATIONS = ["1e-9", "1e-6", "1e-4", "1e-3", "1e-2"]  # to 1e-6: two stages; 1e-3: one
# Student's t at 97.5 %, of 1, 2, … degrees of freedom; beyond, that of many
STUDENT = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
           2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042]
START, STEP = 1.0, 1e-3  # s


def simulated_forces(file, frames):
    """The sum of the feet's normal forces in each frame, N."""
    return np.bincount(file["contacts/frame"][:], file["contacts/normal_impulse"][:], frames) / STEP


def measures(path):
    """What a replay came to, or None if it fell."""
    with h5py.File(path) as file:
        if file.attrs["violated"] or file.attrs["outcome"] == "invalid":
            return None
        telemetry, names = file["telemetry"], file["names/q"].asstr()[:]
        time, tau = telemetry["time"][:], telemetry["tau"][:]
        base = len(names) - tau.shape[1]  # q of the base; v has one less
        # Targets of a row are those of the step that led to it.
        off_q = telemetry["targets_in_force/q"][:] - telemetry["q"][:, base:]
        off_v = telemetry["targets_in_force/v"][:] - telemetry["v"][:, base - 1:]
        late = time > START
        out = {
            "q": np.nanmean(np.abs(off_q)[late]),
            "v": np.nanmean(np.abs(off_v)[late]),
            "tau": np.mean(np.abs(tau)[late]),
            "rate": np.mean(np.abs(np.diff(tau, axis=0))[late[1:]]) / STEP,
        }
        if "tracker" in telemetry and telemetry["tracker"].shape[1]:
            pressed = simulated_forces(file, len(time))
            off = np.abs(telemetry["tracker"][:].sum(axis=1) - pressed)[late]
            out["force"], out["share"] = np.nanmean(off), np.nanmean(off) / np.mean(pressed[late])
    return out


def path_of(path):
    """x and y of the centre of mass in a replay, m, and whether it fell."""
    with h5py.File(path) as file:
        return file["telemetry/centre_of_mass"][:, :2], bool(file.attrs["violated"]) or file.attrs["outcome"] == "invalid"


def trot(graze, scenario, overrides, policies, particles, tell):
    """What `tell` makes of the replay of each particle of each policy, [policy][particle]."""
    sets = [word for text in overrides for word in ("--set", text)]
    chosen = [word for policy in policies for word in ("--policy", policy)]
    out = {policy: [] for policy in policies}
    with tempfile.TemporaryDirectory() as folder:
        archive = f"{folder}/a.graze"
        subprocess.run([graze, "run", scenario, "-n", str(particles), "-o", archive, "--telemetry", "none", *chosen, *sets],
                       check=True, capture_output=True)
        for policy in policies:
            for particle in range(particles):
                subprocess.run([graze, "replay", archive, "--particle", str(particle), "--policy", policy, "-o",
                                f"{folder}/t.h5", "--force"], check=True, capture_output=True)
                out[policy].append(tell(f"{folder}/t.h5"))
    return out


def mean(values, digits):
    """Their mean, with the half width of its interval where there are several."""
    if len(values) == 0:
        return ""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    half = STUDENT[min(len(values) - 2, len(STUDENT) - 1)] * np.std(values, ddof=1) / np.sqrt(len(values))
    return f"{np.mean(values):.{digits}f} ± {half:.{digits}f}"


def row(name, traces):
    """A row of a table, of the traces that did not fall."""
    stood = [m for m in traces if m]

    def cell(key, digits, factor=1.0):
        return mean(np.array([factor * m[key] for m in stood if key in m]), digits)

    cells = [name, cell("q", 4), cell("v", 3), cell("tau", 3), cell("rate", 1), cell("force", 2), cell("share", 1, 100),
             f"{len(traces) - len(stood)} of {len(traces)}"]
    print("| " + " | ".join(cells) + " |", flush=True)


def head(title):
    """The head of a table."""
    print(f"\n{title}\n\n| controller | rad | rad/s | N m | N m/s | force error, N | relative, % | fell |\n" + "|---" * 8 + "|",
          flush=True)


def tables(graze, end, particles, chatter):
    """A table for each ground."""
    for ground, overrides in GROUNDS.items():
        head(ground)
        sets = overrides + [f"time.end={end}"]
        if particles > 1:
            sets.append("uncertain={robot.joint.*.zero: {normal: {std: 1e-4 rad}}}")
        if not chatter:
            for policy in POLICIES:
                row(policy, trot(graze, FLAT, sets, [policy], particles, measures)[policy])
            continue
        for weight in REGULARIZATIONS:
            weighed = sets + [f"policies.id.control.inverse_dynamics.regularization={weight}"]
            row(f"regularization {weight}", trot(graze, FLAT, weighed, ["id/qp_coulomb"], particles, measures)["id/qp_coulomb"])


def hills(graze, end, particles):
    """Figure 58: a table, and by how much less joints are off than those of PID, robot by robot."""
    head("hills, friction 0.1 to 1.5")
    found = {}
    for policy in POLICIES:
        found[policy] = trot(graze, HILLS, [f"time.end={end}"], [policy], particles, measures)[policy]
        row(policy, found[policy])
    for policy in found:
        less = [100 * (1 - a["q"] / b["q"]) for a, b in zip(found[policy], found["pid"]) if a and b]
        if policy != "pid":
            print(f"{policy}: {mean(np.array(less), 1)} % less than pid, {len(less)} robots")


def length(path, every):
    """Of the way through the points of every so many steps, after START, m."""
    return np.linalg.norm(np.diff(path[round(START / STEP)::every], axis=0), axis=1).sum()


def draw_path(panel, path, fell):
    """A path between the waypoints, with a cross where it ends by a fall."""
    panel.plot(*np.array(WAYPOINTS).T, color="0.75", linewidth=1, marker="o", markersize=3)
    panel.plot(*path[::50].T, color="#2b6ca3", linewidth=0.8)
    if fell:
        panel.plot(*path[-1], color="#b3362b", marker="x", markersize=6)
    panel.set_xlim(-0.5, 0.5)
    panel.set_ylim(-0.5, 0.5)
    panel.set_aspect("equal")
    panel.tick_params(labelsize=7)


def paths(graze, end, output):
    """Figure 59: paths of the centre of mass from above, and how much longer they are than without what they do within a
    second."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "graze"
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, len(POLICIES), figsize=(12.5, 4.3), sharex=True, sharey=True, layout="constrained")
    for line, ground in zip(axes, ("rigid, 1.4", "rigid, 0.1")):
        found = trot(graze, FLAT, GROUNDS[ground] + [f"time.end={end}"], list(POLICIES), 1, path_of)
        for panel, (policy, name) in zip(line, POLICIES.items()):
            path, fell = found[policy][0]
            draw_path(panel, path, fell)
            seen = f"fell at {len(path) * STEP:.1f} s" if fell else (
                f"seen every 10 ms {length(path, 10) / length(path, 1000):.2f} times as long as every second")
            print(f"{ground}, {policy}: {seen}", flush=True)
            panel.set_title(f"{name}, on {ground.split()[1]}", fontsize=9)
    figure.supxlabel("x, m", fontsize=8)
    figure.supylabel("y, m", fontsize=8)
    figure.savefig(output, metadata={"Date": None})


def main():
    """Prints tables, or draws."""
    graze = sys.argv[1] if len(sys.argv) > 1 else "graze"
    end = sys.argv[2] if len(sys.argv) > 2 else "30 s"
    particles = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    what = sys.argv[4] if len(sys.argv) > 4 else "tables"
    if what == "paths":
        paths(graze, end, sys.argv[5])
    elif what == "hills":
        hills(graze, end, particles)
    else:
        tables(graze, end, particles, what == "chatter")


if __name__ == "__main__":
    main()
