#!/usr/bin/python3
"""Random, Latin hypercube and Sobol samples on the pendulum that hardly ever strikes an object (dissertation §3.2.3):
the hit probability that each tells, how that scatters from seed to seed, and how many samples it takes to the first hit.

usage: strikes.py GRAZE [-n PARTICLES] [--replications R] [--scenario FILE]

Runs `GRAZE run pendulum_strike` for each design with the seeds 1 … R. Intervals are of 95 %: of means by Student's
t, of the ratio of two variances by Fisher's F of normal estimates. A replication without any hit counts as
censored behind its last sample; there are none with 1000 particles and 3 %.
"""

import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

DESIGNS = ("random", "latin_hypercube", "sobol")
SUCCESS = 0


def hits(arguments, design, seed, folder):
    """Whether each particle struck, in the order of the samples."""
    file = pathlib.Path(folder) / "strikes.h5"
    command = [arguments.graze, "run", arguments.scenario, "-n", str(arguments.particles), "--seed", str(seed), "--quiet"]
    command += ["--force", "--set", f"sampling.design={design}", "-o", str(file)]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(run.stderr)
    with h5py.File(file) as archive:
        traces = archive["traces/free"]
        order = np.argsort(traces["particle"][:])
        return traces["outcome"][:][order] == SUCCESS


def mean_text(values, digits):
    """Mean with the half width of its interval (of 200 values Student's t is 1.972)."""
    half = 1.972 * np.std(values, ddof=1) / math.sqrt(len(values))
    return f"{np.mean(values):.{digits}f} ± {half:.{digits}f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("graze")
    parser.add_argument("-n", "--particles", type=int, default=1024)
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--scenario", default="pendulum_strike")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        table = {
            design: np.array([hits(arguments, design, seed, folder) for seed in range(1, arguments.replications + 1)])
            for design in DESIGNS
        }
    print(f"{arguments.replications} replications of {arguments.particles} samples each")
    print(f"{'design':16}{'hit probability, %':>24}{'sd of a replication, %':>26}{'samples to the first hit':>28}{'median':>8}")
    for design, struck in table.items():
        rates = 100 * struck.mean(axis=1)
        first = np.where(struck.any(axis=1), struck.argmax(axis=1) + 1, arguments.particles + 1)
        sd = np.std(rates, ddof=1)
        # The interval of a standard deviation from chi-square by Wilson and Hilferty, close for hundreds.
        freedom = len(rates) - 1
        wilson = [sd / math.sqrt((1 - 2 / (9 * freedom) + z * math.sqrt(2 / (9 * freedom))) ** 3) for z in (1.96, -1.96)]
        spread = f"{sd:.3f} ({wilson[0]:.3f} to {wilson[1]:.3f})"
        print(f"{design:16}{mean_text(rates, 3):>24}{spread:>26}{mean_text(first, 1):>28}{np.median(first):>8.0f}")
        if not struck.any(axis=1).all():
            print(f"  {np.sum(~struck.any(axis=1))} without a hit, counted as {arguments.particles + 1}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
