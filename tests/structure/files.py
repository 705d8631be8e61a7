"""The files of this repository."""
import functools
import pathlib
import typing
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class File(typing.NamedTuple):
    name: str  # relative to the root
    text: str

    @property
    def lines(self):
        return self.text.removesuffix("\n").split("\n")

    def place(self, number):
        """The line of this number, after "chain/plan/plan.cpp:7: "."""
        return f"{self.name}:{number}: {self.lines[number - 1]}"

    def matches(self, pattern):
        """Every occurrence: its place and the match."""
        return [(self.place(self.text.count("\n", 0, found.start()) + 1), found)
                for found in pattern.finditer(self.text)]


@functools.cache
def file_of(name):
    with open(ROOT / name, encoding="utf8", newline="\n") as file:
        return File(name, file.read())


def files_below(folders, extensions):
    """All below these folders whose names end so."""
    paths = [path for folder in folders for path in sorted((ROOT / folder).resolve(strict=True).rglob("*"))
             if path.suffix in extensions and path.is_file()]
    return [file_of(str(path.relative_to(ROOT))) for path in paths]


# Each may be left out, also with its folder (docs/architecture.md).
PARTS = ["tools/measure", "tools/service", "tools/page", "tools/apps/view", "tools/python", "tools/blender",
         "tools/openfx", "tools/samples", "tests/measure", "tests/page", "tests/stability", "tests/service", "tests/view",
         "tests/python", "tests/blender", "tests/openfx", "tests/ogre"]


def part_of(path):
    """The folder of the part that has this path; "" if none has."""
    return next((part for part in PARTS if f"{path}/".startswith(f"{part}/")), "")


def all_are_here():
    return all((ROOT / part).exists() for part in PARTS)


def is_here(path):
    """False for a path in a part whose folder was left out."""
    return not part_of(path) or (ROOT / part_of(path)).exists()


class Case(unittest.TestCase):
    def expect_none(self, faults):
        """Fails with all of them, one a line."""
        if faults := list(faults):
            self.fail("\n".join(["", *faults]))
