// Every file of the corpus through its target, in every build; the finds of the past are among
// them. A reader that breaks a promise ends the program with a line on stderr.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "targets.h"

namespace postchain::fuzz {
namespace {

namespace fs = std::filesystem;

class Corpus : public testing::TestWithParam<Target> {};

TEST_P(Corpus, Replay) {
    const Target& target = GetParam();
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(fs::path(POSTCHAIN_SOURCE_DIR) /
                                                    "tests/fuzz/corpus" / target.name)) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    int accepted = 0;
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.string());
        std::ifstream in(file, std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(in), {}};
        EXPECT_LT(bytes.size(), 20000u) << "the corpus is kept small";
        const bool taken = target.run(bytes);
        accepted += taken ? 1 : 0;
        // Without its last quarter, as a copy that was cut off.
        target.run(std::string_view(bytes).substr(0, bytes.size() * 3 / 4));
        if (file.filename().string().starts_with("valid_")) {
            EXPECT_TRUE(taken) << "a valid seed is refused";
        }
    }
    EXPECT_GT(accepted, 0) << "nothing in the corpus gets past the reader's first checks";
    EXPECT_LT(accepted, int(files.size())) << "the corpus holds no refused input";
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Corpus, testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace postchain::fuzz
