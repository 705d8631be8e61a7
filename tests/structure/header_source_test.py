"""A header leads to its source: x.h declares what x.cpp exports, and x.cpp includes x.h first (so that every header
compiles on its own). A program's main.cpp exports nothing and has no header. One header declares all subcommands of
a program."""
import posixpath
import re

import files

INCLUDE = re.compile(r'#include [<"]([^>"]+)[>"]')
MEMBER = re.compile(r"[A-Za-z][^(=]*?\b([A-Z]\w*)(<\w+>)?::~?\w+\(", re.A)
FUNCTION = re.compile(r"[A-Za-z][^(=]*?[ *&](\w+)\(", re.A)
WORD = re.compile(r"\w+", re.A)


OTHER_HEADERS = {
    "chain/guest/chain_interface.cpp": "chain/guest/postchain.h",
    # With the lab and without it.
    "tools/service/lab/kinds.cpp": "tools/service/work/measurement.h",
    "tools/service/work/no_measurement.cpp": "tools/service/work/measurement.h",
    "tools/python/lab/lab_calls.cpp": "tools/python/lab_calls.h",
    "tools/python/no_lab.cpp": "tools/python/lab_calls.h",
}


def first_include(lines):
    return next((found[1] for line in lines if (found := INCLUDE.match(line))), "")


def exports_of(lines):
    """Exports of a source: functions, and classes whose members it defines, at the beginning of a line (as
    clang-format formats them) and outside an unnamed namespace."""
    names, hidden = [], False
    for line in lines:
        if line in ("namespace {", "}  // namespace"):
            hidden = line == "namespace {"
        # A definition opens a block or continues on the next line; it never ends in a semicolon.
        if hidden or line.endswith(";") or line.startswith("static "):
            continue
        found = MEMBER.match(line) or FUNCTION.match(line)
        if found and found[1] not in ("operator", "main"):
            names.append(found[1])
    return names


def header_of(file):
    """The header that declares what a source exports: the one of its name, or for a subcommand without one the header
    of all. Two libraries have the functions of postchain.h. x_windows.cpp replaces x.cpp."""
    if file in OTHER_HEADERS:
        return OTHER_HEADERS[file]
    own = file.removesuffix(".cpp").removesuffix("_windows") + ".h"
    of_all = f"{posixpath.dirname(file)}/subcommands.h"
    return of_all if not (files.ROOT / own).exists() and (files.ROOT / of_all).exists() else own


def faults_of(file, source, header):
    """Faults of a source, given its lines and its header's text."""
    own = header_of(file)
    if not header:
        return [f"{file}: has no header {own}"]
    # Samples are also built outside this tree and name neighboring files without a path.
    named = posixpath.basename(own) if file.startswith("tools/samples/") else own
    faults = [] if first_include(source) == named else [f"{file}: does not include its header first"]
    declared = set(WORD.findall(header))
    return faults + [f"{file}: defines {name}, not declared in {own}" for name in exports_of(source)
                     if name not in declared]


class HeaderSource(files.Case):
    def test_every_source_has_the_header_that_declares_it(self):
        faults, count, exported = [], 0, 0
        for file in files.files_below(["chain", "passes", "config", "tools", "tests/support"], {".cpp"}):
            if file.name.endswith("/main.cpp"):
                continue
            own = header_of(file.name)
            faults += faults_of(file.name, file.lines, files.file_of(own).text if (files.ROOT / own).exists() else "")
            count += 1
            exported += len(exports_of(file.lines))
        self.expect_none(faults)
        self.assertGreater(count, 100, "the search found too few sources")
        self.assertGreater(exported, 300)

    def test_faults_are_seen(self):
        source = ['#include "chain/a.h"',
                  "namespace {",
                  "int hidden() {",
                  "}  // namespace",
                  "Result<int> Known::ask(int a) const {",
                  "const std::map<int, int>& exported(int a,",
                  "                                   int b) {"]
        header = "class Known;\nexported();"
        self.assertEqual(faults_of("chain/a.cpp", source, header), [])
        for lacking in ("class Known;", "exported();", ""):
            self.assertEqual(len(faults_of("chain/a.cpp", source, lacking)), 1, lacking)
        self.assertEqual(len(faults_of("chain/b.cpp", source, header)), 1)
        self.assertEqual(faults_of("chain/a_windows.cpp", source, header), [])
        sample = "tools/samples/b/a.cpp"
        self.assertEqual(faults_of(sample, ['#include "a.h"'], "//"), [])
        self.assertEqual(len(faults_of(sample, ['#include "chain/a.h"'], "//")), 1)
