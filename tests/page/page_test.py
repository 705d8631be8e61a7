"""The pictures of the report page in headless Chromium: what is on the screen against the formulas of
fixture.cpp.

usage: page_test.py PAGE_FIXTURE"""
import math
import unittest
import urllib.parse

from browser import NO_GL, RIGHT, SHIFT, SOFTWARE_GL, SPACE
from report_page import FRAMES, MAGMA, OnThePage, ZOOM, shown, srgb, truth, variant


class Page(OnThePage):
    """Drawn pixels: these tests run with WebGL2 and with the fallback."""

    painter = None

    def test_draws_with(self):
        self.assertEqual(self.ask("postchain.viewer.painter.name"), self.painter)

    def test_digits_zero_and_space_change_the_picture(self):
        for x, y in ((3, 5), (90, 60), (50, 20)):
            for key, rgb in (("1", variant(0, x, y)), ("3", variant(2, x, y)), ("0", truth(x, y)),
                             (SPACE, variant(2, x, y)), (SPACE, truth(x, y))):
                self.browser.keys(key)
                self.assert_color(self.screen(x, y), shown(rgb))
        self.browser.keys("i")
        self.assert_color(self.screen(10, 10), shown([0.5, 0.5, 0.5]))

    def test_exposure_is_the_same_for_all(self):
        self.browser.keys("]", "]", "]")
        for key, rgb in (("1", variant(0, 40, 30)), ("2", variant(1, 40, 30)),
                         ("0", truth(40, 30))):
            self.browser.keys(key)
            self.assert_color(self.screen(40, 30), shown(rgb, 1.5))
        # The slider: a quarter of a stop for each arrow key.
        self.browser.run("document.getElementById('ev').focus();")
        self.browser.keys(RIGHT, RIGHT)
        self.assertEqual(self.state("ev"), 2)
        self.assert_color(self.screen(40, 30), shown(truth(40, 30), 2))
        self.browser.keys("r")
        self.assert_color(self.screen(40, 30), shown(truth(40, 30)))

    def test_tone_curve(self):
        self.open(f"zoom={ZOOM}&x=48&y=32&tone=srgb&show=2")
        self.assert_color(self.screen(30, 30), srgb(variant(1, 30, 30)))
        # ACES by its formula, 0.6 of Narkowicz' exposure.
        self.open(f"zoom={ZOOM}&x=48&y=32&tone=aces&show=2")
        mapped = [v * 0.6 for v in variant(1, 30, 30)]
        mapped = [(v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14) for v in mapped]
        self.assert_color(self.screen(30, 30), srgb(mapped))

    def test_what_is_no_number_stands_out(self):
        self.browser.keys("2")
        self.assertEqual(self.screen(5, 7), (255, 0, 255))
        self.assert_color(self.screen(6, 7), shown([65504] + variant(1, 6, 7)[1:]))
        self.assert_color(self.screen(7, 7), shown([0] + variant(1, 7, 7)[1:]))

    def test_holding_d_shows_the_error_map(self):
        # Variant 2's map is x / 95: the indices of MAGMA are those of round(255 x / 95).
        self.browser.keys("3", ("down", "d"))
        for x, index in ((0, 0), (24, 64), (95, 255)):
            self.assertEqual(self.screen(x, 40), MAGMA[index])
        self.browser.keys(("up", "d"))
        self.assert_color(self.screen(24, 40), shown(variant(2, 24, 40)))

    def test_flip_is_a_map_of_its_own(self):
        # Variant 2's is (95 - x) / 95.
        self.open(f"zoom={ZOOM}&x=48&y=32&show=3&pin=1&map=flip")
        for x, index in ((95, 0), (71, 64), (0, 255)):
            self.assertEqual(self.screen(x, 40), MAGMA[index])
        self.assertEqual(self.texts("#map option"), ["HDR-FLIP", "FLIP", "relMSE", "SMAPE", "Difference"])

    def test_error_maps_without_a_truth(self):
        """Against the variant's own filter converged, which has the truth's pixels here."""
        self.open(f"zoom={ZOOM}&x=48&y=32&show=2&pin=1&map=relmse")
        expected = self.screen(20, 31)
        self.open(f"zoom={ZOOM}&x=48&y=32&show=2&pin=1&map=relmse", "blind.html")
        self.assertEqual(self.screen(20, 31), expected)
        self.assertEqual(self.texts("#scale")[0].split("\n")[0], "relMSE, against itself converged")
        # The input is not a filter: it is shown as it is.
        self.browser.keys("i")
        self.assert_color(self.screen(10, 10), shown([0.5, 0.5, 0.5]))
        self.assertIn("no relMSE map of this picture", self.texts("#shown")[0])

    def test_error_maps_from_pixels(self):
        """Scales: SMAPE 0..2, relMSE 1e-4..10 and the difference 1e-3..10 logarithmic."""
        i, r = variant(1, 20, 31), truth(20, 31)
        values = {
            "smape": sum(2 * abs(a - b) / (abs(a) + abs(b) + 0.02) for a, b in zip(i, r)) / 3 / 2,
            "relmse": math.log10(sum((a - b) ** 2 / (abs(b) + 0.01) ** 2
                                     for a, b in zip(i, r)) / 3 / 1e-4) / 5,
            "difference": math.log10(max(abs(a - b) for a, b in zip(i, r)) / 1e-3) / 4,
        }
        for key, t in values.items():
            self.open(f"zoom={ZOOM}&x=48&y=32&show=2&pin=1&map={key}")
            at = round(255 * t)
            near = self.ask("args.slice(0, 3).map((i) => postchain.magma(i))", at - 1, at, at + 1)
            self.assertIn(list(self.screen(20, 31)), near, key)
        # The truth has no map: it is shown as it is.
        self.browser.keys("0")
        self.assert_color(self.screen(20, 31), shown(truth(20, 31)))

    def test_the_wheel_zooms_where_it_points(self):
        self.browser.keys("1")
        x, y = self.place(20, 10)
        self.browser.wheel(x, y, -240)
        self.settle()
        # Four steps from 6: 8, 12, 16, 24. What lay under the pointer still does: the middle moves
        # from 48 to 20.5 + 27.5 * 6 / 24 (the pointer's place is rounded to whole CSS pixels).
        self.assertEqual(self.state("zoom"), 24)
        center = (20.5 + 27.5 / 4, 10.5 + 21.5 / 4)
        for name, value in zip("xy", center):
            self.assertAlmostEqual(self.state(name), value, delta=0.2)
        self.browser.mouse((2, 2))
        center = self.states("x", "y")
        self.assert_color(self.screen(23, 12, center=center, zoom=24), shown(variant(0, 23, 12)))
        # The grid: a line where pixel 23 begins, lighter or darker by 22 %.
        inside = self.place(23, 12, center=center, zoom=24)
        edges = [self.browser.pixel(math.floor(inside[0] - 12) + dx, math.floor(inside[1]))
                 for dx in (-1, 0, 1)]
        plain = shown(variant(0, 23, 12))
        self.assertGreater(max(abs(a - b) for edge in edges for a, b in zip(edge, plain)), 10)
        # Dragging moves the picture with the hand.
        self.browser.mouse((x, y), "down", (x + 30, y + 12), (x + 48, y + 24), "up", (2, 2))
        self.assertAlmostEqual(self.state("x"), center[0] - 2, delta=0.05)
        self.assertAlmostEqual(self.state("y"), center[1] - 1, delta=0.05)
        self.browser.keys("f")
        self.assertEqual(self.state("zoom"), 0)

    def test_wipe(self):
        self.browser.keys("1", "2", "w")
        self.settle()
        self.assert_color(self.screen(40, 30), shown(variant(0, 40, 30)))
        self.assert_color(self.screen(56, 30), shown(variant(1, 56, 30)))
        self.assertIn("samples=5 \u2502 2", self.texts("#shown")[0])
        # The line follows the mouse and the keys, and is in the address.
        left, top, width, height = self.box_of("#wipe")
        x, y = left + width / 2, top + height / 2
        self.browser.mouse((x, y), "down", (x + 25 * ZOOM, y), "up")
        self.assert_color(self.screen(56, 30), shown(variant(0, 56, 30)))
        self.browser.run("document.getElementById('wipe').focus();")
        before = self.state("wipe")
        self.browser.keys(RIGHT)
        self.assertAlmostEqual(self.state("wipe"), before + 0.02)
        self.browser.wait("location.hash.includes('wipe=0.')")
        self.browser.keys("w")
        self.assert_color(self.screen(40, 30), shown(variant(1, 40, 30)))
        self.assertTrue(self.ask("document.getElementById('wipe').hidden"))


