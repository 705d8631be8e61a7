// Runs every corpus file, including past finds, through its target in every build, and random
// changes of them: a short run without libFuzzer. A reader that breaks a guarantee ends the program
// with a line on stderr. The changes are the same every time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>

#include "targets.h"
#include "tests/support/text_file.h"

namespace postchain::fuzz {
namespace {

namespace fs = std::filesystem;

class Corpus : public testing::TestWithParam<Target> {};

// The corpus, and the profiles and chains that are shipped.
std::vector<fs::path> files_of(const Target& target) {
    const fs::path root = POSTCHAIN_SOURCE_DIR;
    const std::string name = target.name;
    std::vector<fs::path> files;
    for (const fs::path& folder :
         {root / "tests/fuzz/corpus" / name, root / "config" / (name + "s")})
        if (fs::exists(folder))
            for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

// A simple change as libFuzzer makes: a byte or bit, an overflowing number, a piece removed,
// doubled, or replaced by one from another file.
void change(std::string& bytes, const std::string& other, std::mt19937& random) {
    const auto below = [&](size_t n) { return n == 0 ? 0 : size_t(random()) % n; };
    const size_t at = below(bytes.size() + 1);
    const size_t length = std::min(bytes.size() - at, 1 + below(32));
    switch (below(6)) {
        case 0:
            if (at < bytes.size()) bytes[at] = char(random());
            break;
        case 1:
            if (at < bytes.size()) bytes[at] = char(bytes[at] ^ (1 << below(8)));
            break;
        case 2: {
            constexpr uint32_t kNumbers[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x10000};
            const uint32_t number = kNumbers[below(std::size(kNumbers))];
            if (at + 4 <= bytes.size()) std::memcpy(&bytes[at], &number, 4);
            break;
        }
        case 3:
            bytes.erase(at, length);
            break;
        case 4:
            bytes.insert(at, bytes.substr(at, length));
            break;
        default:
            bytes.replace(at, length, other.substr(below(other.size() + 1), 1 + below(64)));
    }
}

TEST_P(Corpus, RandomChanges) {
    constexpr int kRuns = 30000;
    const Target& target = GetParam();
    std::vector<std::string> inputs;
    for (const fs::path& file : files_of(target))
        inputs.push_back(postchain::test::read_text(file));
    ASSERT_FALSE(inputs.empty());
    std::mt19937 random(20);
    int accepted = 0, changed = 0;
    for (int run = 0; run < kRuns; ++run) {
        const std::string& from = inputs[random() % inputs.size()];
        std::string bytes = from;
        for (uint32_t changes = 1 + random() % 4; changes > 0; --changes)
            change(bytes, inputs[random() % inputs.size()], random);
        changed += bytes != from;
        accepted += target.run(bytes) ? 1 : 0;
    }
    EXPECT_GT(changed, kRuns * 4 / 5);
    EXPECT_GT(accepted, 0) << "no changed input gets past the reader's first checks";
    EXPECT_LT(accepted, kRuns);
}

TEST_P(Corpus, Replay) {
    const Target& target = GetParam();
    const std::vector<fs::path> files = files_of(target);
    int accepted = 0;
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.string());
        const std::string bytes = postchain::test::read_text(file);
        EXPECT_LT(bytes.size(), 20000u) << "the corpus is kept small";
        const bool taken = target.run(bytes);
        accepted += taken ? 1 : 0;
        // Without its last quarter, like a truncated copy.
        target.run(std::string_view(bytes).substr(0, bytes.size() * 3 / 4));
        const bool shipped = file.extension() == ".yaml";
        if (shipped || file.filename().string().starts_with("valid_")) {
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
