"""The panels of the report page in headless Chromium: tables, texts, focus and layout.

usage: panels_test.py PAGE_FIXTURE"""
import unittest

from browser import SOFTWARE_GL
from report_page import MAGMA, OnThePage, ZOOM, shown, truth, variant


class Panels(OnThePage, unittest.TestCase):
    flags = SOFTWARE_GL

    def text(self, selector):
        return self.texts(selector)[0]

    def is_seen(self, selector):
        return self.ask("document.querySelector(args[0]).checkVisibility()", selector)

    def rows(self, panel):
        """Cells of the rows that are seen."""
        return self.ask("[...document.querySelectorAll(`[aria-label='${args[0]}'] tbody tr`)]"
                        ".filter((row) => row.checkVisibility())"
                        ".map((row) => [...row.children].map((cell) => cell.innerText))", panel)

    def test_what_was_left_out(self):
        self.assertEqual(self.rows("Left out of the plans"), [
            ["all", "input.motion_back", "unused_plane", "no step reads it", "1001", "512\u2009B",
             "0", "0"],
            ["samples=5", "fxaa", "off_by_rule",
             "largest step 0.31 px <= 0.5 px (first frame; 1 more like it)", "1001, 1002",
             "4.61\u2009kB", "2", "10.4\u2009k"],
            ["", "motion_blur.still blocks", "on_device", "nothing moves there", "1002", "\u2013", "\u2013",
             "\u2013"]])

    def test_without_a_truth_it_says_so(self):
        self.open(name="blind.html")
        self.assertIn("its own filter converged, and there is no model error: none was given.",
                      self.text("#verdict"))
        self.assertEqual(self.texts("[aria-label='Where the error comes from'] th")[:5],
                         ["Variant", "", "precision", "sampling", "seeds"])

    def test_opens_on_what_won(self):
        first = "Shown first: motion_blur.samples=10 has the lowest mean HDR-FLIP."
        # ab: the verdict says what won. undecided: nothing has won, so B, beside A.
        for name, show, words in (("scored", ["2", "1"], first), ("ab", ["1", "2"], None),
                                  ("undecided", ["2", "1"], None)):
            self.open(name=f"{name}.html")
            self.assertEqual(self.states("show", "last"), show, name)
            self.assertEqual("Shown first" in self.text("#verdict"), words is not None, name)
            self.assertIn(words or "", self.text("#verdict"))
        # A link still shows what it says.
        self.open("show=input", name="scored.html")
        self.assertEqual(self.state("show"), "input")

    def test_the_input_has_figures_and_a_map(self):
        self.open(f"zoom={ZOOM}&x=48&y=32&show=input&pin=1&map=hdr_flip", "scored.html")
        for x, index in ((0, 0), (24, 64), (95, 255)):
            self.assertEqual(self.screen(x, 40), MAGMA[index])
        # The truth has none, though it has no variant either.
        self.browser.keys("0")
        self.assert_color(self.screen(24, 40), shown(truth(24, 40)))
        figures = self.browser.run(
            "return [...document.querySelectorAll('#sources .row')].map((row) => "
            "[row.querySelector('.name').innerText, row.querySelector('.figure').innerText,"
            " row.querySelector('.figure').classList.contains('worse')]);")
        self.assertEqual(figures, [["Truth", "", False], ["samples=5", "0.400", True],
                                   ["samples=10", "0.100", False], ["samples=20", "0.200", False],
                                   ["samples=40", "failed", False], ["Input", "0.300", False]])
        row = self.rows("Variants")[-1]
        self.assertEqual(row, ["input", "no filter", "0.300", "0.500", "3.00"])
        self.assertEqual(self.texts("[aria-label=Variants] .worse"), ["0.400"])

    def test_warnings_are_seen_and_are_text(self):
        self.open(name="scored.html")
        self.assertEqual(self.text("#warnings"),
                         "1 of 4 variants is <no better> than doing nothing")
        self.assertTrue(self.is_seen("#warnings"))
        self.assertIn("standard deviation 0.013 of the displayed luma; a picture without any "
                      "error would have MSE 0.00200", self.text("[aria-label=Conditions]"))
        self.open()
        self.assertFalse(self.is_seen("#warnings"))

    def test_which_way_is_better_stands_there(self):
        self.open(name="ab.html")
        self.assertEqual(self.text("#way"), "lower is better")
        self.browser.run("postchain.state.set({ metric: 'psnr' });")
        self.assertEqual(self.text("#way"), "higher is better")
        self.assertEqual(self.rows("A against B")[0][0].split("\n"),
                         ["HDR-FLIP", "lower is better"])
        self.assertEqual(self.texts("[aria-label=Variants] th small"),
                         ["lower is better", "lower is better", "higher is better"])
        self.open(name="undecided.html")
        self.assertEqual(self.text("#way"), "lower is more alike")
        self.assertEqual(self.texts("[aria-label=Variants] th small"),
                         ["lower is more alike", "lower is more alike", "higher is more alike"])
        self.open(name="ab.html")
        words = self.text(".explain")
        self.assertIn("t-interval, over frames: ", words)
        self.assertIn("tile interval (bootstrap), within these frames: each frame is cut into "
                      "tiles of 32 pixels", words)

    def test_relmse_is_said_to_mislead_and_is_never_marked(self):
        for name, times in (("ab", 0), ("relative", 2)):  # beside both tables
            self.open(name=f"{name}.html")
            text, = self.texts("body", "textContent")
            self.assertEqual(text.count("decide the mean. It is never marked as worse"), times, name)
        self.assertEqual(self.rows("Variants")[-1][2:], ["0.300", "0.125", "3.00"])
        # Worse than the input, as HDR-FLIP is, by its number alone.
        self.assertEqual(self.texts("[aria-label=Variants] .worse"), ["0.400"])

    def test_rows_without_a_finding_are_folded(self):
        self.open(name="ab.html")
        rows = self.rows("A against B")
        self.assertEqual([row[0].split("\n")[0] for row in rows],
                         ["HDR-FLIP", "2 metrics without a measurable difference"])
        self.assertEqual(rows[0][1:5], ["0.400", "0.100", "0.300", "+0.188"])
        for seen in (4, 2):
            self.browser.run("document.querySelector('.fold summary').click();")
            self.browser.wait("[...document.querySelectorAll('.compare tbody tr')]"
                              ".filter((row) => row.checkVisibility()).length === args[0]", seen)
        # Too few frames to find anything: what differs at all is shown.
        self.open(name="undecided.html")
        self.assertEqual([row[0].split("\n")[0] for row in self.rows("A against B")],
                         ["HDR-FLIP", "PSNR", "1 metric without a measurable difference"])

    def test_a_failed_variant_says_why(self):
        self.browser.keys("4")
        self.settle()
        self.assertTrue(self.is_seen("#missing"))
        self.assertEqual(self.text("#missing"), "samples=40 failed: out of GL memory: 1.2 GiB asked for")
        self.browser.keys("1")
        self.assert_color(self.screen(50, 50), shown(variant(0, 50, 50)))

    def test_names_and_focus(self):
        nameless = self.browser.run("""
            return [...document.querySelectorAll("button, select, input, canvas[tabindex], [role=img]")]
                .filter((e) => !(e.getAttribute("aria-label") || e.labels?.length ||
                    /\\w/.test(e.textContent))).map((e) => e.outerHTML.slice(0, 80));""")
        self.assertEqual(nameless, [])
        ids = self.texts("[id]", "id")
        self.assertEqual(len(ids), len(set(ids)))
        # Tab goes on from the last place that had the focus or was clicked: put it at the top.
        self.browser.run("document.body.tabIndex = -1; document.body.focus();"
                         "document.body.removeAttribute('tabindex');")
        self.browser.keys("\ue004")
        self.assertEqual(self.ask("[document.activeElement.id, getComputedStyle(document.activeElement)"
                                  ".outlineStyle]"), ["skip", "solid"])
        self.browser.keys("\ue007", "2")
        self.settle()
        self.assertEqual(self.ask("document.activeElement.id"), "canvas")
        self.assertTrue(self.texts("#canvas", "ariaLabel")[0].startswith("samples=10"))
        self.browser.keys("?")
        self.assertTrue(self.ask("document.getElementById('help').open"))

    def test_light_and_dark(self):
        light = self.browser.pixel(20, 890)
        self.browser.scheme("dark")
        dark = self.browser.pixel(20, 890)
        self.assertGreater(min(light), 200)
        self.assertLess(max(dark), 60)

    def test_nothing_is_wider_than_the_window(self):
        for size in ((1440, 900), (900, 700), (600, 900)):
            self.browser.size(*size)
            for name in ("index.html", "ab.html"):
                self.open(name=name)
                self.assertLessEqual(self.ask("document.documentElement.scrollWidth"), size[0])
        self.browser.size(1440, 900)

    def test_the_text_of_the_report_is_text(self):
        self.assertEqual(self.texts("h1"), ['A <test> & its "report"'])
        self.assertIn("# </script> & <b>", self.texts("pre", "textContent")[0])


if __name__ == "__main__":
    unittest.main()
