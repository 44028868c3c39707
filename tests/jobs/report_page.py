#!/usr/bin/env python3
"""Claim: the pages of `graze report` and `graze view` work in a browser, from a file, without a network: no error, every
section and plot is there, tables have the numbers of `graze score --json` and `graze explain --json`, the replay moves and is drawn, names that hold
markup stay text, sections that are data alone are shown, and a page of 10,000 traces is small.

usage: report_page.py SOURCE GRAZE
Exit code 77 (skipped): there is no Chromium (CHROMIUM names another one)."""

import html
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

NASTY = "</script><script>graze.hacked=1</script><img src=x onerror=graze.hacked=1> \"'&amp; \\u2028"
SWITCHES = ["--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--disable-dev-shm-usage", "--host-resolver-rules=MAP * ~NOTFOUND", "--force-prefers-color-scheme=light"]
PAGE_LIMIT = 15e6  # bytes

SECTIONS = [
    {"id": "made", "title": "Made of data", "text": NASTY, "widgets": [
        {"type": "table", "title": "t", "columns": ["Event", {"name": "Time", "unit": "s"}], "rows": [[NASTY, 0.25], ["b", None]]},
        {"type": "bars", "title": "Share", "bars": [{"label": "curb", "value": 0.4, "low": 0.3, "high": 0.5}]},
        {"type": "lines", "x": {"title": "Time", "unit": "s"}, "y": {"title": "Alive"},
         "lines": [{"name": "a", "x": [0, 1], "y": [1, 0.5], "low": [1, 0.4], "high": [1, 0.6]}]},
        {"type": "scatter", "x": {"title": "Mass", "unit": "kg"}, "y": {"title": "Margin", "unit": "rad"},
         "groups": [{"name": "success", "color": "success", "x": [1, 2], "y": [0.2, None]}]},
        {"type": "row", "widgets": [
            {"type": "lines", "steps": True, "x": {"title": "Time", "unit": "s"}, "y": {"title": "Alive"},
             "lines": [{"name": "a", "x": [0, 1, 2], "y": [1, 0.5, 0.5], "low": [1, 0.4, 0.4], "high": [1, 0.6, 0.6]}]},
            {"type": "bars", "title": "Effect", "label": "Rank correlation", "domain": [-1, 1],
             "bars": [{"label": "mass", "value": -0.4, "color": "policy-1"}]}]},
        {"type": "tree", "legend": [{"name": "Falls", "color": "known"}], "root": [
            {"label": NASTY, "n": 10, "said": "40 %", "parts": [{"name": "falls", "value": 4, "color": "known"}],
             "closed": True, "children": [{"label": "mass > 1 kg", "n": 6, "said": "0.1 m", "children": []}]}]},
        {"type": "tree", "root": {"label": "start", "n": 10, "outcomes": {"S": 6, "K": 4}, "time": 0,
                                  "children": [{"label": "touch", "n": 4, "outcomes": {"K": 4}, "time": 0.1}]}}]}]

