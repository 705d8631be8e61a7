"""Runs the transcripts docs/first_half_hour.md and docs/recipes.md: every ```sh block in turn in one
empty folder, with the built command as postchain. The lines of the following ```text block must
be printed in that order; `...` matches any text, even none. Blocks after <!-- blender --> need Blender,
and the add-on installed as docs/blender.md says.

usage: first_half_hour_test.py POSTCHAIN [ZIP BLENDER]"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ZIP = BLENDER = None


def steps(text):
    """Tuples of a script, its expected lines, and whether it needs Blender."""
    found = []
    for mark, kind, block in re.findall(r"^(<!-- blender -->\n\n)?```(sh|text)\n(.*?)^```$", text,
                                        re.S | re.M):
        if kind == "sh":
            found.append((block, [], bool(mark)))
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


class Transcript(unittest.TestCase):
    def setUp(self):
        temporary = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.work = temporary / "work"
        programs = temporary / "programs"
        for folder in (self.work, programs):
            folder.mkdir()
        (programs / "postchain").symlink_to(PROGRAM)
        self.environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", PWD=str(self.work))
        for name in ("SCRIPTS", "CONFIG"):
            folder = temporary / name.lower()
            folder.mkdir()
            self.environment[f"BLENDER_USER_{name}"] = str(folder)
        if BLENDER:
            (programs / "blender").symlink_to(BLENDER)

    def run_script(self, script):
        done = subprocess.run(["bash", "-eu", "-c", script], cwd=self.work, env=self.environment,
                              timeout=400, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              check=False)
        self.assertEqual(done.returncode, 0, script + done.stdout)
        return done.stdout

    def run_page(self, page):
        """Everything that the page's commands print."""
        printed = ""
        found = steps((ROOT / "docs" / page).read_text(encoding="utf8"))
        self.assertGreaterEqual(len(found), 6)
        for script, lines, needs_blender in found:
            if needs_blender and not BLENDER:
                print("Blender is not installed: left out is " + script)
                continue
            output = self.run_script(script)
            self.assertIsNone(missing_line(lines, output.splitlines()), output)
            printed += output
        return printed

    def install_addon(self):
        """As docs/blender.md says, and a user's file shot.blend."""
        page = (ROOT / "docs/blender.md").read_text(encoding="utf8")
        script = re.search(r"<!-- install -->\n+```sh\n(.*?)```", page, re.S)[1]
        self.run_script(script.replace("$HOME/.local/share/postchain/postchain_blender.zip", ZIP))
        self.run_script(f"""blender -b --python-exit-code 1 --python-expr "import sys; \
            sys.path.insert(0, '{ROOT}/tests/blender'); import bpy, scene; scene.make('{self.work}'); \
            bpy.context.scene.postchain.output = '//filtered'; \
            bpy.ops.wm.save_as_mainfile(filepath='{self.work}/shot.blend')" """)

    def test_first_half_hour(self):
        if BLENDER:
            self.install_addon()
        printed = self.run_page("first_half_hour.md")
        self.assertTrue((self.work / "out/wheels.0004.exr.json").exists())
        self.assertTrue((self.work / "report/index.html").exists())
        # "The second value is lower"
        figures = re.findall(r"^  hdr_flip +([0-9.]+)(?: .*)?$", printed, re.M)
        self.assertEqual(len(figures), 2)
        self.assertGreater(float(figures[0]), float(figures[1]))

    def test_recipes(self):
        self.run_page("recipes.md")
        for name in ("left.0002.exr", "shot.0002.exr", "deep.0002.exr", "pan.0002.exr"):
            self.assertTrue((self.work / "out" / name).exists(), name)
        # The hole in the wall shows the plate.
        self.assertTrue((self.work / "comp.0002.exr").exists())

    def test_that_a_line_that_is_not_printed_is_seen(self):
        self.assertIsNone(missing_line(["a ... c", "d"], ["x", "a b c", "d"]))
        self.assertEqual(missing_line(["a ... c", "e"], ["a b c", "d"]), "e")
        self.assertEqual(missing_line(["d", "a"], ["a", "d"]), "a")


if __name__ == "__main__":
    PROGRAM, ZIP, BLENDER = ([os.path.abspath(word) for word in sys.argv[1:]] + [None, None])[:3]
    del sys.argv[1:]
    unittest.main()
