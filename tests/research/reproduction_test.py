"""The arithmetic of reproduction.py, without filters: intervals, findings, Holm, equal rates, what is kept, --only."""
import contextlib
import io
import math
import pathlib
import sys
import tempfile
import types
import unittest
import unittest.mock

import numpy as np

sys.modules["postchain"] = types.SimpleNamespace(Device=lambda which: types.SimpleNamespace(renderer="none"))
import cards  # noqa: E402
import reproduction  # noqa: E402


def scene(name, family=None):
    return types.SimpleNamespace(name=name, family=family or name)


class Reproduction(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def measurer(self, *scenes):
        made = reproduction.Measurer(self.folder, scenes)
        made.commit = "1234"
        return made

    def test_interval_and_probability(self):
        mean, half, p, up, n = reproduction.tested([1.0, 2.0, 3.0])
        # t = 2 sqrt(3); with two degrees of freedom p = 1 - t/sqrt(t^2 + 2), and 4.3027 is the t of 95 %.
        self.assertEqual((mean, up, n), (2, 3, 3))
        self.assertAlmostEqual(half, 4.30265 / math.sqrt(3), 4)
        self.assertAlmostEqual(p, 1 - math.sqrt(12 / 14), 9)
        self.assertEqual(reproduction.tested([-1.0])[1:3], (None, None))

    def test_scenes_of_a_family_count_once(self):
        scenes = [scene("a", "one"), scene("b", "one"), scene("c"), scene("d")]
        self.assertEqual(reproduction.over_families(scenes, [1, 3, 7, None]), {"one": 2, "c": 7})

    def test_findings(self):
        for metric, mean, half, expected in (("hdr_flip", 0.01, 0.009, "B"), ("hdr_flip", -0.01, 0.009, "A"),
                                             ("hdr_flip", 0.001, 0.0039, "equal"), ("hdr_flip", 0.001, 0.0041, ""),
                                             ("all", 0.1, 0.2, "equal"), ("slow", 0.1, 0.4, ""),
                                             ("noise", 0.0001, 0.0002, "")):
            self.assertEqual(reproduction.finding(metric, mean, half), expected, (metric, mean, half))

    def test_a_gain_is_positive_where_b_is_closer(self):
        one = self.measurer()
        values = {"a": {"hdr_flip": 0.2, "slow": 20.0, "noise": 0.02, "mean border": None},
                  "b": {"hdr_flip": 0.1, "slow": 23.0, "noise": 0.03, "mean border": 5.0}}
        one.errors = one.noise = lambda _, kind, setting: values[setting]
        for metric, expected in (("hdr_flip", 0.1), ("slow", 3.0), ("noise", -0.01)):
            self.assertAlmostEqual(one.gain(metric, None, "sharp", "a", "b"), expected)
        self.assertIsNone(one.gain("mean border", None, "sharp", "a", "b"))

    def test_keeps_what_this_commit_measured(self):
        calls = []
        def measure():
            calls.append(1)
            return len(calls)
        self.assertEqual([self.measurer()._kept(["x", 1], measure) for _ in range(2)], [1, 1])
        self.assertEqual(self.measurer()._kept(["x", 2], measure), 2)
        other = self.measurer()
        other.commit = "5678"
        self.assertEqual(other._kept(["x", 1], measure), 3)
        other.measuring = False
        self.assertIsNone(other._kept(["x", 2], measure))
        self.assertEqual(len(calls), 3)

    def test_only_measures_the_rows_that_begin_so(self):
        one = self.measurer(scene("a"), scene("b"))
        measured = set()
        one.gain = lambda metric, scene, kind, a, b: measured.add((scene.name, metric, kind))
        one.special = lambda scene, words, function: measured.add((scene.name, words))
        reproduction.measure_rows(one, types.SimpleNamespace(only="4.4", data=None))
        self.assertEqual(measured, {(name, metric, "sharp") for name in "ab" for metric in ("hdr_flip", "unblurred")})

    def test_rate_of_equal_value(self):
        one = self.measurer(scene("a"))
        def of(_, kind, setting):  # the report's falls with the root of N, and the setting is that of N = 30
            samples = setting[1]["motion_blur"].get("samples", 30) if setting[0] == "product" else 200
            return {"noise": samples ** -0.5, "hdr_flip": 1 / samples, "all": 10 * math.log10(samples)}
        one.errors = one.noise = of
        found = reproduction.equal_rates(one, "sharp", reproduction.REPORT)
        self.assertEqual([text.split(" = ")[1] for text in found.values()], ["N 30", "N 30", "N 30"])
        self.assertIn("N above 101", reproduction.equal_rates(one, "sharp", ["port"])["all"])

    def test_holm_counts_the_questions_on_the_cards(self):
        keys = {one[:2] for one in reproduction.COMPARISONS}
        self.assertLessEqual(set(reproduction.QUESTIONS), keys)
        one = self.measurer(scene("old"), scene("cards x"), scene("cards y"), scene("cards z"))
        gains = {"old": -9.0, "cards x": 1.0, "cards y": 2.0, "cards z": 3.0}
        one.gain = lambda metric, scene, kind, a, b: gains[scene.name]
        with contextlib.redirect_stdout(io.StringIO()) as out:
            reproduction.print_comparisons(one)
        rows = [line.split(" | ") for line in out.getvalue().splitlines()[2:]]
        self.assertEqual(len(rows), len(reproduction.COMPARISONS))
        asked = [row for row in rows if row[7].strip(" |")]
        self.assertEqual(len(asked), len(reproduction.QUESTIONS))
        self.assertEqual({(row[5], row[7]) for row in asked}, {("3/4", "1 |")})
        # p is .0033 for 9, 10, 11: times 22.
        gains.update({"cards x": 9.0, "cards y": 10.0, "cards z": 11.0})
        p = 1 - math.sqrt(300 / 302)
        with contextlib.redirect_stdout(io.StringIO()) as out:
            reproduction.print_comparisons(one)
        self.assertIn(f" | {p * len(reproduction.QUESTIONS):.2g} |", out.getvalue())

    def test_velocities_of_8_bits(self):
        self.enterContext(unittest.mock.patch.object(reproduction, "SPEEDS", (16,)))
        step = {"report": 40 / 127, "mcguire": 80 / 255}
        for encoding, size in step.items():
            length, angle, axes, image = reproduction.storage(encoding)[0]
            # Each component is off by at most half a step, uniformly.
            self.assertAlmostEqual(length, size / math.sqrt(6), delta=0.02)
            self.assertAlmostEqual(angle, math.degrees(size / math.sqrt(12) / 16), delta=0.1)
            self.assertAlmostEqual(image, 0.0053, delta=0.002)
            # No code of McGuire's is 0.
            self.assertAlmostEqual(axes, 0 if encoding == "report" else math.degrees(size / 2 / 16), delta=0.02)

    def test_cards_move_as_they_say(self):
        point = np.random.default_rng(1).uniform(-40, 40, (2, 9))
        for card in (card for scene in cards.SCENES.values() for card in scene):
            def place(time):  # in the complex plane
                return (complex(*card.at) + complex(*card.move) * time
                        + np.exp((card.grow + 1j * card.turn) * time) * (point[0] + 1j * point[1]))
            way = place(0.5) - place(-0.5)
            np.testing.assert_allclose(card.motion(*point), np.stack([way.real, way.imag], -1), atol=1e-9)
            np.testing.assert_allclose(card.own(place(0.3).real, place(0.3).imag, 0.3), point, atol=1e-9)

    def test_ground_truth_of_cards(self):
        white, black = (lambda u, v, value=value: np.full((*u.shape, 3), value) for value in (1.0, 0.0))
        scenes = {"edge": [cards.Card(2, lambda u, v: u < 0, white, move=(16, 0)),
                           cards.Card(5, cards.everywhere, black)],
                  "rest": [cards.Card(2, cards.box(30, 20), white), cards.Card(5, cards.everywhere, cards.waves(1, 9))]}
        with unittest.mock.patch.dict(cards.SCENES, scenes):
            _, _, truth = cards.render("edge", 40, 4)
            ramp = np.clip(0.5 - (np.arange(40) - 19.5) / 16, 0, 1)
            np.testing.assert_allclose(truth[..., 0], np.broadcast_to(ramp, (4, 40)), atol=0.03)
            (sharp, _, motion), (_, depth, _), truth = cards.render("rest", 48, 32)
            self.assertLess(np.abs(truth - sharp).mean(), 0.01)
            self.assertFalse(motion.any())
            self.assertEqual(set(depth.ravel()), {np.float32(0.5), np.float32(0.2)})


if __name__ == "__main__":
    unittest.main()
