#!/usr/bin/python3
"""The height map of Figure 58 as the published heightmap.m makes such: 1000 hills on 3 m by 3 m, each the density of a normal
distribution with a covariance of diag(0.005 ± 0.00125) m² about a random place, summed, the highest point 3 cm high.

usage: hills.py > data/terrain/hills.csv     heights in mm every 2 cm; row along y, column along x

The published map itself is not known, so that this is another one of its kind.
"""

import sys

import numpy as np

SIDE, CELL, HILLS, HIGHEST, SEED = 3.0, 0.02, 1000, 30.0, 1  # m, m, -, mm, -
COVARIANCE, VARIABILITY = 0.005, 0.0025  # m²; the width of the range


def main():
    """Prints the map."""
    random = np.random.Generator(np.random.PCG64(SEED))
    along = np.arange(0, SIDE + CELL / 2, CELL) - SIDE / 2
    heights = np.zeros((len(along), len(along)))
    for _ in range(HILLS):
        x, y = random.uniform(-SIDE / 2, SIDE / 2, 2)
        xx, yy = COVARIANCE + VARIABILITY * (random.uniform(0, 1, 2) - 0.5)
        hill = np.outer(np.exp(-((along - y) ** 2) / (2 * yy)), np.exp(-((along - x) ** 2) / (2 * xx)))
        heights += hill / np.sqrt(xx * yy)
    heights *= HIGHEST / np.max(heights)
    np.savetxt(sys.stdout, heights, fmt="%.2f", delimiter=",")


if __name__ == "__main__":
    main()
