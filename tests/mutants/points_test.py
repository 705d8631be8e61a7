"""Fault points in a small program: each fault does what its kind says, and none changes the program.

usage: points_test.py CXX"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from points.insert import KINDS, Inserter, without_text

CXX = None
SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = r"""
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>
// if (a) is no code
#define IF if (false)
constexpr bool early(int n) { return n > 2 && n != 7; }
static_assert(early(3));
struct Text { std::vector<int> all; };
int sum(const Text& text, int limit) {
    int total = 0;
    for (const int one : text.all)
        if (const int value = one; value < limit || value == 9) total += value;
    total -= 1;
    total += limit == 0 ? 2 : 0;
    return total > 3 ? total + 1 : -total;
}
bool is_even(int n) {
    if (n % 2 == 0) return true;
    return false;
}
struct Vec {
    int x;
    Vec operator-() const { return {-x}; }
    friend Vec operator+(Vec a, Vec b) { return {a.x + b.x}; }
};
int ends(int n) { return std::max(n, 3) - 2 * std::min(n, 9); }
std::string twice(const std::string& word) { return word + word; }
int main() {
    Text text;
    text.all.push_back(1);
    text.all = {4, 5, 9};
    std::printf("%d %d %d \"if (b)\" %c\n", sum(text, 5), is_even(4), early(5), ')');
    const Vec seven{7}, one{1};
    const Vec vec = seven + one;
    std::printf("%d %d %s", ends(5), vec.x, twice("on").c_str());
}
"""
MIDDLE = ' "if (b)" )\n'
SAID = f"13 1 1{MIDDLE}-5 8 onon"


class Points(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_every_fault_does_what_its_kind_says(self):
        inserter = Inserter(PROGRAM, first=3)
        (self.folder / "p.cpp").write_text(inserter.result())
        subprocess.run([CXX, "-std=c++20", f"-I{SOURCE}", self.folder / "p.cpp", "-o", self.folder / "p"], check=True)
        reached = self.folder / "reached"
        reached.write_bytes(bytes(1 << 16))

        def said(fault):
            return subprocess.run([self.folder / "p"], check=True, capture_output=True, text=True, timeout=60,
                                  env=os.environ | {"POSTCHAIN_FAULT": str(fault), "POSTCHAIN_REACHED": str(reached)}
                                  ).stdout.strip()

        self.assertEqual(said(-1), SAID)
        seen = reached.read_bytes()
        found = {(text, KINDS[kind]): said(8 * number + kind)
                 for number, (_, kinds, text) in enumerate(inserter.points, 3) for kind in kinds}
        self.assertEqual(seen[:3], bytes(3))
        self.assertEqual({text: seen[number] for number, (_, kinds, text) in enumerate(inserter.points, 3)
                          if "always true" in [KINDS[kind] for kind in kinds]}, {
            "value < limit": 3, "limit == 0": 1, "value == 9": 3, "n % 2 == 0": 2, "n > 2": 2, "n != 7": 2, "total > 3": 2})
        changed = {key: next(new for new, old in zip(text.split(MIDDLE), SAID.split(MIDDLE)) if new != old)
                   for key, text in found.items() if text != SAID}
        self.assertEqual(changed, {
            ("value < limit", "always true"): "18 1 1",
            ("value < limit", "always false"): "9 1 1",
            ("value < limit", "boundary moved"): "18 1 1",
            ("value == 9", "always true"): "18 1 1",
            ("value == 9", "always false"): "-3 1 1",
            ("limit == 0", "always true"): "15 1 1",
            ("n % 2 == 0", "always false"): "13 0 1",
            ("true", "flipped"): "13 0 1",
            ("n > 2", "always false"): "13 1 0",
            ("n != 7", "always false"): "13 1 0",
            ("total > 3", "always false"): "-12 1 1",
            ("total -= 1", "left out"): "14 1 1",
            ("return total > 3 ? total + 1 : -total;", "1 is 0"): "12 1 1",
            ('std::printf("%d %d %d \\"if (b)\\" %c\\n", sum(text, 5), is_even(4), early(5), \')\')', "left out"): "-5 8 onon",
            ('std::printf("%d %d %s", ends(5), vec.x, twice("on").c_str())', "left out"): '13 1 1 "if (b)" )',
            ("friend Vec operator+(Vec a, Vec b) { return {a.x + b.x}; }", "other sign"): "-5 6 onon",
            ("const Vec vec = seven + one;", "other sign"): "-5 6 onon",
            ("int ends(int n) { return std::max(n, 3) - 2 * std::min(n, 9); }", "other sign"): "15 8 onon",
            ("std::max(n, 3)", "other end"): "-7 8 onon",
            ("std::min(n, 9)", "other end"): "-13 8 onon",
        })

    def test_text_is_no_code(self):
        self.assertEqual(without_text("a; // b\n"), "a;     \n")
        self.assertEqual(without_text('f("x\\"y", \'"\', 1\'000);'), "f($$$$$$, $$$, 1'000);")
        self.assertEqual(without_text('R"(if (a))" /* b\nc */ d'), "$" * 11 + "     \n     d")
        self.assertEqual(without_text("#define A \\\n  if (b)\nif (c)"), " " * 11 + "\n" + " " * 8 + "\nif (c)")


if __name__ == "__main__":
    CXX = sys.argv.pop(1)
    unittest.main()
