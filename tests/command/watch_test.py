"""postchain run --watch: frames that come slowly, in any order, in pieces, by
rename, or never give the same bytes as a run over all of them.

usage: watch_test.py POSTCHAIN"""
import os
import pathlib
import random
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

POSTCHAIN = None
FRAMES = range(1, 6)


def table_of(data, chunks):
    """Offset of an EXR's chunk table, which the first chunk follows."""
    return next(at for at in range(len(data) - 8 * chunks)
                if struct.unpack_from("<Q", data, at)[0] == at + 8 * chunks)


def in_pieces(path, data, chunks=3, pause=0.2):
    """Writes an EXR as a renderer does: header, a table of zeros, pixels, finally the table."""
    at = table_of(data, chunks)
    with open(path, "wb", buffering=0) as file:
        pieces = data[:at] + bytes(8 * chunks) + data[at + 8 * chunks:]
        step = len(pieces) // 6 + 1
        for place in range(0, len(pieces), step):
            file.write(pieces[place:place + step])
            time.sleep(pause)
        file.seek(at)
        file.write(data[at:at + 8 * chunks])


def by_rename(path, data, pause=0.3):
    temporary = path.with_name("." + path.name + ".part")
    temporary.write_bytes(data[:len(data) // 2])
    time.sleep(pause)
    temporary.write_bytes(data)
    temporary.rename(path)


class Watch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rendered = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        subprocess.run([POSTCHAIN, "scene", "wheels", "--size", "64x36", "--frames", "1-5", "-o",
                        cls.rendered, "-q"], check=True)
        cls.data = {n: (cls.rendered / f"sharp.{n:04}.exr").read_bytes() for n in FRAMES}

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "in").mkdir()

    def frame(self, number):
        return self.folder / f"in/s.{number:04}.exr"

    def start(self, out, *options, source=None):
        process = subprocess.Popen(
            [POSTCHAIN, "run", "balanced", "-i", source or self.folder / "in/s.####.exr", "--camera",
             self.rendered / "camera.json", "-o", self.folder / out / "o.####.exr", "--mkdir",
             "--device", "software", *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def end(self, process, code=0):
        said, _ = process.communicate(timeout=300)
        self.assertEqual(process.returncode, code, said)
        return said

    def run_now(self, out, *options, code=0, **more):
        return self.end(self.start(out, *options, **more), code)

    def pictures(self, out):
        return {path.name: path.read_bytes() for path in (self.folder / out).glob("*.exr")}

    def assert_as_a_run(self, out, *options, **more):
        """`out` equals the outputs of a run over the current files."""
        self.run_now("plain", *options, **more)
        expected = self.pictures("plain")
        self.assertGreater(len(expected), 0)
        found = self.pictures(out)
        self.assertEqual(sorted(found), sorted(expected))
        for name, data in expected.items():
            self.assertTrue(found[name] == data, name)
        left = [path.name for path in (self.folder / out).iterdir() if path.name.startswith(".")]
        self.assertEqual(left, [])

    def write_all(self, seed):
        """Starts a writer: random order, in pieces or by rename, some simultaneously."""
        order = list(FRAMES)
        rng = random.Random(seed)
        rng.shuffle(order)
        ways = {n: rng.choice([in_pieces, by_rename]) for n in order}
        ways[order[0]], ways[order[1]] = in_pieces, by_rename

        def write():
            running = []
            for number in order:
                running.append(threading.Thread(target=ways[number],
                                                args=(self.frame(number), self.data[number])))
                running[-1].start()
                time.sleep(rng.random())
            for one in running:
                one.join()

        writer = threading.Thread(target=write)
        writer.start()
        self.addCleanup(writer.join)
        return writer

    def test_frames_that_come_slowly_give_the_bytes_of_a_run(self):
        process = self.start("watched", "--frames", "1-5", "--watch")
        self.write_all(1).join()
        said = self.end(process)
        self.assertRegex(said, "0/5 frames; waiting for frames: (missing|incomplete): ")
        self.assertIn("5 written of 5 frames", said)
        self.assert_as_a_run("watched")

    def test_parts_of_a_farm_wait_for_frames_of_others(self):
        parts = [self.start("watched", "--frames", "1-5", "--chunk", f"{i}/2", "--watch", "--png")
                 for i in (1, 2)]
        self.write_all(4).join()
        for part in parts:
            self.end(part)
        self.assertTrue((self.folder / "watched/o.0003.png").exists())
        self.assert_as_a_run("watched")

    def test_what_never_comes_whole_is_named_and_not_written(self):
        self.frame(1).write_bytes(self.data[1])
        self.frame(2).write_bytes(self.data[2][:-100])  # its writer was killed
        said = self.run_now("watched", "--frames", "1-3", "--watch", "--idle", "3", code=1)
        for number in (2, 3):
            self.assertIn(str(self.frame(number)), said)
        self.assertIn("2 missing", said)
        self.assertEqual(list(self.pictures("watched")), ["o.0001.exr"])

    def test_signals_end_it_while_it_waits(self):
        for name, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            process = self.start(f"out{code}", "--frames", "1-2", "--watch")
            line = process.stdout.readline()
            self.assertIn("waiting for frames", line)
            process.send_signal(name)
            self.end(process, code)

    def test_pictures_beside_data(self):
        subprocess.run([POSTCHAIN, "run", "balanced", "-i", self.rendered / "sharp.####.exr",
                        "--camera", self.rendered / "camera.json", "-o",
                        self.folder / "c.####.png", "--overflow", "clamp", "-q"], check=True)
        pngs = {n: (self.folder / f"c.{n:04}.png").read_bytes() for n in FRAMES}
        source = (f"color={self.folder}/in/c.####.png,depth={self.folder}/in/s.####.exr,"
                  f"motion={self.folder}/in/s.####.exr")
        process = self.start("watched", "--frames", "1-3", "--watch", source=source)
        for number in (2, 3, 1):
            path = self.folder / f"in/c.{number:04}.png"
            path.write_bytes(pngs[number][:100])
            self.frame(number).write_bytes(self.data[number])
            path.write_bytes(pngs[number])
        self.end(process)
        self.assert_as_a_run("watched", source=source)
        # An incomplete image that never changes.
        half = self.folder / "in/c.0004.png"
        half.write_bytes(pngs[4][:-400])
        self.frame(4).write_bytes(self.data[4])
        said = self.run_now("half", "--frames", "4", "--watch", "--idle", "3", source=source, code=4)
        self.assertIn(str(half), said)

    def test_outputs_that_are_there_are_refused_before_it_waits(self):
        self.frame(1).write_bytes(self.data[1])
        self.run_now("out")
        said = self.run_now("out", "--watch", "--frames", "1-3", code=5)
        self.assertIn("o.0001.exr", said)
        self.assertNotIn("waiting", said)

    def test_nothing_at_all_is_an_error(self):
        said = self.run_now("out", "--watch", "--idle", "1", code=4)
        self.assertIn("s.####.exr: no file matches this pattern, and nothing changed for 1 s", said)


if __name__ == "__main__":
    POSTCHAIN = os.path.abspath(sys.argv.pop(1))
    unittest.main()
