#!/usr/bin/env python3
"""docs/studies/: the figures of both studies agree with those recomputed from the gains of their scenes,
and docs/studies/tables.md has the tables."""
import pathlib
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
DOCS = HERE.parents[2] / "docs"


class Results(unittest.TestCase):
    def test_page_has_the_tables_of_both_studies(self):
        page = set((DOCS / "studies/tables.md").read_text("utf8").splitlines())
        for name in ["ordering.json", "ordering_fxaa.json"]:
            done = subprocess.run([sys.executable, "-B", HERE / "recompute.py", DOCS / "studies" / name, "--table"],
                                  capture_output=True, encoding="utf8", check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            lines = [line for line in done.stdout.splitlines() if line]
            self.assertGreater(len(lines), 30)
            for line in lines:
                self.assertIn(line, page)


if __name__ == "__main__":
    unittest.main()
