"""postchain check: states of frames, table, JSON, exit codes.

usage: check_test.py POSTCHAIN"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = None


class Check(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.path = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.call(0, "scene", "wheels", "-o", "in", "--frames", "1-8", "--size", "64x36",
                 "--device", "software", "-q")
        cls.run_chain("good", "fast")
        cls.run_chain("png", "fast", "--overflow", "clamp", name="o.####.png")

    @classmethod
    def call(cls, code, *words):
        done = subprocess.run([PROGRAM, *words], cwd=cls.path, capture_output=True, text=True,
                              timeout=300, check=False)
        assert done.returncode == code, (words, done.returncode, done.stdout, done.stderr)
        return done.stdout if code < 2 else done.stderr

    @classmethod
    def run_chain(cls, folder, chain, *more, name="o.####.exr"):
        cls.call(0, "run", chain, "-i", "in/sharp.####.exr", "--camera", "in/camera.json", "-o",
                 f"{folder}/{name}", "--mkdir", "--device", "software", "-q", *more)

    def states(self, pattern, *more, code):
        found = json.loads(self.call(code, "check", pattern, "--json", *more))
        self.assertEqual(found["whole"], code == 0)
        [sequence] = found["sequences"]
        states = {one["frame"]: one["state"] for one in sequence["frames"]}
        for state, count in sequence["counts"].items():
            self.assertEqual(list(states.values()).count(state), count)
        return states, sequence["frames"]

    def test_whole(self):
        for folder, name in [("good", "exr"), ("png", "png")]:
            states, frames = self.states(f"{folder}/o.####.{name}", code=0)
            self.assertEqual(states, {n: "whole" for n in range(1, 9)})
            # The sidecars in one.
            for frame in frames:
                sidecar = json.loads((self.path / (frame["output"] + ".json")).read_text())
                self.assertEqual(frame["times_ms"], sidecar["times_ms"])
                self.assertEqual(frame["bytes"], sidecar["output_bytes"])
        # Parts of one job are the same settings.
        self.run_chain("parts", "fast", "--chunk", "1/2")
        self.run_chain("parts", "fast", "--frames", "5-8", "--on-existing", "skip", "--png")
        self.states("parts/o.####.exr", code=0)

    def test_each_fault(self):
        shutil.copytree(self.path / "good", self.path / "bad")
        bad = self.path / "bad"
        (bad / "o.0002.exr").unlink()
        whole = (bad / "o.0003.exr").read_bytes()
        (bad / "o.0003.exr").write_bytes(whole[:-40])
        (bad / "o.0004.exr").write_bytes(b"no EXR")
        shutil.copy(self.path / "in/sharp.0005.exr", bad / "o.0005.exr")
        self.run_chain("bad", "fast", "--frames", "6", "--half", "--on-existing", "overwrite")
        self.run_chain("bad", "paper", "--frames", "7", "--on-existing", "overwrite")
        states, frames = self.states("bad/o.####.exr", code=1)
        self.assertEqual(states, {1: "whole", 2: "missing", 3: "damaged", 4: "damaged",
                                  5: "foreign", 6: "other settings", 7: "other settings",
                                  8: "whole"})
        self.assertIn("half=true", frames[5]["why"])
        (bad / "o.0002.exr").mkdir()
        states, frames = self.states("bad/o.####.exr", code=1)
        self.assertEqual((states[2], frames[1]["why"].rsplit(": ", 1)[-1], frames[1].get("bytes")),
                         ("damaged", "is not a file", None))
        (bad / "o.0002.exr").rmdir()
        table = self.call(1, "check", "bad/o.####.exr", "good/o.####.exr")
        lines = [line.split() for line in table.splitlines()]
        self.assertEqual(lines[1][:5], ["2", "1", "2", "2", "1"])
        self.assertEqual(lines[2][:5], ["8", "0", "0", "0", "0"])
        self.assertIn("bad/o.####.exr: damaged: 3-4", table)
        # An image other than an EXR is compared with its sidecar.
        shutil.copytree(self.path / "png", self.path / "bad_png")
        cut = self.path / "bad_png/o.0003.png"
        cut.write_bytes(cut.read_bytes()[:-40])
        states, frames = self.states("bad_png/o.####.png", code=1)
        self.assertEqual({n: states[n] for n in states if states[n] != "whole"}, {3: "damaged"})
        self.assertIn("another size than its sidecar says", frames[2]["why"])
        # The settings that are meant may be those of few frames.
        states, _ = self.states("bad/o.####.exr", "--like", "bad/o.0007.exr", code=1)
        self.assertEqual([n for n in states if states[n] == "whole"], [7])

    def test_a_copy_under_another_number(self):
        for folder, suffix in [("good", "exr"), ("png", "png")]:
            copied, moved = (self.path / f"{name}_{folder}" for name in ("copied", "moved"))
            shutil.copytree(self.path / folder, copied)
            for tail in (suffix, suffix + ".json"):
                shutil.copy(copied / f"o.0003.{tail}", copied / f"o.0006.{tail}")
            states, frames = self.states(f"copied_{folder}/o.####.{suffix}", code=1)
            self.assertEqual({n for n in states if states[n] != "whole"}, {6})
            self.assertEqual((states[6], frames[5]["why"]),
                             ("foreign", "was made as frame 3 and copied or renamed"))
            # A sequence with other numbers is whole.
            moved.mkdir()
            for file in (self.path / folder).glob("o.*"):
                shutil.copy(file, moved / file.name.replace("o.000", "o.010"))
            self.states(f"moved_{folder}/o.####.{suffix}", code=0)

    def test_sidecars_of_others(self):
        for folder, suffix in [("good", "exr"), ("png", "png")]:
            shutil.copytree(self.path / folder, self.path / f"odd_{folder}")
            odd = self.path / f"odd_{folder}/o.0002.{suffix}.json"
            expected = "whole" if suffix == "exr" else "foreign"
            for text in ('{"work": 3}', '{"work": null, "output_bytes": 1}', "[1]"):
                odd.write_text(text)
                found, _ = self.states(f"odd_{folder}/o.####.{suffix}", code=int(suffix == "png"))
                self.assertEqual(found[2], expected, text)

    def test_frames_that_must_exist(self):
        states, _ = self.states("good/o.####.exr", "--frames", "7-10", code=1)
        self.assertEqual(states, {7: "whole", 8: "whole", 9: "missing", 10: "missing"})
        self.assertIn("--frames", self.call(4, "check", "none/o.####.exr"))
        # A date beside the frames is no reason to look for twenty million others.
        shutil.copytree(self.path / "good", self.path / "dated")
        shutil.copy(self.path / "good/o.0001.exr", self.path / "dated/o.20261130.exr")
        self.assertIn("dated/o.####.exr: from frame 1 to 20261130 are more than 1000000 frames; "
                      "choose some with --frames", self.call(2, "check", "dated/o.####.exr"))
        self.states("dated/o.####.exr", "--frames", "1-8", code=0)
        self.call(2, "check")
        self.assertIn("--like", self.call(4, "check", "good/o.####.exr", "--like",
                                          "in/sharp.0001.exr"))


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
