"""A controller for tests: does what its settings say. `does`: what, from 10 ms on; "strata": by the height that the
base begins at, between 0.15 and 0.25 m."""
import ctypes
import os
import subprocess
import sys
import time

import numpy as np

STRATA = ["nothing", "raise", "exit", "fork", "segfault", "loop", "nan", "nothing"]


class Odd:
    reads = ("joint_position", "base_position")

    def __init__(self, robot, settings):
        self.does = settings["does"]
        if self.does == "refuse":
            raise ValueError("refused, as it was told")
        assert robot.joint_names == ["hinge"] and robot.lanes == 8 and "<robot" in robot.urdf, vars(robot)
        assert robot.upper[0] == np.inf and not robot.slides[0] and robot.period == 0.001, vars(robot)
        self.start_height = np.full(robot.lanes, np.nan)
        self.dice = [None] * robot.lanes
        self.steps = self.copies = 0

    def reset(self, lanes, seeds):
        assert lanes.dtype == np.int64 and seeds.dtype == np.uint64 and len(lanes) == len(seeds) > 0
        self.start_height[lanes] = np.nan
        for lane, seed in zip(lanes, seeds):
            self.dice[lane] = np.random.default_rng(seed)

    def act(self, observation, targets):
        active = observation.active
        if self.does == "look":
            observation.base_rpy
        if self.does == "replace_seen":
            observation.joint_position = observation.joint_position - 1
        if self.does == "shape":
            targets.position[:] = np.zeros(3)
        if self.does == "complex":
            targets.position = observation.joint_position + 1j
        if self.does == "complex_in_place":
            targets.position[:] = observation.joint_position + 1j
        if self.does == "text":
            targets.position = "0.1"
        if self.does == "none":
            targets.position = None
        height = observation.base_position[2]
        begins = active & np.isnan(self.start_height)
        self.start_height[begins] = height[begins]
        torque = 0.5 * (0.3 - observation.joint_position[0])
        if self.does == "dice":
            for lane in np.flatnonzero(active):
                torque[lane] += 0.01 * self.dice[lane].standard_normal()
        if self.does == "remember":
            torque += 1e-9 * self.steps
        self.steps += 1
        targets.torque[0] = 0 if self.does == "limp" else torque
        for lane in np.flatnonzero(active & (observation.time > 0.0095)):
            stratum = int((self.start_height[lane] - 0.15) / 0.0125)
            self.err(STRATA[stratum] if self.does == "strata" else self.does, lane, targets)

        return torque if self.does == "return" else None

    def err(self, does, lane, targets):
        if does == "raise":
            print("my gripper is on fire")
            raise RuntimeError("no fingers left")
        if does == "library":
            np.linalg.inv(np.zeros((2, 2)))
        if does == "exit":
            sys.exit(3)
        if does == "fork":
            if os.fork() == 0:
                time.sleep(1000)
            os._exit(5)
        if does == "copy" and self.copies < 20:
            self.copies += 1
            if os.fork() == 0:
                time.sleep(0.001)  # returns from act() as well, a little later
        if does == "child":
            ended = subprocess.run(["/bin/sh", "-c", "exit 7"]).returncode
            if ended != 7:
                raise RuntimeError(f"a child of mine ended with {ended}")
        if does == "terminate":  # what it starts can be ended as anywhere
            helper = subprocess.Popen(["sleep", "100"])
            helper.terminate()
            if helper.wait(5) != -15:
                raise RuntimeError("a helper of mine did not end by SIGTERM")
        if does == "answer":
            os.write(3, b"k")
        if does == "umlaut":
            raise ValueError("Gelenk über Grenze")
        if does == "killed":
            os.kill(os.getpid(), 9)
        if does == "rounding":
            ctypes.CDLL("libm.so.6").fesetround(0x800 if os.uname().machine == "x86_64" else 0x400000)
        if does == "segfault":
            ctypes.string_at(0)
        while does == "loop":
            pass
        if does == "lane" and lane == 2:
            raise RuntimeError("this lane is not liked")
        if does == "nan" or (does == "lane_nan" and lane == 2):
            targets.velocity[0, lane] = np.nan


class Idle:
    pass


class Misreads(Odd):
    reads = ["joint_positions"]


class Forgetful(Odd):
    def act(self, observation):
        pass


class Unmade:
    def act(self, observation, targets):
        """Is made of nothing."""


class Lonely(Odd):
    def __init__(self, robot):
        """Has no settings."""


class Seedless(Odd):
    def reset(self, lanes):
        """Has no seeds."""
