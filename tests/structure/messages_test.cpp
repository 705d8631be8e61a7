// Messages name a program, library or package in general, because the product runs on every
// distribution. tools/packaging and the scripts that install packages are for one.
#include <gtest/gtest.h>

#include <regex>

#include "tests/structure/files.h"

namespace postchain::messages_test {
namespace {

using namespace structure;

// Whether a string in this line of code names a distribution or its tools.
bool names_distribution(const std::string& line) {
    static const std::regex words(R"(\b([Dd]ebian|[Uu]buntu|bookworm|trixie|apt|apt-get)\b)");
    static const std::regex comment(R"(^\s*(//|#|\*))");
    std::smatch found;
    return std::regex_search(line, found, words) &&
           line.find_first_of("\"'`") < static_cast<size_t>(found.position()) &&
           !std::regex_search(line, comment);
}

TEST(Messages, NameNoDistribution) {
    EXPECT_TRUE(names_distribution("fail(\"not installed (Debian: glslang-tools)\");"));
    EXPECT_FALSE(names_distribution("// Debian's package of \"glslang\""));
    size_t files = 0;
    for (const File& file : files_below({"chain", "passes", "config", "tools", "tests/bench"},
                                        {".cpp", ".h", ".py", ".js", ".html", ".txt"})) {
        if (file.name.starts_with("tools/packaging/")) continue;
        ++files;
        for (size_t i = 0; i < file.lines.size(); ++i)
            EXPECT_FALSE(names_distribution(file.lines[i])) << place_of(file, i) << file.lines[i];
    }
    EXPECT_GT(files, 300u);
}

}  // namespace
}  // namespace postchain::messages_test
