"""Messages name a program, library or package in general, because the product runs on every distribution:
tools/packaging and the scripts that install packages are for one. Messages of libraries name settings by key
(chain/base/setting_text.h)."""
import re

import files

WORDS = re.compile(r"\b([Dd]ebian|[Uu]buntu|bookworm|trixie|apt|apt-get)\b", re.A)
OPTION = re.compile(r'"[^"]*(?<![\w-])--[a-z]')
OF_OTHER_PROGRAMS = ["apitrace trace --api=gl"]
BELOW_FRONT_ENDS = ["chain", "passes", "config", "tools/sequence", "tools/metrics", "tools/scenes", "tools/stress", *(
    f"tools/measure/{name}" for name in ("experiment", "report", "stress", "study", "tune"))]
COMMENT = re.compile(r"\s*(//|#|\*)", re.A)


def names_distribution(line):
    """Whether a string in this line of code names a distribution or its tools."""
    found = WORDS.search(line)
    return bool(found and re.search("[\"'`]", line[:found.start()]) and not COMMENT.match(line))


def names_option(line):
    """Whether a string in this line of code names an option of the command."""
    return OPTION.search(line.split("//")[0]) and not any(words in line for words in OF_OTHER_PROGRAMS)


class Messages(files.Case):
    def test_name_no_distribution(self):
        sources = [file for file in files.files_below(["chain", "passes", "config", "tools", "tests/bench"],
                                                      {".cpp", ".h", ".py", ".js", ".html", ".txt"})
                   if not file.name.startswith("tools/packaging/")]
        self.expect_none(file.place(number) for file in sources for number, line in enumerate(file.lines, 1)
                         if names_distribution(line))
        self.assertGreater(len(sources), 300)

    def test_of_libraries_name_no_option(self):
        sources = files.files_below(filter(files.is_here, BELOW_FRONT_ENDS), {".cpp", ".h"})
        self.expect_none(file.place(number) for file in sources for number, line in enumerate(file.lines, 1)
                         if names_option(line))
        self.assertGreater(len(sources), 200)

    def test_faults_are_seen(self):
        self.assertTrue(names_option('"use " + "--mkdir"'))
        self.assertFalse(names_option('size--;  // "--mkdir"'))
        self.assertTrue(names_distribution('fail("not installed (Debian: glslang-tools)");'))
        self.assertFalse(names_distribution("// Debian's package of \"glslang\""))
