#!/usr/bin/env python3
"""around_the_program.py SOURCE GRAZE: what stands around the program: completion in shells, manual pages, copies of examples.

Claims: bash completes verbs, options, files, policies and paths of the scenario on the line, also where it breaks words at "="; the
scripts of fish and zsh do as well where these are installed. Each verb has a manual page with all of its options, which groff
renders without a warning. Each shipped scenario can be copied, and the copy needs nothing but itself."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SOURCE, GRAZE = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
wrong = []


def expect(truth, what):
    if not truth:
        wrong.append(what)


def graze(*words, folder=None, **environment):
    return subprocess.run([GRAZE, *words], cwd=folder, capture_output=True, text=True, timeout=300,
                          env=dict(os.environ, **environment))


def bash_words(line):
    """The line as readline gives it to a completion: blanks part words, and so do = and : (COMP_WORDBREAKS)."""
    words = re.findall(r"[=:]+|[^\s=:]+", line)
    return words + [""] if line.endswith(" ") else words


def bash(folder, line):
    """What bash would offer for the end of the line."""
    script = ('source <("$1" completion bash); COMP_LINE=$2 COMP_POINT=${#2}; shift 2; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
              '_graze "$1"; ((${#COMPREPLY[@]})) && printf "%s\\n" "${COMPREPLY[@]}"')
    run = subprocess.run(["bash", "-c", script, "bash", GRAZE, str(GRAZE) + line.removeprefix("graze"), GRAZE, *bash_words(line)[1:]], cwd=folder, text=True,
                         capture_output=True, timeout=60)
    expect(run.stderr == "", f"bash, '{line}': {run.stderr}")
    return run.stdout.split("\n")[:-1]


def check_bash(folder):
    def offers(line, *words):
        got = bash(folder, line)
        expect(all(word in got for word in words), f"bash, '{line}': {got} lack some of {words}")

    def is_exactly(line, *words):
        got = sorted(bash(folder, line))
        expect(got == sorted(words), f"bash, '{line}': {got} are not {words}")

    is_exactly("graze ru", "run")
    offers("graze ", "run", "score", "doctor", "completion", "help")
    expect("complete" not in bash(folder, "graze "), "a hidden word is offered")
    is_exactly("graze run --unt", "--until")
    is_exactly("graze submit my.yaml --unt", "--until")  # an option of run
    offers("graze run ", "quadruped_curb", "my.yaml", "sub")
    is_exactly("graze run m", "my.yaml")
    is_exactly("graze score c", "c.graze", "c.h5")
    is_exactly("graze run my.yaml --policy ", "step/1cm", "step/2cm", "walk")
    is_exactly("graze run my.yaml --policy w", "walk")
    is_exactly("graze run my.yaml --policy=st", "step/1cm", "step/2cm")  # the word is "st" to bash
    is_exactly("graze run my.yaml --policy=", "step/1cm", "step/2cm", "walk")
    is_exactly("graze run my.yaml --policy 'step/2", "step/2cm")
    is_exactly("graze run my.yaml --telemetry ", "all", "failures", "last", "none")
    is_exactly("graze run my.yaml --set time.e", "time.end=")
    is_exactly("graze run my.yaml --set tim", "time.")
    is_exactly("graze run my.yaml --set time.end=", )
    offers("graze sweep my.yaml --over environment.curb.", "environment.curb.box=", "environment.curb.position=")
    is_exactly("graze help sobo", "sobol")
    offers("graze completion ", "bash", "fish", "zsh")
    offers("graze new ", "policy-c", "my.yaml")
    is_exactly("graze new a.yaml ", "robot.urdf", "sub", "c.graze")
    is_exactly("graze doctor ", "c.graze", "sub")
    is_exactly("graze drive my.yaml --replay ", "c.graze", "sub", "way.csv")
    is_exactly("graze drive my.yaml --record w", "way.csv")
    offers("graze drive my.yaml --keys ", "way.csv", "my.yaml")
    is_exactly("graze plot c.graze surv", "survival")
    is_exactly("graze improve my.yaml --step ", "damped", "plain")
    is_exactly("graze run broken.yaml --policy ", )
    is_exactly("graze nothing ", )


def check_archive(folder):
    """Policies, requirements and parameters of a campaign."""
    run = graze("run", "pendulum", "-n", "2", "--quiet", "-o", "p.graze", folder=folder)
    expect(run.returncode == 0, run.stderr)
    names = [line.split("\t")[0] for line in graze("complete", "--", "score", "p.graze", "--policy", "",
                                                  folder=folder).stdout.splitlines()[1:]]
    table = graze("score", "p.graze", "--json", folder=folder).stdout
    expect(names and all(f'"{name}"' in table for name in names), f"policies of an archive: {names}")
    offered = graze("complete", "--", "plot", "p.graze", "parameters", "--parameter", "robot.", folder=folder).stdout
    expect("robot.link." in offered, f"parameters of an archive: {offered}")


def check_fish(folder):
    if not shutil.which("fish"):
        return
    script = (f"{GRAZE} completion fish | source; function graze; {GRAZE} $argv; end; "
              "for line in $argv; complete -C $line; echo END; end")
    lines = ["graze ru", "graze run my.yaml --policy w", "graze run m", "graze run my.yaml --set time.e"]
    run = subprocess.run(["fish", "--no-config", "-c", script, *lines], cwd=folder, capture_output=True, text=True,
                         timeout=60, env=dict(os.environ, HOME=str(folder), PATH=f"{GRAZE.parent}:{os.environ['PATH']}"))
    got = [[line.split("\t")[0] for line in part.splitlines()] for part in run.stdout.split("END\n")]
    expect(got[:4] == [["run"], ["walk"], ["my.yaml"], ["time.end="]], f"fish: {got} {run.stderr}")


def check_zsh(folder):
    if not shutil.which("zsh"):
        return
    (folder / "_graze").write_text(graze("completion", "zsh").stdout)
    run = subprocess.run(["zsh", "-fn", folder / "_graze"], capture_output=True, text=True, timeout=60)
    expect(run.returncode == 0 and not run.stderr, f"zsh: {run.stderr}")


def check_manual(folder):
    pages = folder / "manual"
    expect(graze("manual", str(pages)).returncode == 0, "graze manual")
    for verb, code in (("improve", "no step helps any more"), ("predict", "no verdict"), ("score", "a gate was missed")):
        expect(code in (pages / f"graze-{verb}.1").read_text(), f"graze-{verb}.1 does not tell '{code}'")
    verbs = re.findall(r"^  ([a-z]+) ", graze("--help").stdout.split("Subcommands:")[1], re.M)
    expect(len(verbs) > 20, f"verbs: {verbs}")
    expect({page.name for page in pages.iterdir()} == {"graze.1"} | {f"graze-{verb}.1" for verb in verbs}, "pages")
    for verb in verbs:
        text = (pages / f"graze-{verb}.1").read_text().replace("\\-", "-")
        options = set(re.findall(r"(--[a-z][a-z-]*)", graze(verb, "--help").stdout))
        missing = [option for option in options if option not in text]
        expect(not missing, f"graze-{verb}.1 lacks {missing}")
    if not shutil.which("groff"):
        return
    for page in sorted(pages.iterdir()):
        run = subprocess.run(["groff", "-man", "-Tutf8", "-P-cbou", "-ww", "-rLL=100n", page], capture_output=True, text=True, timeout=60)
        expect(run.returncode == 0 and run.stderr == "", f"groff {page.name}: {run.stderr}")
        expect("NAME" in run.stdout and "EXIT STATUS" in run.stdout, f"{page.name} is no page")


def check_examples(folder):
    """Copies are checked with no shipped files to be found."""
    listed = graze("examples").stdout
    names = sorted(file.stem for file in (SOURCE / "data/scenarios").glob("*.yaml"))
    nowhere = folder / "nowhere"
    nowhere.mkdir()
    for name in names:
        line = re.search(rf"^  {name} +(.*)$", listed, re.M)
        expect(line and len(line[1]) > 20, f"examples does not say what {name} is")
        made = graze("examples", name, folder=folder)
        expect(made.returncode == 0, f"examples {name}: {made.stderr}")
        check = graze("check", f"scenarios/{name}.yaml", folder=folder / name, GRAZE_DATA=str(nowhere))
        expect(check.returncode == 0, f"a copy of {name}: {check.stderr}")
        same = (folder / name / f"scenarios/{name}.yaml").read_bytes() == (SOURCE / f"data/scenarios/{name}.yaml").read_bytes()
        expect(same, f"the copy of {name} differs")
    for robot in (SOURCE / "data/robots").glob("*.urdf"):
        expect(re.search(rf"^  {robot.name} +\S", listed, re.M), f"examples does not say what {robot.name} is")
    run = graze("run", "scenarios/pendulum.yaml", "-n", "4", "--quiet", folder=folder / "pendulum", GRAZE_DATA=str(nowhere))
    expect(run.returncode == 0, f"the copy of pendulum does not run: {run.stderr}")
    before = (folder / "pendulum/scenarios/pendulum.yaml").read_bytes()
    again = graze("examples", "pendulum", folder=folder)
    expect(again.returncode == 2 and "pendulum: exists already" in again.stderr, f"a copy over another: {again.stderr}")
    expect((folder / "pendulum/scenarios/pendulum.yaml").read_bytes() == before, "it was changed")
    expect(graze("examples", "links.urdf", "robot", folder=folder).returncode == 0, "a robot")
    expect((folder / "robot/links.urdf").is_file(), "a robot's file")
    near = graze("examples", "quadruped_crub", folder=folder)
    expect(near.returncode == 2 and "did you mean 'quadruped_curb'?" in near.stderr, near.stderr)
    none = graze("examples", folder=folder, GRAZE_DATA=str(nowhere))
    expect(none.returncode == 3 and "GRAZE_DATA" in none.stderr, f"no examples: {none.stderr}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name) / "line"
        (folder / "sub").mkdir(parents=True)
        (folder / "my.yaml").write_text(f"""include: {SOURCE}/data/scenarios/quadruped_curb.yaml
policies: !replace
  walk: {{hold: {{}}, control: {{torque: {{}}}}}}
  step: {{gait: {{velocity: [0.2, 0, 0], duration: 0.3 s, duty: 75 %, liftoff: [25, 75, 0, 50, "%"]}}, control: {{joint_pd: {{kp: 20}}}},
    over: {{gait.step_height: [1 cm, 2 cm]}}}}
""")
        (folder / "broken.yaml").write_text("graze: 1\nrobot: [\n")
        (folder / "robot.urdf").write_text("")
        (folder / "notes.txt").write_text("")
        (folder / "way.csv").write_text("time,forward,strafe,turn\n0,0.2,0,0\n")
        (folder / "c.h5").write_text("")
        (folder / "c.graze").mkdir()
        check_bash(folder)
        check_fish(folder)
        check_archive(folder)
        for check in (check_zsh, check_manual, check_examples):
            own = pathlib.Path(name) / check.__name__
            own.mkdir()
            check(own)
    print("\n".join(wrong + [f"{len(wrong)} faults"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
