"""The pages of a study and of the stability matrix in headless Chromium, from data written here.

usage: documents_test.py CMAKE"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

from browser import Browser

SOURCES = pathlib.Path(__file__).resolve().parents[2] / "tools/page"
HOSTILE = "<img hostile src onerror=alert(1)> & \"x\" </script> \x1b[31m\u202egpj\u2066"
SHOWN = HOSTILE.replace("\x1b", "\\x1b").replace("\u202e", "\\u{202e}").replace("\u2066", "\\u{2066}")
PNG = ("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5E"
       "rkJggg==")

STUDY = {
    "kind": "ab", "title": f"Which {HOSTILE}", "version": "1.2",
    "revisions": ["1234abcd"], "verdict": [f"one {HOSTILE}"],
    "variants": [{"name": "a", "chain": "passes: []"}, {"name": "b", "chain": HOSTILE}],
    "pairs": [{"a": "a", "b": "b", "equal": "time", "time_ratio": 1.04}],
    "scenes": [
        {"name": "one", "family": "f", "truth": HOSTILE, "frames": [1, 2, 3, 7], "width": 32,
         "height": 18, "reports": ["scenes/one/a_vs_b/index.html"], "failure": None},
        {"name": "two", "family": "f", "truth": "t", "frames": [1], "width": 32, "height": 18,
         "reports": ["scenes/two/a_vs_b/index.html"], "failure": None},
        {"name": "gone", "family": "g", "truth": "", "frames": [], "width": 0, "height": 0,
         "reports": [], "failure": f"no {HOSTILE}"}],
    "tables": [{
        "metric": "hdr_flip", "help": "help", "better": "lower",
        "scenes": [{"name": "one", "family": "f", "means": [0.5, 0.25], "gains": [0.25]},
                   {"name": "two", "family": "f", "means": [0.25, 0.25], "gains": [0]}],
        "families": [{"name": "f", "scenes": 2, "means": [0.375, 0.25], "gains": [0.125]}],
        "means": [0.375, 0.25], "best": "b",
        "pairs": [{"a": "a", "b": "b", "gain": 0.125, "interval": [0.0625, 0.1875], "families": 1,
                   "families_nearer": 1, "finding": "b_nearer", "margin": 0.005,
                   "probability_holm": 0.031}]}, {
        "metric": "psnr", "help": "help", "better": "higher", "scenes": [], "families": [],
        "means": [20, 30], "best": "b",
        "pairs": [{"a": "a", "b": "b", "gain": None, "interval": None, "families": 0,
                   "families_nearer": 0, "finding": "too_few_families", "margin": None,
                   "probability_holm": None}]}],
    "notes": [HOSTILE]}


def entry(check, cell):
    return {"cell": cell, "check": check, "value": "2.5", "bound": "1", "note": f"at {HOSTILE}",
            "place": "8 x 4 pixels", "pictures": [{"title": "error", "scale": "magma, 0 to 2",
                                                   "png": PNG, "width": 8, "height": 4}]}


STRESS = {
    "version": "1.2", "renderer": HOSTILE, "command": f"postchain stress --only '{HOSTILE}'",
    "cells": 2, "checked": 3, "ok": 1, "limited": 1, "pictured_at_most": 400,
    "checks": [{"name": "mirror", "help": "turned"}, {"name": "range", "help": HOSTILE}],
    "rows": [
        {"subject": HOSTILE, "row": "speed", "checks": {
            "range": {"cell": HOSTILE, "value": "2.5", "bound": "1", "verdict": "FAIL", "entry": 0},
            "mirror": {"cell": "x", "value": "2.5", "bound": "1", "verdict": "limit", "entry": 0}}},
        {"subject": "other", "row": "size", "checks": {
            "range": {"cell": "y", "value": "0.5", "bound": "1", "verdict": "ok"}}}],
    "failures": [entry("range", HOSTILE)],
    "limits": [{**entry("mirror", "x"),
                "limit": {"check": "mirror", "bound": "10", "reason": "known", "times": 3}}]}


class Documents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.browser = Browser([])
        cls.browser.size(1400, 900)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def open(self, name, data):
        path = self.folder / f"{name}.html"
        subprocess.run([CMAKE, f"-DROOT={SOURCES}", f"-DPAGE={name}/page.html", f"-DOUTPUT={path}",
                        "-P", SOURCES / "bundle.cmake"], check=True)
        text = json.dumps(data).replace("<", "\\u003c")  # io::json_text() too escapes marks
        path.write_text(path.read_text(encoding="utf8").replace(
            "<!--DATA-->", f'<script type="application/json" id="data">{text}</script>'),
            encoding="utf8")
        self.browser.open(f"file://{path}")
        self.browser.wait("document.querySelector('#main h2')")
        self.assertFalse(self.browser.run("return !!document.querySelector('[hostile]');"))
        self.assertEqual(self.browser.errors(), [])
        # Tables that scroll have a name and are reached by the keyboard.
        for box in self.shown(".scroll", "tabIndex", "role", "ariaLabel"):
            self.assertEqual(box[:2], ["0", "region"])
            self.assertTrue(box[2])
        return self.browser.run("return document.body.innerText;")

    def shown(self, selector, *keys):
        """Properties or attributes of all elements."""
        return self.browser.run(
            "return [...document.querySelectorAll(args[0])].map((e) => args.slice(1, -1).map("
            "(key) => e.getAttribute(key) ?? e[key]));", selector, *keys)

    def texts(self, selector):
        return [text for text, in self.shown(selector, "textContent")]

    def test_study(self):
        text = self.open("study", STUDY)
        self.assertEqual(self.texts("h1"), [f"Which {SHOWN}"])
        self.assertEqual(self.browser.run("return document.title;"), f"Which {SHOWN}")
        self.assertEqual(self.texts("h2"), ["Mean over families", "Gains of HDR-FLIP by family",
                                            "Scenes", "Chains", "Notes"])
        self.assertIn("2 scenes measured, 1 failed, postchain 1.2, commit 1234abcd. report.json, report.csv, "
                      "report.md", text)
        self.assertIn(f"Failed: gone: no {SHOWN}", text)
        self.assertIn("1-3, 7", text)
        self.assertEqual(self.texts("b:has(.count)"), ["0.1250 (0.0625 to 0.188), 1 of 1"])
        self.assertEqual(self.texts("small.finding"), ["closer, p 0.031"])
        self.assertIn("time 1.0 : 1", text)
        # The nearest of each row, by each metric's own direction; of equal ones none.
        self.assertEqual(self.texts("td.best"), ["0.2500", "30.00", "0.2500", "0.2500", "0.2500",
                                                 "30.00"])
        self.assertEqual(self.shown(".gains", "aria-label")[0], ["gain of b over a"])
        # A gain of 0.125 on an axis of 0.1875 in 220 pixels.
        self.assertEqual([round(float(x)) for x, in self.shown(".gains circle", "cx")], [547, 547])
        self.assertEqual(self.shown("td a", "href"),
                         [["scenes/one/a_vs_b/index.html"], ["scenes/two/a_vs_b/index.html"]])
        self.assertIn("mean of f, 2 scenes", text)

    def test_stress(self):
        text = self.open("stress", STRESS)
        self.assertEqual(self.texts("h1"), ["Stability of postchain 1.2"])
        self.assertIn("2 cells, 3 checks: 1 ok, 1 known limits, 1 failed", text)
        self.assertEqual(self.texts(".matrix a[href='#fail-1']"), ["FAIL 2.5"])
        self.assertEqual(self.texts(".matrix a[href='#limit-1']"), ["limit 2.5"])
        self.assertEqual(self.texts("th[scope=rowgroup]"), [SHOWN, "other"])
        self.assertIn("does not apply", self.texts("td.none")[0])
        self.assertIn("mirror 2.5, bound 10 in place of 1: x", text)
        self.assertIn("known. Met 3 times. Here: at ", text)
        for name in ("fail-1", "limit-1", "check-mirror", "table", "main"):
            self.assertEqual(len(self.shown(f"#{name}")), 1)
        # Each picture has a text of its own and is 40 times as large as its pixels.
        self.assertEqual(self.shown("img[src^='data:image/png;base64,']", "width", "height", "alt"), [
            ["320", "160", f"error of {SHOWN}, range; magma, 0 to 2"],
            ["320", "160", "error of x, mirror; magma, 0 to 2"]])

    def test_stress_without_failures(self):
        text = self.open("stress", {**STRESS, "failures": [], "limits": [],
                                    "rows": STRESS["rows"][1:]})
        self.assertIn("Failures (0)\nNone.", text.replace("\n\n", "\n"))
        self.assertIn("None was met.", text)


if __name__ == "__main__":
    CMAKE = sys.argv.pop(1)
    unittest.main()