# Runs in the page: what there is, and what becomes of it when it is used.
PROBE = """
(async () => {
  // Pictures of the browser are not waited for: how soon they come depends on the machine.
  const told = {}, wait = () => { graze.stage.dirty = true; graze.stage.tick(0); };
  try {
    for (let i = 0; i < 600 && !graze.ready; ++i) await new Promise((go) => setTimeout(go, 20));
    told.sections = graze.sections;
    told.hacked = graze.hacked ?? null;
    told.images = document.images.length;
    told.title = document.querySelector('h1').textContent;
    const inside = (id, what) => document.querySelectorAll(`#${id} ${what}`).length;
    told.plots = Object.fromEntries(graze.sections.map((id) => [id, inside(id, 'svg.plot')]));
    told.marks = Object.fromEntries(graze.sections.map((id) => [id, inside(id, 'svg.plot g path') + inside(id, 'svg.plot g rect')]));
    told.rows = Object.fromEntries(graze.sections.map((id) => [id, inside(id, 'tbody tr')]));
    told.bad = [...document.querySelectorAll('svg [d], svg [x], svg [y]')].filter((one) => /NaN|undefined|Infinity/.test(['d', 'x', 'y'].map((a) => one.getAttribute(a)).join())).length;
    told.verdict = [...document.querySelectorAll('#verdict table')].map((t) => [...t.querySelectorAll('tbody tr')].map((r) => [...r.cells].map((c) => c.textContent)));
    const cells = (id) => [...document.querySelectorAll(`#${id} table`)].map((t) => [...t.querySelectorAll('tbody tr')].map((r) => [...r.cells].map((c) => c.textContent)));
    told.tables = Object.fromEntries(['section-survival', 'section-causes'].map((id) => [id, cells(id)]));
    told.stairs = [...document.querySelectorAll('#section-made .row path.line')].map((one) => one.getAttribute('d').replace(/[^ML]/g, ''));
    told.said = [...document.querySelectorAll('#section-made .tree .when')].map((one) => one.textContent);
    told.folded = [...document.querySelectorAll('#section-made details')].map((one) => one.open);
    told.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
    for (const box of document.querySelectorAll('select')) {  // every choice of every plot is drawn without error
      for (const option of [...box.options].slice(0, 40)) {
        box.value = option.value;
        box.dispatchEvent(new Event('change'));
      }
    }
    if (graze.stage) {
      const stage = graze.stage;
      const look = async (t) => { stage.seek(t); wait(); return {...graze.state, contacts: stage.arrows.group.children.length}; };
      told.stage = [await look(0), await look(stage.end / 2), await look(stage.end)];
      stage.setFocus(stage.players.length - 1);
      told.focus = {...graze.state, text: document.querySelector('.said').textContent};
      stage.seek(0);
      stage.speed = 1;
      stage.play(true);
      for (let i = 0; i < 5; ++i) { stage.tick(1000 + 50 * i); }
      told.played = graze.state.time;
      stage.play(false);
      stage.seek(0);
      stage.dirty = true;
      stage.tick(2000);
      const gl = stage.renderer.getContext(), w = gl.drawingBufferWidth, h = gl.drawingBufferHeight;
      const pixels = new Uint8Array(4 * w * h);
      gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      const all = new Uint32Array(pixels.buffer);
      told.colors = new Set(all).size;
      if (stage.wide) {  // two robots: colours of each half, and the share of pixels in which they are alike
        const down = stage.stacked ? h >> 1 : 0, right = stage.stacked ? 0 : w >> 1, found = [new Set(), new Set()];
        let same = 0, count = 0;
        for (let y = 0; y < h - down; ++y) {
          for (let x = 0; x < w - right; ++x) {
            const [a, b] = [all[y * w + x], all[(y + down) * w + x + right]];
            if (!(stage.stacked ? y < h >> 1 : x < w >> 1)) continue;
            found[0].add(a); found[1].add(b);
            same += a === b; count += 1;
          }
        }
        told.halves = {colors: found.map((one) => one.size), same: same / count};
      }
      for (const name of ['dark', 'light']) { document.querySelector('.theme').click(); wait(); }
    }
  } catch (error) {
    told.failed = String(error.stack ?? error);
  }
  told.errors = graze.errors;
  const out = document.createElement('pre');
  out.id = 'told';
  out.textContent = JSON.stringify(told);
  document.body.append(out);
})();
"""


def chromium():
    names = [os.environ.get("CHROMIUM"), "chromium", "chromium-browser", "google-chrome"]
    return next((found for found in (shutil.which(name) for name in names if name) if found), None)


