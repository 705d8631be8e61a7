"""Options of the scripts of the Cycles scenes: files, syntax."""
import argparse
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "tools/research/cycles"
sys.path.insert(0, str(SCRIPTS))
import request  # noqa: E402


class Request(unittest.TestCase):
    def test_frames(self):
        self.assertEqual(request.parse_frames("7"), [7])
        self.assertEqual(request.parse_frames("9-11,2,10"), [2, 9, 10, 11])
        for text in ("", "5-3", "a", "1-", "1,"):
            with self.assertRaises((ValueError, argparse.ArgumentTypeError), msg=text):
                request.parse_frames(text)

    def test_kinds_come_in_the_order_of_rendering(self):
        self.assertEqual(request.parse_kinds("behind,dof,sharp,both"), ["sharp", "both", "dof", "behind"])
        self.assertNotIn("behind", request.parse_options(["rain", "out"]).kinds)

    def test_a_bad_option_ends_with_a_usage_error(self):
        for arguments in ([], ["rain"], ["snow", "out"], ["rain", "out", "--frames", "5-3"],
                          ["rain", "out", "--size", "640"], ["rain", "out", "--kinds", "sharp,x"]):
            with contextlib.redirect_stderr(io.StringIO()), self.assertRaises(SystemExit) as end:
                request.parse_options(arguments)
            self.assertEqual(end.exception.code, 2, arguments)

    def test_finished_pictures_are_not_rendered_again(self):
        with tempfile.TemporaryDirectory() as folder:
            options = request.parse_options(["rain", folder, "--frames", "1-3", "--kinds", "sharp,mb"])
            self.assertEqual(request.images_to_render(options)[:2], [("sharp", 1), ("sharp", 2)])
            for name in ("sharp.0001.exr", "mb.0003.exr", "sharp.0002.exr.tmp"):
                (pathlib.Path(folder) / name).touch()
            self.assertEqual(request.images_to_render(options),
                             [("sharp", 2), ("sharp", 3), ("mb", 1), ("mb", 2)])

    def test_no_two_pictures_share_a_seed(self):
        seeds = {request.seed_of(kind, frame, half) for kind in request.KINDS
                 for frame in range(100) for half in (None, *request.HALVES)}
        self.assertEqual(len(seeds), 3 * 100 * len(request.KINDS))
        self.assertEqual(request.seed_of("behind", 6), request.seed_of("sharp", 6))


unittest.main()
