// Seeds of the fuzz targets that read texts, of which a piece is repeated.
// Usage: seed_growth doubled|whole|times
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "growth.h"
#include "tests/fuzz/targets.h"
#include "tests/support/text_file.h"

namespace postchain::growth {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLongestSeed = 8192;

Case widened(const fuzz::Target& target, const fs::path& seed, size_t number) {
    const std::string bytes = test::read_text(seed);
    // A piece that differs from seed to seed.
    const size_t begin = number * 7919 % (bytes.size() - 4);
    const size_t length = std::min(bytes.size() - begin, 2 + number * 31 % 40);
    const auto text = [=](size_t most) {
        std::string wide = bytes.substr(0, begin);
        while (wide.size() + bytes.size() < most) wide += bytes.substr(begin, length);
        return wide + bytes.substr(begin);
    };
    return {std::string(target.name) + " seed " + seed.filename().string(), text,
            [run = target.run](const std::string& wide) { run(wide); }};
}

std::vector<Case> cases() {
    std::vector<Case> all;
    const fs::path corpus = fs::path(POSTCHAIN_SOURCE_DIR) / "tests/fuzz/corpus";
    for (const fuzz::Target& target : fuzz::targets()) {
        const std::string name = target.name;
        if (name == "exr" || name == "picture") continue;  // files of pixels, not texts
        std::vector<fs::path> seeds;
        for (const auto& entry : fs::directory_iterator(corpus / name))
            if (entry.file_size() >= 8 && entry.file_size() <= kLongestSeed)
                seeds.push_back(entry.path());
        std::ranges::sort(seeds);
        for (size_t i = 0; i < seeds.size(); ++i) all.push_back(widened(target, seeds[i], i));
    }
    return all;
}

}  // namespace
}  // namespace postchain::growth

int main(int argc, char** argv) {
    if (argc == 2) return postchain::growth::run_cases(postchain::growth::cases(), argv[1]);
    std::fprintf(stderr, "usage: seed_growth doubled|whole|times\n");
    return 2;
}
