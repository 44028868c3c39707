#!/usr/bin/env python3
"""Installs the build, builds the programs of docs/library.md against it by find_package(graze), and runs them.

usage: library.py ROOT BUILD CXX

Their counts must be those of a campaign of the installed program, which is called by the scenario's bare name from a folder of
its own. Exit code 1 and what went wrong.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

PARTICLES = 40


def run(*command, folder, **more):
    done = subprocess.run([str(c) for c in command], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)



def main():
    root, build, compiler = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    page = (root / "docs/library.md").read_text(encoding="utf-8")
    environment = {k: v for k, v in os.environ.items() if k not in ("GRAZE_DATA", "DESTDIR")}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        prefix, user = folder / "prefix", folder / "user"
        user.mkdir()
        run("cmake", "--install", build, "--prefix", prefix, folder=folder)
        (user / "count.cpp").write_text(blocks(page, "cpp")[0])
        program = blocks(page, "cmake")[0]
        targets = [line for line in program.split("\n") if line.startswith(("add_exec", "target_link"))]
        for user_program, block in zip(("branch", "foresee", "hold"), blocks(page, "cpp")[1:]):
            (user / f"{user_program}.cpp").write_text(block)
            program += "\n" + "\n".join(line.replace("count", user_program) for line in targets)
        (user / "CMakeLists.txt").write_text(program + "\n")
        run("cmake", "-S", user, "-B", user / "build", f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_CXX_COMPILER={compiler}",
            folder=user)
        run("cmake", "--build", user / "build", folder=user)
        scenario = prefix / "share/graze/scenarios/pendulum.yaml"
        counted = run(user / "build/count", scenario, PARTICLES, folder=user, env=environment)
        graze = prefix / "bin/graze"
        run(graze, "run", "pendulum", "-n", PARTICLES, "-o", "p.graze", "--quiet", folder=user, env=environment)
        score = json.loads(run(graze, "score", "p.graze", "--json", folder=user, env=environment))
        for policy in score["policies"]:
            line = next(l for l in counted.splitlines() if l.split()[0] == policy["policy"])
            found = [int(n) for n in re.findall(r"(\d+) (?=success|known|unknown|invalid)", line)]
            wanted = [policy[key] for key in ("success", "known_failure", "unknown_failure", "invalid")]
            assert found == wanted and sum(found) == PARTICLES, f"counted {found}, the campaign has {wanted}"
        # What goes on under the policy that it was saved under comes to what the campaign has.
        branched = run(user / "build/branch", scenario, PARTICLES, "0.1", folder=user, env=environment).split()
        assert branched[0] == score["policies"][0]["policy"], branched
        assert int(branched[1]) == score["policies"][0]["success"] and int(branched[3]) == PARTICLES, branched
        foreseen = run(user / "build/foresee", scenario, "0.1", folder=user, env=environment)
        best = foreseen.splitlines()[-1].removeprefix("best: ")
        assert best in [policy["policy"] for policy in score["policies"]] and f"{best} " in foreseen, foreseen
        held = run(user / "build/hold", prefix / "share/graze/scenarios/quadruped_walk.yaml", folder=user, env=environment)
        forces = [float(n) for n in re.findall(r"dof \d+: (\S+),", held)]
        rates = [float(n) for n in re.findall(r"acceleration (\S+)", held)]
        mass = float(re.search(r"mass (\S+) kg", held).group(1))
        assert len(forces) == 18 and abs(forces[5] / mass - 9.81) < 5e-3 and max(map(abs, rates)) < 1e-9, held
        refused = subprocess.run([user / "build/count", "nowhere.yaml", "3"], capture_output=True, text=True)
        assert refused.returncode == 2 and "nowhere.yaml" in refused.stderr, refused
    print("the programs of docs/library.md count what the campaign has, and hold the robot still")


if __name__ == "__main__":
    main()
