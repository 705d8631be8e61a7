// A texture may be larger than the frame (chain/area.h), so shaders of passes take sizes from their
// uniforms. Only the number of an array's layers is what the texture has.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

namespace {

namespace fs = std::filesystem;

TEST(Shaders, TakeSizesFromUniforms) {
    static const std::regex query(R"re(\b(textureSize|imageSize)\(\w+(, 0)?\)(\.z)?)re");
    size_t layers = 0;
    for (const auto& entry : fs::recursive_directory_iterator(POSTCHAIN_SOURCE_DIR "/shaders")) {
        const std::string path = fs::relative(entry.path(), POSTCHAIN_SOURCE_DIR).generic_string();
        const std::string kind = entry.path().extension().string();
        if (kind != ".comp" && kind != ".glsl") continue;
        // They make inputs, and run on whole textures.
        if (path.find("/scenes/") != path.npos || path.find("/bench/") != path.npos) continue;
        std::ifstream in(entry.path());
        std::string line;
        for (int row = 1; std::getline(in, line); ++row) {
            std::smatch found;
            if (!std::regex_search(line, found, query)) continue;
            EXPECT_TRUE(found[3].matched) << path << ":" << row << ": " << line;
            ++layers;
        }
    }
    EXPECT_GT(layers, 2u);
}

}  // namespace
