"""Starts Blender for the tests of the add-on: with the zip installed in an empty folder of its own."""
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "cycles"), str(HERE.parent / "support")]
import request
from skips import skip


class Launcher:
    """POSTCHAIN ZIP [BLENDER], the arguments of the tests; ends the program if there is no Blender."""

    def __init__(self, arguments):
        if len(arguments) < 3:
            skip("no Blender", "blender")
        self.postchain, self.zip, self.blender = (os.path.abspath(one) for one in arguments[:3])

    def version(self):
        printed = subprocess.run([self.blender, "--version"], capture_output=True, text=True, check=True).stdout
        return tuple(int(part) for part in printed.split()[1].split("."))

    def environment(self, folder, module):
        own = {"BLENDER_USER_SCRIPTS": "scripts", "BLENDER_USER_CONFIG": "config",
               "BLENDER_USER_EXTENSIONS": "extensions"}
        paths = {name: os.path.join(folder, "blender", part) for name, part in own.items()}
        for path in paths.values():
            os.makedirs(path, exist_ok=True)
        return {**request.blender_environment(), **paths, "POSTCHAIN": self.postchain,
                "POSTCHAIN_ZIP": self.zip, "POSTCHAIN_MODULE": module, "PYTHONDONTWRITEBYTECODE": "1",
                "PWD": str(folder)}

    def run(self, folder, *arguments, before=(), module="postchain_blender", timeout=1700):
        """Standard output and error of `blender ARGUMENTS` in a folder; fails if Blender does. module: name of the
        add-on for Python."""
        done = subprocess.run([*before, self.blender, "--factory-startup", "--python-exit-code", "1",
                               *map(str, arguments)], cwd=folder, env=self.environment(folder, module), text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout,
                              check=False)
        printed = "\n".join(line for line in done.stdout.splitlines() if not line.startswith("Fra:"))
        if done.returncode != 0:
            raise AssertionError(printed)
        return printed
