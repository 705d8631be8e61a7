"""Ends a script as a test that CTest counts as skipped."""
import sys


def skip(why, packages):
    """why: what is missing, as "no Blender"; packages: Debian's names of it."""
    print(f"skipped: {why}; install: {packages}")
    sys.exit(77)
