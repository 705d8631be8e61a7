"""The examples of docs/service.md, as written: every ```sh block, one after the other in one shell, in
an empty folder, with the built command as postchain.

usage: example_test.py POSTCHAIN"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = None


class Examples(unittest.TestCase):
    def test_all(self):
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(PROGRAM, os.path.join(folder, "postchain"))
            blocks = re.findall(r"^```sh\n(.*?)^```$", (ROOT / "docs/service.md").read_text("utf8"),
                                re.S | re.M)
            marked = "".join(f"echo '== {i}'\n{block}echo\n" for i, block in enumerate(blocks))
            script = "set -eu -o pipefail; set -m\ntrap 'kill %1 2>/dev/null || true' EXIT\n"
            environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}")
            done = subprocess.run(["bash", "-c", script + marked + "wait %1 || echo stopped $?"],
                                  cwd=folder, env=environment, timeout=800, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            out = re.split(r"^== \d+\n", done.stdout, flags=re.M)[1:]
            self.assertRegex(out[1], r'"type":"done".*"exit_code":0')
            job, frames, frame = [json.loads(x) for x in out[2].strip().split("\n")]
            self.assertEqual((job["state"], job["done"]), ("done", 2))
            self.assertEqual([f["state"] for f in frames["frames"]], ["written"] * 2)
            self.assertEqual(frame["sidecar"]["frame"], 2)
            plan, checked = [json.loads(x) for x in out[3].strip().split("\n")]
            self.assertEqual(len(plan["frames"][0]["plan"]["passes"]), 3)
            self.assertEqual(checked["diagnostics"][0]["line"], 2)
            self.assertIn("| paper |", out[4])
            for word in ('{"jobs"', "postchain_http_replies_total", "stopped 143"):
                self.assertIn(word, out[5])
            for picture in ("after.png", "preview.png"):
                data = pathlib.Path(folder, picture).read_bytes()
                self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n", picture)
            self.assertTrue(pathlib.Path(folder, "out/wheels.0002.exr").exists())


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
