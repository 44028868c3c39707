"""Claim: a block that is simulated step by step from Python shows, after every step, what the archive of the same campaign
holds, and ends with the same bits; arrays have the shapes and meanings that they are said to have; mistakes are told.

Usage: python_block.py PACKAGES GRAZE: the folder that holds the package with its compiled module; the program.
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from xml.etree import ElementTree

PACKAGES, PROGRAM = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(PACKAGES))
os.environ["GRAZE"] = PROGRAM

import graze  # noqa: E402
import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402

POLICY = "step/3cm"
SMALL = {"time.end": "0.3 s", "record.events": True, "task.stop_at_violation": True,
         "task.requirements.upright.tilt.below": "5 deg"}


class Law:
    """A PD law that fails when it is told to."""

    def __init__(self, robot, settings):
        self.q0, self.fails = robot.initial[:, None], settings.get("fails", 1e9)
        assert "<robot" in robot.urdf

    def act(self, observation, targets):
        if observation.time.max() > self.fails:
            raise ValueError("had enough")
        targets.torque = 20 * (self.q0 - observation.joint_position) + 0.1 * (0 - observation.joint_velocity)


class BlockTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="graze-block-"))
        cls.campaign = graze.run("quadruped_curb", 12, set=SMALL, telemetry="all", every=1, policies=POLICY,
                                 output=cls.folder / "curb.graze")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def block(self, particles=8, policy=POLICY, **more):
        return graze.simulate("quadruped_curb", particles, policy=policy, set=SMALL, **more)

    def test_every_step_is_that_of_the_archive(self):
        ids = [11, 2, 7, 5, 0]  # in lanes and company of their own
        frames = [self.campaign.telemetry(POLICY, one) for one in ids]
        block = self.block(ids)
        steps = 0
        for _ in block:
            steps += 1
            for lane, frame in enumerate(frames):
                if block.times[lane] == block.time:
                    for kind in ("q", "v", "tau"):
                        np.testing.assert_array_equal(getattr(block, kind)[:, lane], frame[kind].iloc[steps])
        self.assertEqual(steps, round(block.time / block.step_time))
        ended = self.campaign.traces(POLICY).loc[ids]
        self.assertGreater(ended.end_time.nunique(), 2)  # else lanes that stand still were not tried
        told = block.traces()
        for name in ("digest", "end_time", "objective_margin", "violated", "sequence", "invalid_reason"):
            self.assertEqual(told[name].tolist(), ended[name].tolist(), name)
        self.assertEqual(told.outcome.tolist(), ended.outcome.astype(str).tolist())
        self.assertEqual(list(block.names["q"]), list(frames[0]["q"].columns))
        for lane, particle in enumerate(ids):
            pd.testing.assert_frame_equal(block.events(lane), self.campaign.events(POLICY, particle), check_dtype=False)
            self.assertEqual(block.record(lane)["margins"], self.campaign.margins(POLICY).loc[particle].to_dict())
            np.testing.assert_array_equal(block.q[:, lane], self.campaign.final_states(POLICY)["q"].loc[particle])

    def test_shapes_and_meanings(self):
        block = self.block(3)
        self.assertEqual((block.time, block.active.tolist(), len(block.events(0))), (0, [True] * 3, 0))
        self.assertFalse(block.tau.any() or block.a.any())
        self.assertTrue(block.run_until(0.1))
        self.assertAlmostEqual(block.time, 0.1, 12)
        before = block.v
        self.assertTrue(block.step())
        moved = block.times == block.time
        self.assertEqual(moved.tolist(), [False, True, True])  # the first has ended before
        np.testing.assert_allclose(block.a[:, moved], ((block.v - before) / block.step_time)[:, moved], rtol=1e-9, atol=1e-9)
        for name in ("q", "v", "a", "tau", "requirements", "objective"):
            self.assertEqual(getattr(block, name).shape, (len(block.names[name]), 3))
            self.assertEqual(len(block.units[name]), len(block.names[name]))
        self.assertEqual(block.a.shape[0], block.v.shape[0])
        np.testing.assert_allclose(block.row("link_position", "BODY0"), block.q[4:7], atol=1e-12)  # its pose is the base's
        w, x, y, z = block.q[:4]
        np.testing.assert_allclose(block.row("link_rotation", "BODY0")[2], [2 * (x * z - w * y), 2 * (y * z + w * x),
                                                                            1 - 2 * (x * x + y * y)], atol=1e-12)
        tilt = np.arccos(block.row("link_rotation", "BODY0")[2, 2])
        np.testing.assert_allclose(block.row("requirements", "upright"), np.radians(5) - tilt, atol=1e-9)
        kept = block.q
        kept[:] = 0  # a copy
        self.assertTrue(block.q.any())

    def test_contacts_carry_the_robot(self):
        """While it stands still, what presses on it is its weight, by the masses in its file."""
        block = graze.simulate("drop_and_stand", 4, set={"time.end": "3 s"}, policy="hold")
        block.run_until(2.5)
        total, span = np.zeros((3, 4)), 0.0  # N s, s
        while block.time < 2.8:
            block.step()
            span += block.step_time
            contacts = block.contacts
            self.assertEqual(contacts.impulse.shape, (len(contacts), 3, 4))
            there = ~np.isnan(contacts.gap)
            self.assertTrue((there | ~contacts.touching).all())
            self.assertEqual(set(contacts.mode[~contacts.touching]) - {""}, set())
            np.testing.assert_allclose(np.linalg.norm(contacts.normal, axis=1)[there], 1, rtol=1e-9)
            sign = np.array([1.0 if b == "ground" else -1.0 for _, b in contacts.pair])
            self.assertTrue(all("ground" in pair for pair in contacts.pair), contacts.pair)
            total += np.nansum(contacts.impulse * sign[:, None, None], axis=0)
        force = total / span
        robot = graze.shipped.scenario_file("drop_and_stand").parent.parent / "robots/links.urdf"
        weight = 9.81 * sum(float(one.get("value")) for one in ElementTree.parse(robot).iter("mass"))
        np.testing.assert_allclose(force[2], weight, rtol=1e-6)
        np.testing.assert_allclose(force[:2], 0, atol=1e-6)

    def test_early_stop_is_judged(self):
        block = self.block(4)
        block.run_until(0.05)
        with self.assertRaisesRegex(graze.GrazeError, "lane 2: its trace goes on"):
            block.record(2)
        block.stop(2)
        self.assertEqual(block.active.tolist(), [True, True, False, True])
        self.assertEqual((block.record(2)["stopped"], block.record(2)["end_time"]), (True, 0.05))
        frozen = block.q[:, 2]
        block.run_until(0.06)
        np.testing.assert_array_equal(block.q[:, 2], frozen)
        block.run()
        whole = self.campaign.traces(POLICY).digest
        self.assertEqual([block.record(lane)["digest"] == whole[lane] for lane in range(4)], [True, True, False, True])
        self.assertFalse(block.step())
        masked = self.block(3)
        masked.stop(np.array([False, True, False]))
        self.assertEqual(masked.active.tolist(), [True, False, True])
        masked.stop([0, np.int64(2)])
        self.assertFalse(masked.active.any())
        with self.assertRaisesRegex(graze.GrazeError, "2 truth values for 3 lanes"):
            masked.stop([True, False])
        other = self.block(2)
        other.stop()
        self.assertEqual(other.traces().end_time.tolist(), [0, 0])

    def test_long_runs_can_be_interrupted(self):
        block = graze.simulate("drop_and_stand", 1, set={"time.end": "200 s"})
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            block.run()
        self.assertLess(block.time, 200)
        self.assertTrue(block.step())  # and goes on

    def test_controllers_in_python_have_the_same_bits(self):
        campaign = graze.run("drop_and_stand", 3, policy=Law, set={"time.end": "0.1 s"}, output=self.folder / "law.graze")
        block = graze.simulate("drop_and_stand", [2, 0], policy=Law, set={"time.end": "0.1 s"}).run()
        self.assertEqual(block.traces().digest.tolist(), campaign.traces("Law").digest[[2, 0]].tolist())
        failing = graze.simulate("drop_and_stand", 2, policy={"mine": {"python": {"class": Law, "settings": {"fails": 0.02}}}})
        with self.assertRaisesRegex(graze.GrazeError, r"had enough \(Law-.*py:\d+\)"):
            failing.run()
        with self.assertRaisesRegex(graze.GrazeError, "failed before.*had enough"):
            failing.step()
        fresh = graze.simulate("drop_and_stand", [0], policy=Law, set={"time.end": "0.1 s"}).run()  # is not harmed by it
        self.assertEqual(fresh.record(0)["digest"], campaign.traces("Law").digest[0])
        own = campaign.path.parent / "law.policies"
        named = {"mine": {"python": {"file": str(next(own.iterdir())), "class": "Law", "interpreter": sys.executable},
                          "control": {"torque": {}}}}
        with self.assertRaisesRegex(graze.GrazeError, "--trust"):
            graze.simulate("drop_and_stand", 1, policy=named)
        self.assertTrue(graze.simulate("drop_and_stand", 1, policy=named, trust=True).step())

    def test_a_copy_of_the_process_leaves_the_block_alone(self):
        """What it tries does not harm the controller of the process that it is a copy of, and is refused."""
        small = {"time.end": "0.05 s"}
        whole = graze.simulate("drop_and_stand", 1, policy=Law, set=small).run()
        block = graze.simulate("drop_and_stand", 1, policy=Law, set=small)
        block.step()
        end, told = os.pipe()
        if os.fork() == 0:
            try:
                block.step()
            except graze.GrazeError as error:
                os.write(told, str(error).encode())
            os._exit(0)
        os.wait()
        self.assertRegex(os.read(end, 1000).decode(), "this block belongs to process [0-9]+, of which this one is a copy")
        for one in (end, told):
            os.close(one)
        self.assertEqual(block.run().record(0)["digest"], whole.record(0)["digest"])

    def test_seed_and_design_are_those_of_the_campaign(self):
        design = {**SMALL, "sampling.design": "latin_hypercube", "time.end": "0.02 s"}
        campaign = graze.run("quadruped_curb", 5, seed=9, set=design, policies=POLICY, output=self.folder / "design.graze")
        block = graze.simulate("quadruped_curb", [4], n=5, seed=9, set=design, policy=POLICY).run()
        self.assertEqual((block.record(0)["digest"], block.seed), (campaign.traces(POLICY).digest[4], 9))
        with self.assertRaisesRegex(graze.GrazeError, "particle 7 is none of the 5"):
            graze.simulate("quadruped_curb", [7], n=5, set=design, policy=POLICY)

    def test_mistakes_are_told(self):
        for wrong, text in ((lambda: graze.simulate("quadruped_cub"), "did you mean the shipped scenario 'quadruped_curb'"),
                            (lambda: graze.simulate("quadruped_curb"), "there are 4: step/1cm, .*; name one"),
                            (lambda: self.block(policy="step/3c"), "nearest: step/3cm"),
                            (lambda: self.block(9), "9 are asked for; a block has 1 to 8"),
                            (lambda: self.block([3, 3]), "3 is named twice"), (lambda: self.block([-1]), "-1 is out of range"),
                            (lambda: self.block(1, n=-1), "n: -1 is out of range"),
                            (lambda: graze.simulate("pendulum", set={"time.ende": 1}), "did you mean 'end'"),
                            (lambda: self.block(1).row("q", "base.zz"), "q has no row 'base.zz'; did you mean 'base.z'"),
                            (lambda: self.block(1).row("p", "x"), "there is no array 'p'"),
                            (lambda: self.block(1).stop(1), "lane 1: there are 1"),
                            (lambda: self.block(1).stop([0.7]), "stop: a lane is a whole number, not 0.7"),
                            (lambda: self.block([1.9]), "particles: an id is a whole number, not 1.9"),
                            (lambda: self.block(10**8), "100000000 are asked for; a block has 1 to 8"),
                            (lambda: self.block(1).run_until(float("nan")), "run_until: nan is no time"),
                            (lambda: self.block(1).run_until("1 s"), "run_until: '1 s' is no time; a number of seconds"),
                            (lambda: self.block(1).events("3"), "events: a lane is a whole number, not '3'"),
                            (lambda: self.block(1).events(-1), "lane -1: there are 1")):
            with self.assertRaisesRegex(graze.GrazeError, text) as told:
                wrong()
            self.assertEqual(told.exception.code, 2)

    def test_includes_may_name_what_is_shipped(self):
        file = self.folder / "mine.yaml"
        file.write_text("include: pendulum\nsampling: {seed: 77}\n")
        block = graze.simulate(file, 1)
        self.assertEqual((block.seed, block.scenario), (77, "Pendulum"))

    def test_without_the_module_the_rest_works(self):
        bare = self.folder / "bare"
        shutil.copytree(PACKAGES / "graze", bare / "graze", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
        code = ("import graze\nprint(graze.open('curb.graze').particles)\ntry:\n    graze.simulate('pendulum')\n"
                "except graze.GrazeError as error:\n    print(error.code, error)")
        done = subprocess.run([sys.executable, "-c", code], cwd=self.folder, env={**os.environ, "PYTHONPATH": str(bare)},
                              capture_output=True, text=True)
        self.assertRegex(done.stdout, r"12\n3 graze.simulate needs the compiled module .*pybind11-dev", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
