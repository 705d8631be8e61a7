"""dist/page.html against its sources, where there may be no node: the hash in its header, its size,
and that it asks for nothing from a network."""
import hashlib
import json
import pathlib
import re
import sys
import unittest

PAGE = pathlib.Path(__file__).resolve().parents[2] / "tools/measure/report/page"
MAX_BYTES = 300_000


class Dist(unittest.TestCase):
    def setUp(self):
        self.text = (PAGE / "dist/page.html").read_text(encoding="utf8")

    def test_is_made_from_these_sources(self):
        # As build.mjs: "path\0text\0" of each, in order of their names.
        paths = [f"src/{p.name}" for p in sorted((PAGE / "src").iterdir())]
        paths += ["build.mjs", "package-lock.json", "package.json"]
        digest = hashlib.sha256()
        for path in paths:
            digest.update(path.encode() + b"\0" + (PAGE / path).read_bytes() + b"\0")
        self.assertIn(f"\nsources {digest.hexdigest()}\n", self.text,
                      "npm run build in tools/measure/report/page")

    def test_is_small(self):
        self.assertLess(len(self.text.encode()), MAX_BYTES)

    def test_loads_nothing(self):
        self.assertNotRegex(self.text, r"<(link|img|iframe|object|embed)\b")
        self.assertNotRegex(self.text, r"<script[^>]*\bsrc=")
        self.assertNotRegex(self.text, r"@import|url\(")
        self.assertNotRegex(self.text, r"\b(fetch|XMLHttpRequest|WebSocket|EventSource)\b")
        hosts = set(re.findall(r"https?://([\w.]+)", self.text))
        self.assertLessEqual(hosts, {"www.w3.org"})  # the name space of SVG
        self.assertIn("default-src 'none'", self.text)

    def test_keeps_the_license_of_what_it_contains(self):
        lock = json.loads((PAGE / "package-lock.json").read_text())
        version = lock["packages"]["node_modules/uplot"]["version"]
        self.assertIn(f"Contains uPlot {version}:\nThe MIT License", self.text)
        self.assertIn("Copyright (c) 2022 Leon Sorokin", self.text)

    def test_the_lock_names_no_host(self):
        lock = json.loads((PAGE / "package-lock.json").read_text())
        for name, package in lock["packages"].items():
            self.assertNotIn("resolved", package, name)
            if name:
                self.assertIn("integrity", package, name)


if __name__ == "__main__":
    sys.exit(unittest.main())
