"""The add-on in a window, under Xvfb: the panel draws, Filter runs while Blender stays usable, Esc
and loading a file end it.

usage: window_test.py POSTCHAIN ZIP [BLENDER]"""
import shutil
import sys
import tempfile
import unittest

import launch

BLENDER = None


class Window(unittest.TestCase):
    def test_in_a_window(self):
        with tempfile.TemporaryDirectory() as folder:
            printed = BLENDER.run(
                folder, "--enable-event-simulate", "--window-geometry", "0", "0", "1280", "800", "-P",
                launch.HERE / "window.py", "--", folder,
                before=[launch.HERE.parent / "support/with_display.sh"])
            self.assertIn("\nOK\n", printed)
            for word in ("Traceback", "rna_uiItem", "Error:"):
                self.assertNotIn(word, printed)


if __name__ == "__main__":
    if not shutil.which("Xvfb"):
        launch.skip("no Xvfb", "xvfb")
    BLENDER = launch.Launcher(sys.argv[1:])
    unittest.main(argv=sys.argv[:1])
