"""Claim: the package for Python reads what the program has written, the same from a directory of several shards and from a
packed file; particles count once; what is lost, cut short or misspelt is refused with its name.

Usage: python_package.py SOURCE GRAZE.
"""
import contextlib
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE, PROGRAM = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(SOURCE / "jobs/python"))
os.environ["GRAZE"] = PROGRAM

import matplotlib  # noqa: E402

matplotlib.use("Agg")

import graze  # noqa: E402
import graze.plots  # noqa: E402
import h5py  # noqa: E402
import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402

POLICY = "step/3cm"
SMALL = {"time.end": "0.1 s", "record.events": True}


def program(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=True).stdout


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="graze-python-"))
        cls.directory, cls.packed = cls.folder / "curb.graze", cls.folder / "curb.h5"
        cls.first = graze.run("quadruped_curb", 8, set=SMALL, telemetry="all", output=cls.directory,
                              policies=[POLICY, "step/4cm"], options=["--set", "task.requirements.upright.tilt.below=4 deg"])
        program("resume", str(cls.directory), "-n", "20", "--quiet")
        program("pack", str(cls.directory), "-o", str(cls.packed))
        cls.campaign = graze.open(cls.directory)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_answer_is_that_of_the_questions(self):
        for question, answer in (("ci < 0.9", "held"), ("ci < 0.001", "open")):
            asked = graze.run("pendulum", 16, until=question, output=self.folder / "asked.graze", force=True)
            self.assertEqual(asked.answer, answer, question)
        with self.assertRaisesRegex(TypeError, "set: a map of paths to values is meant"):
            graze.run("pendulum", 1, set=["time.end=1 s"], output=self.folder / "none.graze")

    def test_counts_are_those_of_score(self):
        self.assertEqual((self.first.answer, self.first.particles), (None, 8))
        score = json.loads(program("score", str(self.directory), "--json"))
        told = {one["policy"]: one for one in score["policies"]}
        counts = self.campaign.counts()
        self.assertEqual(list(counts.index), [POLICY, "step/4cm"])
        for policy, row in counts.iterrows():
            for outcome in ("success", "known_failure", "unknown_failure", "invalid", "n"):
                self.assertEqual(row[outcome], told[policy][outcome], (policy, outcome))
        self.assertEqual((self.campaign.requirements, self.campaign.measures), (score["requirements"], score["measures"]))
        self.assertGreater(counts.loc[POLICY, "known_failure"], 0)  # else the next tests say little
        self.assertTrue(self.campaign.complete)

    def test_directory_and_packed_file_are_the_same(self):
        self.assertGreater(len(list((self.directory / "shards").iterdir())), 1)
        packed = graze.open(self.packed)
        for name in ("traces", "margins", "first_violations", "final_states"):
            pd.testing.assert_frame_equal(getattr(self.campaign, name)(POLICY), getattr(packed, name)(POLICY))
        pd.testing.assert_frame_equal(self.campaign.values(), packed.values())
        for name in ("events", "phases", "telemetry"):
            for particle in (3, 17):  # of either shard
                table = getattr(self.campaign, name)(POLICY, particle)
                self.assertGreater(len(table), 0, name)
                pd.testing.assert_frame_equal(table, getattr(packed, name)(POLICY, particle))
        self.assertEqual(self.campaign.inputs, packed.inputs)

    def test_what_a_scenario_cannot_hold_is_refused_with_its_place(self):
        for value, told in [(float("nan"), "nan is no number of a scenario"), (float("inf"), "inf is no number"), (1j, "1j is no value"),
                            ({1, 2}, "is no value that a scenario can hold"), (b"x", "b'x' is no value")]:
            with self.assertRaisesRegex(graze.GrazeError, told) as raised:
                graze.run("quadruped_curb", 1, set={"policies": {"mine": {"settings": {"a": [0, value]}}}})
            self.assertRegex(str(raised.exception), r"^policies\.mine\.settings\.a\[1\]: ")

    def test_what_holds_itself_is_refused(self):
        endless = {}
        endless["self"] = endless
        with self.assertRaisesRegex(graze.GrazeError, "time: holds itself"):
            graze.run("quadruped_curb", 1, set={"time": endless})

    def test_tables_agree_with_each_other(self):
        traces, margins = self.campaign.traces(POLICY), self.campaign.margins(POLICY)
        self.assertEqual(list(traces.index), list(range(20)))
        self.assertTrue(((traces.violated == "upright") <= (margins.upright < 0)).all())
        self.assertTrue(((traces.outcome == "known_failure") == traces.violated.notna()).all())
        for particle in traces.index:
            last = self.campaign.telemetry(POLICY, particle)
            self.assertAlmostEqual(last.index[-1], traces.end_time[particle], 12)
            for kind in ("q", "v"):
                np.testing.assert_array_equal(last[kind].iloc[-1], self.campaign.final_states(POLICY)[kind].loc[particle])
        events = self.campaign.events(POLICY, 3)
        self.assertIn("contact_begin", set(events.kind))
        self.assertIn("ground", set(events.b) | set(events.a))
        self.assertTrue(events.time.is_monotonic_increasing)

    def test_values_are_those_of_the_sample(self):
        drawn = self.folder / "sample.csv"
        program("sample", "quadruped_curb", "-n", "20", "--set", "time.end=0.1 s", "-o", str(drawn))
        sample = pd.read_csv(drawn, comment="#", index_col=0, float_precision="round_trip")
        values = self.campaign.values()
        self.assertEqual(list(values.columns), list(self.campaign.parameters.index))
        for name in values.columns:
            if name in sample and pd.api.types.is_numeric_dtype(sample[name]):
                np.testing.assert_array_equal(values[name], sample[name], name)
        self.assertGreater(len(set(values.columns) & set(sample.columns)), 100)

    def test_intervals_of_plots_are_those_of_score(self):
        for policy in json.loads(program("score", str(self.directory), "--json"))["policies"]:
            told = graze.plots.clopper_pearson(policy["success"], policy["n"])
            np.testing.assert_allclose(told, policy["interval"], atol=1e-9)
        self.assertEqual(graze.plots.clopper_pearson(0, 0), (0, 1))
        np.testing.assert_allclose(graze.plots.clopper_pearson(9, 10), [0.5549839, 0.9974714], atol=1e-7)

    def test_survival_is_the_product_limit(self):
        at, share = graze.plots._kaplan_meier(np.array([1, 2, 2, 3, 4]), np.array([True, True, False, False, True]))
        np.testing.assert_allclose(at, [0, 1, 2, 4, 4])
        np.testing.assert_allclose(share, [1, 0.8, 0.6, 0, 0])

    def test_plots_show_the_tables(self):
        ax = graze.plots.rates(self.campaign)
        self.assertEqual([label.get_text() for label in ax.get_yticklabels()], [f"{POLICY}  (20)", "step/4cm  (20)"])
        self.assertEqual(len(graze.plots.survival(self.campaign, POLICY).lines), 1)
        ax = graze.plots.scatter(self.campaign, POLICY, "contact.friction", "upright")
        self.assertEqual(ax.get_ylabel(), f"margin of upright, {self.campaign.margin_units['upright']}")
        self.assertIn(self.campaign.margin_units["upright"], ("rad", "deg"))
        drawn = sum(len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "None")
        self.assertEqual(drawn, 20)
        ax = graze.plots.telemetry(self.campaign, POLICY, 3, ["base.z", "base.x"])
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), self.campaign.telemetry(POLICY, 3)["q"]["base.z"])
        ax.figure.savefig(self.folder / "telemetry.png")
        for wrong, text in ((lambda: graze.plots.rates(self.campaign, "step/3m"), "did you mean 'step/3cm'"),
                            (lambda: graze.plots.scatter(self.campaign, POLICY, "contact.frictoin"), "contact.friction"),
                            (lambda: graze.plots.telemetry(self.campaign, POLICY, 3, "base.zz"), "did you mean 'base.z'"),
                            (lambda: graze.plots.telemetry(self.campaign, POLICY, 3, "base.z", kind="x"), "must be 'q'")):
            with self.assertRaisesRegex(graze.CampaignError, text):
                wrong()

    def test_what_is_lost_or_cut_short_is_refused(self):
        copy = self.folder / "copy.graze"
        shutil.copytree(self.directory, copy)
        shards = sorted((copy / "shards").iterdir())
        shards[0].rename(copy / "shards" / "000009.h5")  # another name, nothing lost
        self.assertEqual(len(graze.open(copy).traces(POLICY)), 20)
        shutil.copy(copy / "shards" / "000009.h5", copy / "shards" / "000010.h5")  # twice, and counts once
        pd.testing.assert_frame_equal(graze.open(copy).traces(POLICY), self.campaign.traces(POLICY))
        (copy / "campaign.h5").write_bytes((copy / "campaign.h5").read_bytes()[:-9])  # there is a copy
        self.assertEqual(graze.open(copy).particles, 20)
        shards[1].write_bytes(shards[1].read_bytes()[:-100])
        with self.assertRaisesRegex(graze.CampaignError, f"{shards[1].name}: was cut short"):
            graze.open(copy)
        shards[1].unlink()
        with self.assertRaisesRegex(graze.CampaignError, f"lacks {shards[1].name} .*graze resume"):
            graze.open(copy)

    def test_progress_is_shown_where_python_writes(self):
        shown = io.StringIO()
        with contextlib.redirect_stderr(shown):  # as a notebook does it
            campaign = graze.run("pendulum", 3, output=self.folder / "shown.graze", quiet=False)
        self.assertIn("3/3 traces", shown.getvalue())
        self.assertEqual(shown.getvalue().strip(), campaign.messages)
        with contextlib.redirect_stderr(shown):
            self.assertEqual(graze.run("pendulum", 3, output=self.folder / "quiet.graze").messages, "")
        self.assertEqual(shown.getvalue().strip(), campaign.messages)

    def foreign(self):
        """An HDF5 file of somebody else's, whose format version is a text."""
        with h5py.File(self.folder / "foreign.h5", "w") as file:
            file.attrs["format_version"] = "1.0"
        return self.folder / "foreign.h5"

    def test_mistakes_are_told(self):
        for wrong, text in ((lambda: graze.open(self.folder / "curb.grase"), "no such campaign; did you mean 'curb.graze'"),
                            (lambda: self.campaign.traces("step/3c"), "did you mean 'step/3cm'"),
                            (lambda: self.campaign.telemetry(POLICY, 20), "no trace of particle 20"),
                            (lambda: self.campaign.telemetry(POLICY, 2.7), "a particle is a whole number, not 2.7"),
                            (lambda: self.campaign.events(POLICY, "3"), "a particle is a whole number, not '3'"),
                            (lambda: graze.open(self.foreign()), "foreign.h5: is no "),
                            (lambda: graze.open(PROGRAM), "no HDF5 file")):
            with self.assertRaisesRegex(graze.CampaignError, text):
                wrong()
        with self.assertRaises(graze.GrazeError) as refused:
            graze.run("quadruped_cub", output=self.folder / "no.graze")
        self.assertEqual(refused.exception.code, 2)
        self.assertIn("quadruped_curb", str(refused.exception))
        with self.assertRaisesRegex(graze.GrazeError, "run: n is a whole number, not 'eight'"):
            graze.run("quadruped_curb", n="eight", output=self.folder / "no.graze")
        with self.assertRaisesRegex(graze.GrazeError, "a class is meant.*policies='step'"):
            graze.run("quadruped_curb", policy="step", output=self.folder / "no.graze")
        with self.assertRaisesRegex(FileNotFoundError, "no such program"):
            graze.run("quadruped_curb", program="grase")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