class Test:
    def __init__(self, source, graze, folder):
        self.source, self.program, self.folder, self.wrong = source, graze, pathlib.Path(folder), []

    def check(self, holds, claim):
        if not holds:
            self.wrong.append(claim)

    def graze(self, *arguments, codes=(0,)):
        run = subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True)
        self.check(run.returncode in codes, f"graze {arguments}: exit code {run.returncode}: {run.stderr}")
        return run.stdout

    def open(self, page, width=1280, sections=None):
        """What the probe tells of a page."""
        if not page.exists():
            return {}  # graze() has told why
        text = page.read_text()
        if sections is not None:
            packed = json.dumps(sections).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
            self.check(text.count('"sections":[') == 1, f"{page.name}: has a place for sections")
            text = text.replace('"sections":[', '"sections":' + packed[:-1] + ",", 1)
        probe = page.with_suffix(".probe.html")
        probe.write_text(text.replace("</body>", f"<script>{PROBE}</script></body>"))
        # More of the browser's own time than the probe waits for the page (12 s); each second of it draws sixty pictures.
        run = subprocess.run([chromium(), *SWITCHES, f"--user-data-dir={self.folder}/browser", f"--window-size={width},1000",
                              "--virtual-time-budget=15000", "--dump-dom", probe.as_uri()], capture_output=True, text=True,
                             timeout=600)
        found = re.search(r'<pre id="told">(.*?)</pre>', run.stdout, re.DOTALL)
        if not found:
            self.check(False, f"{page.name}: the probe told nothing: {run.stderr[-2000:]}")
            return {}
        told = json.loads(html.unescape(found.group(1)))
        self.check("failed" not in told, f"{page.name}: {told.get('failed')}")
        self.check(told["errors"] == [], f"{page.name}: errors: {told['errors']}")
        self.check(told["hacked"] is None and told["images"] == 0, f"{page.name}: markup of a name is text")
        self.check(told["bad"] == 0, f"{page.name}: {told['bad']} elements at no place")
        self.check(told["wide"] <= 0, f"{page.name}: {told['wide']} px too wide at {width}")
        return told

    def report(self):
        scenario = self.folder / "nasty.yaml"
        scenario.write_text(f"include: {self.source}/data/scenarios/quadruped_curb.yaml\nname: {json.dumps(NASTY)}\n"
                            "time: {end: 0.4 s}\ntask:\n  objective: !replace {position: {link: BODY0, x: {above: 0.02}}}\n"
                            "  requirements: {level: {tilt: {link: BODY0, below: 17 deg}}}  # half of the traces keep it\n")
        self.graze("run", scenario, "-n", 24, "-o", "curb.graze", "--quiet", "--ignore-space")
        score = json.loads(self.graze("score", "curb.graze", "--json"))
        data = json.loads(self.graze("report", "curb.graze", "--json"))
        self.check(data["score"] == score, "the report's numbers are those of the score")
        self.graze("report", "curb.graze", "-o", "curb.html")
        told = self.open(self.folder / "curb.html", sections=SECTIONS)
        if not told:
            return
        self.check(told["title"] == json.loads(json.dumps(score["campaign"])), f"the name is shown as it is: {told['title']}")
        for section in ("rates", "trajectories", "phases", "margins", "parameters", "section-survival", "section-made"):
            self.check(told["plots"].get(section, 0) > 0 and told["marks"][section] > 0, f"{section}: has a plot")
        self.check("replay" in told["sections"], "there is a replay")
        self.explained(told, json.loads(self.graze("explain", "curb.graze", "--json")))
        self.check(told["stairs"] == ["MLLLL"], f"steps are drawn as stairs: {told['stairs']}")
        self.check(told["said"] == ["40 %", "0.1 m", "0 s", "0.1 s"], f"a tree says what it is told: {told['said']}")
        self.check(told["folded"] == [False, True], f"a tree is folded: {told['folded']}")
        self.check("section-events" in told["sections"], "there are events")
        self.check(told["rows"]["failures"] == len(data["ways"]) + len(score["policies"]) * len(score["measures"]), f"failures are listed: {told['rows']['failures']}")
        for row, policy in zip(told["verdict"][0], score["policies"]):
            self.check(row[:6] == [str(policy[k]) for k in ("policy", "n", "success", "known_failure", "unknown_failure",
                                                           "invalid")], f"verdict: {row} of {policy}")
            self.check(row[6] == f"{policy['rate']:.4f}" and row[7] == "{:.4f} … {:.4f}".format(*policy["interval"]),
                       f"verdict: {row[6:8]} of {policy['rate']}, {policy['interval']}")
        self.moves(told)
        self.open(self.folder / "curb.html", width=800)
        self.graze("report", "curb.graze", "--replays", 0, "--trajectories", 0, "-o", "tables.html")
        told = self.open(self.folder / "tables.html")
        self.check(told and "replay" not in told["sections"] and "margins" in told["sections"], "tables stand without replays")

    def unsolved(self):
        """A snake of many boxes that lies on its belly, where sweeps alone creep: flagged traces."""
        links = [f"<link name='l{i}'><inertial><mass value='0.2'/><origin xyz='0.05 0 0'/><inertia ixx='1e-4' iyy='3e-4' "
                 "izz='3e-4' ixy='0' ixz='0' iyz='0'/></inertial><collision><origin xyz='0.05 0 0'/><geometry><box "
                 "size='0.08 0.04 0.04'/></geometry></collision></link>" for i in range(30)]
        joints = [f"<joint name='j{i}' type='continuous'><parent link='l{i - 1}'/><child link='l{i}'/><origin xyz='0.1 0 0'/>"
                  f"<axis xyz='0 {i % 2} {1 - i % 2}'/></joint>" for i in range(1, 30)]
        (self.folder / "snake.urdf").write_text("<robot name='snake'>" + "".join(links + joints) + "</robot>")
        (self.folder / "snake.yaml").write_text(
            "graze: 1\nrobot: {urdf: snake.urdf, initial: {height: on_ground, clearance: 1 cm}}\n"
            "environment: {ground: {plane: z}}\ncontact: {solver: sweeps}\ntime: {end: 0.3 s}\n"
            "uncertain: {'initial.base.{roll,pitch}': {normal: {std: 2 deg}}}\n"
            "policies: {limp: {hold: {}, control: {joint_pd: {kp: 0}}}}\n"
            "task: {objective: {rests: {speed: {link: '*', below: 50 cm/s}}}}\n")
        self.graze("run", self.folder / "snake.yaml", "-n", 6, "-o", "snake.graze", "--quiet", "--ignore-space")
        contacts = json.loads(self.graze("score", "snake.graze", "--json"))["policies"][0]["convergence"]
        self.graze("report", "snake.graze", "--replays", 0, "--trajectories", 0, "-o", "snake.html")
        told = self.open(self.folder / "snake.html")
        if not told:
            return
        row, flagged = told["verdict"][1][0], contacts["flagged"]
        self.check(flagged["all"] > 0 and row[0] == "limp" and re.sub(r"\s", "", row[1]) == str(contacts["steps"]) and
                   row[2] == str(contacts["unconverged_steps"]) and
                   row[4] == f"{contacts['unconverged_traces']} of {contacts['traces']}", f"contacts: {row} of {contacts}")
        kinds = [flagged[k] for k in ("success", "known_failure", "unknown_failure", "invalid", "first_particle")]
        self.check(row[-5:] == [str(one) for one in kinds], f"flagged traces: {row} of {flagged}")

    def explained(self, told, explanation):
        """Survival and causes have the numbers and words of `graze explain --json`; of so few traces all are asked."""
        left, differ = told["tables"]["section-survival"]
        rows = [(policy["policy"], one) for policy in explanation["policies"] for k, one in enumerate(policy["survival"][:-1])
                if k == 0 or one["failed"] > 0]
        self.check(len(left) >= min(len(rows), 12) and any(one["failed"] for _, one in rows), f"survival has rows: {left}")
        for row, (policy, one) in zip(left, rows):
            share = one["steps"][-1]["share"] if one["steps"] else 1
            self.check(row[:5] == [policy, one["what"], str(one["traces"]), str(one["failed"]), f"{share:.3f}"],
                       f"survival: {row} of {policy}, {one}")
        for row, pair in zip(differ, explanation["pairs"]):
            p = pair["paired_log_rank_p_holm"]
            self.check(row[:2] == [pair["a"], pair["b"]] and row[3] == ("–" if p is None else f"{p:.2g}"), f"pairs: {row} of {pair}")
        tables = told["tables"]["section-causes"]
        asked = [(policy["policy"], one) for policy in explanation["policies"] for one in policy["causes"]]
        self.check(len(asked) > 4 and len(tables) >= 2, f"there are causes: {len(asked)}, {len(tables)}")
        for row, (policy, one) in zip(tables[0], asked):
            self.check([row[0], row[1], row[3]] == [policy, one["target"], one["verdict"]], f"causes: {row} of {one['verdict']}")
        for row, policy in zip(tables[-1], explanation["policies"]):
            self.check(row[2] == policy["final_states"]["verdict"], f"final states: {row}")

    def moves(self, told):
        begin, middle, end = told["stage"]
        self.check(begin["position"] != middle["position"] != end["position"], f"the replay moves: {told['stage']}")
        self.check(begin["time"] == 0 < middle["time"] < end["time"], "time goes on")
        self.check(middle["contacts"] > 0, "contacts are shown")
        self.check(middle["drawn"] > begin["drawn"], "pictures are drawn")
        self.check(told["focus"]["focus"] == begin["players"] - 1 and told["focus"]["text"], "another trace comes into focus")
        self.check(0.19 < told["played"] < 0.21, f"it plays: {told['played']}")
        self.check(told["colors"] > 20, f"the stage is no empty picture: {told['colors']} colours")

    def view(self):
        self.graze("view", "curb.graze", "--particle", 3, "--particle", 4, "--policy", "step/{3,4}cm", "-o", "view.html")
        told = self.open(self.folder / "view.html")
        if told:
            self.check(told["stage"][0]["players"] == 4, "view: four traces")
            self.check(told["sections"][0] == "replay", f"view: {told['sections']}")
            self.moves(told)

    def redesign(self):
        """A session of graze improve: both robots are drawn side by side, or one above the other, and differ."""
        (self.folder / "swing.yaml").write_text(
            f"include: {self.source}/data/scenarios/pendulum.yaml\nname: {json.dumps(NASTY)}\ntime: {{end: 0.2 s}}\n"
            "task: !replace {requirements: {slow: {joint_speed: {joints: hinge, below: 2.6 rad/s}}}}\n"
            "design:\n  variables: {rod: {of: robot.link.rod.length, within: [10 cm, 3 m]}}\n"
            "  task: {path: robot.initial.joints.hinge, values: [70 deg, 90 deg]}\n")
        self.graze("improve", "swing.yaml", "--step", "damped", "--report", "swing.html", "-o", "swing.improve")
        told = self.open(self.folder / "swing.html")
        if not told:
            return
        self.check(told["sections"][:2] == ["section-outcome", "robots"], f"redesign: {told['sections']}")
        for section in ("section-limits", "section-progress", "section-design"):
            self.check(told["plots"].get(section, 0) > 0 and told["marks"][section] > 0, f"{section}: has a plot")
        self.check(told["rows"]["section-limits"] == 1, f"redesign: limits: {told['rows']}")
        self.check(told["stage"][0]["players"] == 2, "redesign: two robots")
        halves = told["halves"]
        self.check(min(halves["colors"]) > 8 and halves["same"] < 0.999, f"redesign: two robots are drawn: {halves}")
        self.check(told["played"] > 0, f"redesign: it moves: {told['played']}")
        told = self.open(self.folder / "swing.html", width=600)
        self.check(told and min(told["halves"]["colors"]) > 8, "redesign: one above the other")

    def large(self):
        """10,000 traces of the curb's robot with its 176 parameters."""
        scenario = self.folder / "large.yaml"
        scenario.write_text(f"include: {self.source}/data/scenarios/quadruped_curb.yaml\ntime: {{end: 5 ms}}\n")
        self.graze("run", scenario, "-n", 2500, "-o", "large.graze", "--quiet", "--ignore-space")
        self.graze("report", "large.graze", "-o", "large.html")
        size = (self.folder / "large.html").stat().st_size
        self.check(size < PAGE_LIMIT, f"a page of 10,000 traces has {size} bytes")
        self.open(self.folder / "large.html")
        print(f"10,000 traces: {size / 1e6:.1f} MB")


def main():
    if not chromium():
        print("there is no Chromium")
        return 77
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        test = Test(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), folder)
        test.report()
        test.unsolved()
        test.view()
        test.redesign()
        test.large()
        for claim in test.wrong:
            print(f"WRONG: {claim}")
        return 1 if test.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
