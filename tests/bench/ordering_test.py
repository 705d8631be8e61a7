"""The ordering study's statistics, tables and page against numbers calculated by hand."""
import json
import math
import pathlib
import tempfile
import unittest

import intervals
import ordering_gains
import ordering_page
import ordering_results
import ordering_study
import ordering_tables

FLIP = ordering_study.METRICS[0]
PSNR = ordering_study.METRICS[1]
QUESTION = ordering_study.QUESTIONS[0]


def errors(flip, psnr=30.0, tde=None):
    return {"psnr": psnr, "hdr_flip": flip, "ssim": 0.9, "tde": tde}


def results_of(folder, scenes):
    """{scene: [(HDR-FLIP of the first chain, of the second)]}, a pair for each frame from 1."""
    results = ordering_results.Results(pathlib.Path(folder) / "results.json")
    for scene, pairs in scenes.items():
        for k, chain in enumerate((QUESTION.first, QUESTION.second)):
            row = results.row(scene, "sharp", chain, "passes", "1")
            results.add(row, {frame: errors(pair[k]) for frame, pair in enumerate(pairs, 1)})
    return results


class Intervals(unittest.TestCase):
    def test_t_quantiles_of_printed_tables(self):
        for freedom, expected in ((1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (8, 2.306),
                                  (9, 2.262), (11, 2.201), (30, 2.042)):
            self.assertAlmostEqual(intervals.t_quantile(0.975, freedom), expected, 3)

    def test_interval_of_1_2_3_4(self):
        # Mean 2.5, s^2 = 5/3, half width 3.18245 sqrt(5/3)/2 = 2.05426.
        low, high = intervals.t_interval([1, 2, 3, 4])
        self.assertAlmostEqual(low, 0.44574, 4)
        self.assertAlmostEqual(high, 4.55426, 4)
        self.assertIsNone(intervals.t_interval([1]))

    def test_the_last_batch_takes_what_is_over(self):
        self.assertEqual(intervals.batches([1, 2, 3, 4, 5, 6, 10], 3), [2, 6.25])
        self.assertEqual(intervals.batches([1, 2], 3), [1.5])

    def test_autocorrelation(self):
        # Deviations -1, 0, 1: products 0 + 0 over 2. Deviations -1, 1, -1, 1: -3 over 4.
        self.assertAlmostEqual(intervals.autocorrelation([1, 2, 3]), 0)
        self.assertAlmostEqual(intervals.autocorrelation([0, 2, 0, 2]), -0.75)
        self.assertIsNone(intervals.autocorrelation([1, 1]))

    def test_rank_correlation(self):
        # Ranks 1 2.5 2.5 4 and 1 2 3 4: 4.5 / sqrt(4.5 * 5).
        self.assertAlmostEqual(intervals.rank_correlation([0, 7, 7, 9], [1, 2, 3, 4]), 0.948683, 6)
        self.assertAlmostEqual(intervals.rank_correlation([1, 2, 3], [9, 5, 0]), -1)

    def test_signs(self):
        # 1 of 5: 2 (1 + 5)/32; zeros do not count.
        self.assertEqual(intervals.sign_test([1, -1, -2, 0, -3, -4]), (1, 5, 0.375))
        self.assertEqual(intervals.sign_test([1, -1]), (1, 2, 1.0))


class Gains(unittest.TestCase):
    def test_a_scene_is_the_mean_of_its_frames_and_a_family_that_of_its_scenes(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {
                "wheels": [(0.20, 0.19), (0.20, 0.17)],              # +0.02
                "corridor": [(0.10, 0.11)],                          # -0.01
                "generated_poles": [(0.20, 0.16)],                   # +0.04
                "generated_poles_far": [(0.20, 0.14)],               # +0.06: the family +0.05
                "generated_still": [(0.20, 0.00)]})                  # does not count
            found = ordering_gains.gain(results, QUESTION, FLIP)
        self.assertEqual(sorted(found.families), ["corridor", "generated_poles", "wheels"])
        self.assertAlmostEqual(found.families["generated_poles"], 0.05)
        self.assertAlmostEqual(found.mean, 0.02)
        # s = 0.03, half width 4.30265 0.03/sqrt(3) = 0.074525.
        self.assertAlmostEqual(found.interval[0], 0.02 - 0.074525, 5)
        self.assertEqual((found.positive, found.counted, found.chance), (2, 3, 1.0))
        self.assertFalse(ordering_gains.decided(found))
        wheels = next(one for one in found.scenes if one.scene == "wheels")
        # Of 0.01 and 0.03: s/sqrt(2) = 0.01, half width 0.127062.
        self.assertAlmostEqual(wheels.interval[1], 0.02 + 0.127062, 5)
        self.assertEqual((wheels.n, wheels.batched), (2, False))

    def test_nine_frames_are_three_batches(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {"wheels": [(0.2, 0.2 - gain) for gain in
                                                     (0, 1e-2, 2e-2, 1e-2, 3e-2, 2e-2, 3e-2, 3e-2,
                                                      3e-2)]})
            one = ordering_gains.scene_gain(results, QUESTION, FLIP, "wheels")
        # Batches 0.01, 0.02, 0.03: half width 4.30265 0.01/sqrt(3).
        self.assertTrue(one.batched)
        self.assertAlmostEqual(one.interval[0], 0.02 - 0.024841, 5)

    def test_more_is_better_in_psnr_and_only_common_frames_count(self):
        first = {1: errors(0, 30), 2: errors(0, 31), 3: errors(0, 0)}
        second = {2: errors(0, 33), 1: errors(0, 29), 4: errors(0, 99)}
        self.assertEqual(ordering_gains.frame_gains(first, second, PSNR), [-1, 2])
        tde = ordering_study.METRICS[3]
        self.assertEqual(ordering_gains.frame_gains(
            {1: errors(0), 2: errors(0, tde=0.5)}, {1: errors(0), 2: errors(0, tde=0.25)}, tde),
            [0.25])


class Results(unittest.TestCase):
    def test_are_kept_and_another_text_or_version_is_measured_again(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {"wheels": [(0.2, 0.1)]})
            again = ordering_results.Results(results.path)
            self.assertEqual(again.frames("wheels", "sharp", QUESTION.first), {1: errors(0.2)})
            same = again.row("wheels", "sharp", QUESTION.first, "passes", "1")
            self.assertEqual(list(same["frames"]), ["1"])
            other = again.row("wheels", "sharp", QUESTION.first, "passes", "2")
            self.assertEqual(other["frames"], {})
            other = again.row("wheels", "sharp", QUESTION.second, "other passes", "1")
            self.assertEqual(other["frames"], {})
            again.save()
            self.assertEqual(json.loads(results.path.read_text())["errors"], [])


class Study(unittest.TestCase):
    def test_a_chain_is_its_name(self):
        one = ordering_study.chain("ours mb dof", mb="carry_coc: true")
        self.assertEqual(one.passes, "motion_blur: {mode: inverse_warp, carry_coc: true} ; "
                                     "depth_of_field: {method: inverse_warp}")
        self.assertEqual(one.name, "ours mb dof carry_coc")
        self.assertEqual(one.label, "ours: MB → DoF, `carry_coc: true`")

    def test_questions_ask_for_chains_that_are_measured(self):
        measured = {("gbuf" if chain.where == ordering_study.GBUF else "sharp", chain.name)
                    for chain in ordering_study.CHAINS}
        for question in ordering_study.QUESTIONS:
            self.assertIn((question.source, question.first), measured)
            self.assertIn((question.source, question.second), measured)
        for name in ordering_study.TIMED:
            self.assertIn(("sharp", name), measured)


class Tables(unittest.TestCase):
    def test_numbers(self):
        self.assertEqual(ordering_tables.number(0.1234, 3), ".123")
        self.assertEqual(ordering_tables.signed(0.5, 2), "+.50")
        self.assertEqual(ordering_tables.signed(-1.25, 1), "−1.2")
        self.assertEqual(ordering_tables.signed(-0.0001, 2), ".00")

    def test_rows(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {"wheels": [(0.25, 0.125), (0.25, 0.125)],
                                          "generated_poles_far": [(0.5, 0.125)]})
            rows = ordering_tables.text(results).splitlines()
        self.assertIn("| wheels (2) | +.1250 (+.1250 to +.1250) |  |  |  |", rows)
        self.assertIn("| poles far, generated (1) | +.3750 |  |  |  |", rows)
        # Of .125 and .375: half width 12.70620 * .125.
        self.assertTrue(any("| report's filters | +.2500 (−1.3383 to +1.8383), 2/2 |" in row
                            for row in rows), "\n".join(rows))

    def test_errors_are_of_frames_that_every_chain_has(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {"wheels": [(0.25, 0.125), (0.5, 0.5)],
                                          "generated_poles_far": [(0.5, 0.125)]})
            results.row("wheels", "sharp", QUESTION.second, "passes", "1")["frames"].pop("2")
            chains = [one for one in ordering_study.CHAINS
                      if one.where == ordering_study.ALL][:2]
            names = ordering_tables.common_frames(results, "sharp", chains)
            rows = ordering_tables.errors_table(results, "sharp", chains, names)
        self.assertEqual(names, {"wheels": [1], "generated_poles_far": [1]})
        self.assertEqual(rows[2:], ["| report: MB → DoF | .3750 | 30.00 | .9000 |  |",
                                    "| report: DoF → MB | .1250 | 30.00 | .9000 |  |"])

    def test_the_page_is_one_file_with_every_scene(self):
        with tempfile.TemporaryDirectory() as folder:
            results = results_of(folder, {"wheels": [(0.25, 0.125)], "corridor": [(0.5, 0.25)]})
            path = pathlib.Path(folder) / "page.html"
            ordering_page.write(results, path, pathlib.Path(folder))
            page = path.read_text()
        for word in ("wheels", "corridor", "</html>"):
            self.assertIn(word, page)
        for word in ("http:", "https:", "<script", "nan"):
            self.assertNotIn(word, page.lower().replace("http://www.w3.org/2000/svg", ""))
        self.assertTrue(math.isfinite(len(page)))


if __name__ == "__main__":
    unittest.main()
