"""Runs the transcript of docs/first_half_hour.md: every ```sh block in turn in one
empty folder, with the built command as postchain. The lines of the following ```text block must
be printed in that order; `...` matches any text, even none.

usage: first_half_hour_test.py POSTCHAIN"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = None


def steps(text):
    """Pairs of a script and its expected lines."""
    found = []
    for kind, block in re.findall(r"^```(sh|text)\n(.*?)^```$", text, re.S | re.M):
        if kind == "sh":
            found.append((block, []))
        else:
            found[-1][1].extend(line for line in block.splitlines() if line.strip())
    return found


def missing_line(lines, printed):
    """First expected line not found in order; None if all are."""
    rest = iter(printed)
    for line in lines:
        pattern = ".*".join(re.escape(part) for part in re.split(r" *\.\.\. *", line))
        if not any(re.fullmatch(pattern, candidate) for candidate in rest):
            return line
    return None


class FirstHalfHour(unittest.TestCase):
    def test_every_step(self):
        found = steps((ROOT / "docs/first_half_hour.md").read_text(encoding="utf8"))
        self.assertGreaterEqual(len(found), 6)
        figures = []
        with tempfile.TemporaryDirectory() as folder:
            programs = pathlib.Path(folder, "programs")
            work = pathlib.Path(folder, "work")
            programs.mkdir()
            work.mkdir()
            (programs / "postchain").symlink_to(PROGRAM)
            environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}")
            for script, lines in found:
                done = subprocess.run(["bash", "-eu", "-c", script], cwd=work, env=environment,
                                      timeout=400, text=True, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, check=False)
                self.assertEqual(done.returncode, 0, script + done.stdout)
                self.assertIsNone(missing_line(lines, done.stdout.splitlines()), done.stdout)
                figures += re.findall(r"^  flip +([0-9.]+)(?: .*)?$", done.stdout, re.M)
            self.assertTrue((work / "out/wheels.0004.exr.json").exists())
            self.assertTrue((work / "report/index.html").exists())
        # "The second figure is the lower one."
        self.assertEqual(len(figures), 2)
        self.assertGreater(float(figures[0]), float(figures[1]))

    def test_that_a_line_that_is_not_printed_is_seen(self):
        self.assertIsNone(missing_line(["a ... c", "d"], ["x", "a b c", "d"]))
        self.assertEqual(missing_line(["a ... c", "e"], ["a b c", "d"]), "e")
        self.assertEqual(missing_line(["d", "a"], ["a", "d"]), "a")


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