class WithWebGl(Page, unittest.TestCase):
    flags, painter = SOFTWARE_GL, "WebGL2"

    def test_a_click_in_the_list_leaves_space_to_the_flip(self):
        x, y = self.box_of("#sources button", 2)[:2]
        self.browser.mouse((x + 40, y + 10), "down", "up")
        self.assert_color(self.screen(50, 20), shown(variant(1, 50, 20)))
        self.browser.keys(SPACE)
        self.assert_color(self.screen(50, 20), shown(variant(0, 50, 20)))

    def test_a_click_on_the_pareto_plot_shows_the_picture(self):
        self.browser.run("document.querySelector('.pareto').scrollIntoView();")
        left, top = self.box_of(".pareto .u-over")[:2]
        points = self.browser.run(
            "const { plot, points } = postchain.pareto();"
            "return points.map((p) => [p.name, plot.valToPos(p.time, 'x'), plot.valToPos(p.error, 'y')]);")
        self.assertEqual([p[0] for p in points], ["samples=5", "samples=10", "samples=20"])
        self.assertGreater(points[1][2], points[2][2])  # 0.1 lies below 0.2
        for v in (2, 1):
            self.browser.mouse((left + points[v][1] + 3, top + points[v][2] - 3), "down", "up")
            self.assertEqual(self.state("show"), str(v + 1))
            self.browser.run("scrollTo(0, 0);")
            self.assert_color(self.screen(60, 40), shown(variant(v, 60, 40)))
            self.browser.run("document.querySelector('.pareto').scrollIntoView();")
        front = self.browser.run("const { points, front } = postchain.pareto();"
                                 "return front.map((i) => points[i].name);")
        self.assertEqual(front, ["samples=5", "samples=10"])

    def test_frames(self):
        self.browser.keys("2", ".")
        self.assertEqual(self.state("frame"), 1002)
        self.assert_color(self.screen(40, 30), shown(variant(1, 40, 30, 1002)))
        self.browser.keys(",")
        self.assert_color(self.screen(40, 30), shown(variant(1, 40, 30)))
        seen = self.browser.run(
            "const seen = new Set(); postchain.state.watch(['frame'], () =>"
            "  seen.add(postchain.state.get('frame')));"
            "document.getElementById('play').click();"
            "while (seen.size < 2) await new Promise((f) => setTimeout(f, 20));"
            "document.getElementById('play').click(); return [...seen].sort();")
        self.assertEqual(seen, FRAMES)

    def test_values_under_the_cursor(self):
        self.browser.keys("1")
        self.settle()
        self.browser.wait("document.querySelectorAll('#sources .row').length === 6")
        # All pictures are decoded in the background.
        self.browser.wait("postchain.store.ready('error', 2, 1001, 'hdr_flip')")
        self.browser.mouse(self.place(47, 15))
        rows = self.browser.run(
            "return [...document.querySelectorAll('#sources .row')].map((row) => [row.querySelector("
            "'.values').textContent.trim().split(/ +/), row.querySelector('.at')?.textContent]);")
        self.assertEqual(rows[0][0], ["0.495", "0.484", "0.250"])  # 47.5/96, 2 * 15.5/64, 1/4
        for v in range(3):
            for text, value in zip(rows[v + 1][0], variant(v, 47, 15)):
                self.assertAlmostEqual(float(text), value, delta=0.0006 * max(1, value))
            self.assertAlmostEqual(float(rows[v + 1][1]), 47 / 95 * (v + 1) / 3, delta=0.003)
        self.assertEqual(rows[5][0], ["0.500"] * 3)

    def test_the_cursor_of_the_keyboard_is_read_out(self):
        self.browser.wait("postchain.store.ready('error', 2, 1001, 'hdr_flip')")
        self.browser.run("document.getElementById('canvas').focus();")
        self.browser.keys(RIGHT)
        text, = self.texts("#live", "textContent")
        self.assertTrue(text.startswith("49, 32: Truth 0.516 1.02 0.250; samples=5 0.516"), text)

    def test_the_address_holds_the_state(self):
        self.browser.keys("3", "]", "e", ".", "m", "m")
        self.browser.wait("location.hash.includes('map=')")
        address = self.ask("location.hash.slice(1)")
        self.assertEqual(dict(urllib.parse.parse_qsl(address)), {
            "show": "3", "last": "1", "frame": "1002", "ev": "0.5", "map": "relmse", "pin": "1",
            "zoom": "6", "x": "48", "y": "32"})
        before = self.screen(70, 20)
        self.open(address)
        self.assertEqual(self.screen(70, 20), before)
        self.browser.run("location.hash = 'show=truth&zoom=6&x=48&y=32';")
        self.browser.wait("postchain.state.get('show') === 'truth'")
        self.assert_color(self.screen(70, 20), shown(truth(70, 20)))
        # Nonsense is left out.
        self.open("show=99&ev=x&zoom=-1&crops=1,2,3&frame=7&metric=constructor")
        self.assertEqual(self.states("show", "ev", "zoom", "frame", "metric"), ["1", 0, 0, 1001, "hdr_flip"])

    def test_chosen_and_found_crops(self):
        self.browser.keys("2")
        self.browser.keys(("down", SHIFT))
        self.browser.mouse(self.place(10, 10), "down", self.place(29, 29), "up")
        self.browser.keys(("up", SHIFT))
        self.assertEqual(self.state("crops"),
                         [{"frame": 1001, "x": 10, "y": 10, "width": 20, "height": 20}])
        self.browser.run("document.querySelector('[aria-label=Crops]').scrollIntoView();")
        # Truth, three variants, input; for the chosen and for the found region.
        self.browser.wait("document.querySelectorAll('.tile').length === 10")
        self.browser.wait("[...document.querySelectorAll('.tile canvas')].every((c) =>"
                          "c.getContext('2d').getImageData(75, 75, 1, 1).data[3])")
        # The variant by its short name.
        self.assertIn("samples=10: mean HDR-FLIP 0.2", self.texts(".crop-row .why")[1].split("\n"))
        # 150 CSS pixels over 20 of the picture: the middle of the tile is pixel 20 (7.5 wide).
        x, y = self.box_of(".tile canvas", 2)[:2]
        at = (x + 10.5 * 7.5, y + 10.5 * 7.5)
        self.assert_color(self.browser.pixel(*map(math.floor, at)), shown(variant(1, 20, 20)))
        self.browser.mouse(at, "down", "up")
        self.assertEqual(self.states("show", "x", "y"), ["2", 20, 20])

    def test_one_row_over_time(self):
        """Row 40 from pixel 16 on; a line of 8 CSS pixels for each frame."""
        self.open("show=1", "ab.html")
        self.browser.run("document.querySelector('[aria-label=\"One row over time\"]').scrollIntoView();")
        self.assertEqual(len(self.texts(".slices span")), 3)
        self.browser.wait("[...document.querySelectorAll('.slices canvas')].every((c) =>"
                          "c.getContext('2d').getImageData(63, 1, 1, 1).data[3])")
        for index, of in enumerate((truth, lambda x, y: variant(0, x, y), lambda x, y: variant(1, x, y))):
            left, top, width, height = self.box_of(".slices canvas", index)[:4]
            self.assertEqual(height, 16)
            for line, dimmer in ((0, 1), (1, 0.5)):
                rgb = of(16 + 50, 40)
                at = (left + width * 50.5 / 64, top + 8 * line + 4)
                self.assert_color(self.browser.pixel(*map(math.floor, at)),
                                  shown([rgb[0] * dimmer, *rgb[1:]]))

    def test_asks_for_nothing(self):
        self.browser.keys("0", "3", ".")
        self.settle()
        self.assertEqual(self.ask("performance.getEntriesByType('resource').map((e) => e.name)"), [])

    def test_pictures_beside_the_page(self):
        self.open(f"zoom={ZOOM}&x=48&y=32&show=3", "light.html")
        self.assert_color(self.screen(50, 20), shown(variant(2, 50, 20)))
        self.browser.keys("0", ".")
        self.assert_color(self.screen(50, 20), shown(truth(50, 20, 1002)))


class WithoutWebGl(Page, unittest.TestCase):
    flags, painter = NO_GL, "2D canvas"


if __name__ == "__main__":
    unittest.main()
