"""Claim: a class or an object in Python is a policy: its source stands beside the campaign, which resumes and replays when
the original is gone, and its traces have the bits of the same law in the program. What cannot be written is refused.

Usage: python_policies.py SOURCE GRAZE.
"""
import importlib
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

SOURCE, PROGRAM = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(SOURCE / "jobs/python"))
os.environ["GRAZE"] = PROGRAM

import graze  # noqa: E402
import numpy as np  # noqa: E402

SETTINGS = {"kp": 20.0, "kd": 0.1}
NATIVE = {"hold": {}, "control": {"joint_pd": {**SETTINGS, "implicit": False}}}
GAINS = np.array([20.0, 0.1])
SHORT = {"time.end": "0.1 s"}


def spring(deflection):
    return gain_of(0) * deflection


def gain_of(number):
    return GAINS[number]


class Scripted:
    """Uses a function, which uses another, which uses an array of NumPy."""

    control = {"torque": {}}

    def __init__(self, robot, settings):
        self.q0 = robot.initial[:, np.newaxis]

    def act(self, observation, targets):
        torque = spring(self.q0 - observation.joint_position)
        targets.torque = torque + gain_of(1) * (0 - observation.joint_velocity)


class Given:
    """Made here, with what it takes; the robot is told later."""

    def __init__(self, **settings):
        self.settings = settings
        self.gains = np.array(list(settings.values()))

    def begin(self, robot):
        self.q0 = robot.initial[:, np.newaxis]

    def act(self, observation, targets):
        torque = self.gains[0] * (self.q0 - observation.joint_position)
        targets.torque = torque + self.settings["kd"] * (0 - observation.joint_velocity)


class Servo(Given):
    """Asks for a tracker."""

    control = {"joint_pd": {**SETTINGS, "implicit": False}}

    def act(self, observation, targets):
        """Targets stay as they are: the initial positions."""


class Tired(Given):
    """Fails in every robot."""

    def act(self, observation, targets):
        raise ValueError("is tired")


class PoliciesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="graze-policies-"))
        subprocess.run([PROGRAM, "new", "policy-python", str(cls.folder / "robot")], check=True, capture_output=True)
        cls.scenario = cls.folder / "robot/scenario.yaml"
        cls.modules = cls.folder / "modules"
        cls.modules.mkdir()
        law = (cls.folder / "robot/my_controller.py").read_text().split('"""', 2)[2]  # all but its docstring
        (cls.modules / "law.py").write_text(
            '"""A law that reads and imports what stands beside it."""\nfrom __future__ import annotations\n'
            "import pathlib\nimport sibling\nassert (pathlib.Path(__file__).parent / 'sibling.py').is_file()\n" + law)
        (cls.modules / "sibling.py").write_text("KP = 20.0\n")
        sys.path.append(str(cls.modules))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def run_policy(self, name, policy, **more):
        return graze.run(self.scenario, 3, policy=policy, set=SHORT, output=self.folder / f"{name}.graze", **more)

    def program(self, *words):
        return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)

    def test_all_kinds_have_the_bits_of_the_program(self):
        law = importlib.import_module("law")
        campaign = self.run_policy("kinds", {
            "native": NATIVE, "module": {"python": {"class": law.Controller, "settings": SETTINGS}}, "script": Scripted,
            "object": Given(**SETTINGS), "servo": {"python": Servo(), "over": {"python.timeout": ["5 s", "6 s"]}}})
        digests = {name: campaign.traces(name).digest.tolist() for name in campaign.policies}
        self.assertEqual(sorted(digests), ["module", "native", "object", "script", "servo/5s", "servo/6s"])
        for name, one in digests.items():
            self.assertEqual(one, digests["native"], name)
        # The original goes; the campaign has its own.
        (self.modules / "law.py").unlink()
        resumed = self.program("resume", campaign.path, "-n", 5, "--trust", "--quiet")
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        replayed = self.program("replay", campaign.path, "--particle", 4, "--policy", "module", "--trust")
        self.assertEqual(replayed.returncode, 0, replayed.stderr)
        files = sorted(one.name.split("-")[0] for one in (self.folder / "kinds.policies").iterdir())
        self.assertEqual(files, ["Controller", "Given", "Scripted", "Servo"])

    def test_objects_in_slots_keep_what_they_hold(self):
        campaign = self.run_policy("slots", InSlots(3.0))
        self.assertNotIn("invalid", set(campaign.traces("InSlots").outcome))

    def test_where_nothing_can_be_written_is_told(self):
        file = self.folder / "a_file"
        file.write_text("")
        with self.assertRaisesRegex(graze.GrazeError, "the policy's source cannot be written"):
            graze.run(self.scenario, 1, policy=InSlots(3.0), output=file / "x.graze")

    def test_what_fails_is_warned_of(self):
        with self.assertWarnsRegex(RuntimeWarning, r"policy Tired, particle \d+: .*is tired"):
            campaign = self.run_policy("tired", Tired(**SETTINGS))
        self.assertEqual(len(campaign.traces("Tired")), 3)

    def test_another_version_leaves_earlier_campaigns_alone(self):
        first = self.run_policy("first", Given(kp=20.0, kd=0.1))
        second = self.run_policy("first", Given(kp=5.0, kd=0.1), force=True)
        self.assertEqual(second.policies, ["Given"])
        self.assertEqual(len(list((self.folder / "first.policies").iterdir())), 2)
        with self.assertRaisesRegex(graze.GrazeError, "first.graze"):  # is there already
            self.run_policy("first", Given(kp=6.0, kd=0.1))
        self.assertEqual(self.program("resume", first.path, "-n", 4, "--trust", "--quiet").returncode, 0)
        next((first.path / "shards").iterdir()).unlink()
        with self.assertRaisesRegex(graze.CampaignError, "lacks .*'graze resume .*first.graze --trust' simulates"):
            graze.open(first.path)

    def test_what_fails_leaves_nothing_behind(self):
        with self.assertRaisesRegex(graze.GrazeError, r"ends wrongly \(Wrong-.*\.py:\d+\)"):
            self.run_policy("wrong", Wrong)
        with self.assertRaisesRegex(graze.GrazeError, "did you mean 'joint_pd'"):
            self.run_policy("wrong", {"mine": {"python": Given(), "control": {"joint_pb": {}}}})
        self.assertFalse((self.folder / "wrong.policies").exists())

    def test_code_of_others_is_not_trusted(self):
        other = self.folder / "other.py"
        other.write_text("class Controller:\n    def act(self, o, t): pass\n")
        named = {"named": {"python": {"file": str(other)}, "control": {"torque": {}}}}
        for policy in (named, {**named, "own": Scripted}):
            with self.assertRaisesRegex(graze.GrazeError, "--trust"):
                self.run_policy("untrusted", policy)
        with self.assertRaisesRegex(graze.GrazeError, "a class and a file"):
            self.run_policy("untrusted", {"mine": {"python": {"class": Scripted, "file": "x.py"}}})
        with self.assertRaisesRegex(graze.GrazeError, "python has neither a class nor a file; did you mean 'class' for 'clas'"):
            self.run_policy("untrusted", {"mine": {"python": {"clas": Scripted}}})

    def test_what_cannot_be_written_is_told(self):
        class Within:
            def act(self, observation, targets):
                """Stands within a function."""

        unseen = {}
        exec("class Unseen:\n    def act(self, o, t): pass", {"__name__": "__main__"}, unseen)
        for policy, text in ((Within, "Within is defined within something else"),
                             (unseen["Unseen"], "source of class Unseen cannot be had"),
                             (Given(lock=threading.Lock()), "attribute settings of Given is of type dict and cannot be written"),
                             (Given(own=Scripted), "holds an object of class Scripted"),
                             (UsesLock, "LOCK, which UsesLock.* uses, is of type lock and cannot"),
                             (17, "class int has no method act"), (graze, "class module has no method act"),
                             ({}, "is empty"), ({"good": Scripted, "bad": BadControl()}, "BadControl.control is 'torque'")):
            with self.assertRaisesRegex(graze.GrazeError, text) as told:
                self.run_policy("none", policy)
            self.assertEqual(told.exception.code, 2)
        self.assertFalse((self.folder / "none.policies").exists())


