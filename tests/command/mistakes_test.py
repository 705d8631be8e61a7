"""What the command says of a mistyped name, a misspelled option, and files without known channels.

usage: mistakes_test.py POSTCHAIN"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import exr

POSTCHAIN = None
WIDTH, HEIGHT = 16, 9


def run(*words, folder=None):
    return subprocess.run([POSTCHAIN, *map(str, words)], cwd=folder, capture_output=True, text=True,
                          check=False)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name, channels=("R", "G", "B"), value=0.5):
        exr.write(self.folder / name, exr.flat(WIDTH, HEIGHT, {
            channel: [value] * (WIDTH * HEIGHT) for channel in channels}))

    def said(self, code, *words):
        done = run(*words, folder=self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stderr


class Names(Case):
    def test_another_form_of_the_number_is_named(self):
        for n in (1, 2):
            self.write(f"beauty.{n:04}.exr")
        for typed in ("beauty.#.exr", "beauty.*.exr", "beauty.%02d.exr", "beuaty.####.exr"):
            for words in (["inspect", typed], ["plan", "fast", "-i", typed],
                          ["diff", typed, "beauty.####.exr"] if "*" not in typed else
                          ["diff", typed, "beauty.0001.exr"]):
                self.assertIn(f"{typed}: ", said := self.said(4, *words))
                self.assertIn("(did you mean 'beauty.####.exr'?)", said)
        # The folder as it was typed, and a single frame by its own name.
        self.assertIn(f"(did you mean '{self.folder}/beauty.####.exr'?)",
                      self.said(4, "inspect", self.folder / "beauty.#.exr"))
        self.assertIn("(did you mean './beauty.0002.exr'?)",
                      self.said(4, "inspect", "./beuty.0002.exr"))
        self.assertIn("(did you mean 'beauty.####.exr'?)", self.said(4, "inspect", "beauty.0009.exr"))

    def test_nothing_is_named_that_is_not_like_it(self):
        self.write("beauty.0001.exr")
        for typed in ("depth_of_the_car.####.exr", "beauty.####.png", "no/beauty.####.exr"):
            self.assertNotIn("did you mean", self.said(4, "inspect", typed))


class Numbers(Case):
    """As in chain files: none is octal or hexadecimal."""
    def test_only_decimal_numbers(self):
        for word, why in {"010": "'010' begins with 0", "0x10": '"0x10" is not a number',
                          "nan": '"nan" is not a number', "0": "Value 0 not in range 1 to 1024"}.items():
            for words in (["sheet", "in.####.exr", "-o", "a.png", "--threads", word],
                          ["info", "--threads", word]):
                self.assertIn(f"--threads: {why}", self.said(2, *words))
        self.assertIn("--idle: \"inf\" is not a number",
                      self.said(2, "run", "fast", "-i", "a.exr", "-o", "b.exr", "--watch", "--idle", "inf"))


class Folders(Case):
    def test_one_that_is_missing_is_found_before_a_frame_is_read(self):
        (self.folder / "no.0001.exr").write_bytes(b"no EXR")
        for output, why in (("none/out.png", "folder none does not exist; create it first"),
                            ("no.0001.exr/out.png", "no.0001.exr is a file, not a folder")):
            for words in (["sheet", "no.0001.exr", "-o"], ["diff", "no.0001.exr", "no.0001.exr", "--map"]):
                self.assertEqual(self.said(5, *words, output), f"postchain: error: {output}: {why}\n")


class Options(Case):
    def test_every_subcommand_names_the_closest_option(self):
        subcommands = re.findall(r"^  (\w+)  ", run("--help").stdout, re.M)
        self.assertGreater(len(subcommands), 15)
        # Those of parts that are not built have no options to name.
        here = [name for name in subcommands if run(name, "--help").returncode == 0]
        self.assertGreater(len(here), 10)
        for name in here:
            for typed, meant in (("--verbos", "--verbose"), ("--log-fromat=json", "--log-format")):
                self.assertIn(f"unknown option '{typed.split('=')[0]}' (did you mean '{meant}'?)",
                              said := self.said(2, name, typed))
                self.assertIn(f"see postchain {name} --help", said)

    def test_others(self):
        for typed, said in (
                # Not that a required option is missing.
                ("run fast --inptu a.exr -o b.exr", "unknown option '--inptu' (did you mean '--input'?)"),
                ("--versio", "unknown option '--versio' (did you mean '--version'?)"),
                ("info --quite-another", "unknown option '--quite-another';"),
                ("info more", "unexpected argument 'more';"),
                ("run fast a.exr b.exr", "unexpected argument 'a.exr' (did you mean '--input a.exr'?);"),
                ("run fast -i a.exr b.exr", "unexpected argument 'b.exr' (did you mean '--output b.exr'?);"),
                ("run fast -o b.exr", "--input is required")):
            self.assertIn(said, self.said(2, *typed.split()))


class Channels(Case):
    """RenderMan names color Ci."""

    def setUp(self):
        super().setUp()
        for n in (1, 2, 3):
            self.write(f"r.{n:04}.exr", ("Ci.r", "Ci.g", "Ci.b", "Z"))

    def test_one_line_once(self):
        for words in (["run", "fast", "-i", "r.####.exr", "-o", "o.####.exr", "--device",
                       "software", "--on-error", "continue"],
                      ["plan", "fast", "-i", "r.####.exr"],
                      ["inspect", "r.####.exr", "--frames", "1-3"]):
            said = self.said(4, *words)
            self.assertNotIn("\\n", said)
            self.assertEqual(said.count("no color; "), 1, said)
            self.assertIn("; found: Ci.b Ci.g Ci.r Z", said)
            self.assertIn("error: frames 2-3: the error of frame 1", said)

    def test_all_faults_of_a_profile(self):
        (self.folder / "mine.yaml").write_text("profile: 1\ncolour: {}\ndepht: {}\n")
        said = self.said(2, "inspect", "r.0001.exr", "--profile", "mine.yaml")
        self.assertNotIn("\\n", said)
        self.assertRegex(said, r"unknown key 'colour'.*; mine.yaml:3:1: error: depht: ")

    def test_the_survey_lists_the_fault_once(self):
        found = run("inspect", "r.####.exr", folder=self.folder).stdout
        self.assertIn("3 frames examined, 1 to 3: none can be read\n", found)
        self.assertIn("  frame 1 and 2 more: cannot be read: r.0001.exr: no color; ", found)
        self.assertEqual(found.count("no color; "), 1, found)
        # Programs get each.
        survey = json.loads(run("inspect", "r.####.exr", "--json", folder=self.folder).stdout
                            .splitlines()[-1])["sequence"]
        self.assertEqual([one["frame"] for one in survey["findings"]], [1, 2, 3])


if __name__ == "__main__":
    POSTCHAIN = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=1)
