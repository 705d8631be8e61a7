"""Tests that cannot run on this machine."""
import sys

SKIPPED = 77  # the exit code that CTest takes for a skipped test


def skipped(why, *packages):
    """Prints the line by which the test command lists what did not run."""
    print(f"skipped: {why}" + (f"; install: {' '.join(packages)}" if packages else ""), flush=True)


def skip(why, *packages):
    """Ends a script of which nothing can run."""
    skipped(why, *packages)
    sys.exit(SKIPPED)
