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


def blocks():
    text = (ROOT / "docs/service.md").read_text(encoding="utf8")
    return re.findall(r"^```sh\n(.*?)^```$", text, re.S | re.M)


class Examples(unittest.TestCase):
    def test_all(self):
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(PROGRAM, os.path.join(folder, "postchain"))
            marked = "".join(f"echo '== {i}'\n{block}echo\n" for i, block in enumerate(blocks()))
            script = "set -eu -o pipefail; set -m\ntrap 'kill %1 2>/dev/null || true' EXIT\n"
            environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}")
            done = subprocess.run(["bash", "-c", script + marked + "wait %1 || echo stopped $?"],
                                  cwd=folder, env=environment, timeout=800, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            out = dict(enumerate(re.split(r"^== \d+\n", done.stdout, flags=re.M)[1:]))
            self.assertIn('"state":"queued"', out[1])
            self.assertRegex(out[1], r'"type":"done".*"exit_code":0')
            job, frames, frame = [json.loads(x) for x in out[2].strip().split("\n")]
            self.assertEqual((job["state"], job["done"]), ("done", 2))
            self.assertEqual([f["state"] for f in frames["frames"]], ["written"] * 2)
            self.assertEqual(frame["sidecar"]["frame"], 2)
            plan, checked = [json.loads(x) for x in out[3].strip().split("\n")]
            self.assertEqual([p["pass"] for p in plan["frames"][0]["plan"]["passes"]],
                             ["motion_blur", "fxaa", "depth_of_field"])
            self.assertEqual(checked["diagnostics"][0]["line"], 2)
            self.assertIn("| paper |", out[4])
            listed = [json.loads(x) for x in out[5].split("\n") if x.startswith('{"jobs"')][0]
            self.assertEqual({job["id"] for job in listed["jobs"]}, {"1", "2"})
            self.assertIn("postchain_http_replies_total", out[5])
            self.assertIn("stopped 143", out[5])
            for picture in ("after.png", "preview.png"):
                data = pathlib.Path(folder, picture).read_bytes()
                self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n", picture)
            self.assertTrue(pathlib.Path(folder, "out/wheels.0002.exr").exists())


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()
