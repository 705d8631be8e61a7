"""The add-on in a window, under Xvfb: the panel draws, Filter runs while Blender stays usable, Esc
and loading a file end it. --keep FOLDER keeps the screenshots.

usage: window_test.py POSTCHAIN ZIP [BLENDER]"""
import os
import shutil
import sys
import tempfile
import unittest

import launch

BLENDER = None
KEEP = None


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
            if KEEP:
                shutil.copytree(folder, KEEP, dirs_exist_ok=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    if "--keep" in words:
        KEEP = os.path.abspath(words.pop(words.index("--keep") + 1))
        words.remove("--keep")
    if not shutil.which("Xvfb"):
        launch.skip("no Xvfb", "xvfb")
    BLENDER = launch.Launcher(words)
    unittest.main(argv=sys.argv[:1])