LOCK = threading.Lock()


class UsesLock:
    def act(self, observation, targets):
        with LOCK:
            pass


class BadControl(Given):
    control = "torque"

    def act(self, observation, targets):
        """Is not asked."""


class InSlots:
    """An object without a __dict__."""
    __slots__ = ("gain", "never_set")

    def __init__(self, gain):
        self.gain = gain

    def act(self, observation, targets):
        targets.torque = self.gain * (0 - observation.joint_position)


class TestRunner(unittest.TestCase):
    """What runs controllers, alone."""

    def runner(self):
        text = (SOURCE / "engine/library/python_runner.py").read_text()
        self.assertTrue(text.endswith("\nmain()\n"))
        runner = {"__name__": "runner"}
        exec(text[:-len("main()\n")], runner)
        return runner

    def test_arrays_that_are_taken_for_numbers_are_told_so(self):
        hint, time = self.runner()["number_hint"], np.zeros(8)
        for wrong, told in [(lambda: 1 if time > 0 else 2, "np.where"), (lambda: bool(time), "np.where"),
                            (lambda: math.sin(time), "np.sin"), (lambda: float(time), "np.sin")]:
            with self.assertRaises((TypeError, ValueError)) as raised:
                wrong()
            self.assertIn(told, hint(raised.exception))
        self.assertEqual(hint(ValueError("truth")), "")

    def test_errors_that_cannot_speak_are_told_by_their_type(self):
        class Mute(ValueError):
            def __str__(self):
                raise RuntimeError("mute")
        runner = self.runner()
        self.assertRegex(runner["explain"](Mute(), {"file": "mine.py", "lanes": 8}), "Mute")

    def test_arrays_that_do_not_fit_are_told_what_they_lack(self):
        runner = self.runner()
        for given, told in [(np.zeros(12), "[:, None]"), (np.zeros((8, 12)), ".T"), (np.zeros((5, 1)), r"shape \(5, 1\)"),
                            (np.zeros((12, 3)), r"here of shape \(12, 8\)"),
                            (np.zeros((6, 8)), r"here of shape \(12, 8\), and this one is of shape \(6, 8\)")]:
            with self.assertRaises(ValueError) as raised:
                np.zeros((12, 8))[:] = given
            self.assertRegex(runner["shape_hint"](raised.exception, 8), told)
        with self.assertRaises(ValueError) as raised:
            np.zeros((12, 8))[0] = [0.1, 0.2]
        self.assertIn("8 values, or one number", runner["shape_hint"](raised.exception, 8))
        with self.assertRaises(ValueError) as raised:
            np.zeros((12, 8)) + np.zeros(12)
        self.assertIn("[:, None]", runner["shape_hint"](raised.exception, 8))
        self.assertEqual(runner["shape_hint"](ValueError("broadcast"), 8), "")


class Wrong:
    def __init__(self, robot, settings):
        raise ValueError("ends wrongly")

    def act(self, observation, targets):
        """Never comes to this."""


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
