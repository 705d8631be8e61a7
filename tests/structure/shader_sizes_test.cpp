// A texture may be larger than the frame (chain/base/area.h), so shaders of passes take sizes from
// their uniforms. Only the number of an array's layers is what the texture has.
#include <gtest/gtest.h>

#include <regex>

#include "tests/structure/files.h"

namespace postchain::structure {
namespace {

TEST(Shaders, TakeSizesFromUniforms) {
    static const std::regex query(R"re(\b(textureSize|imageSize)\(\w+(, 0)?\)(\.z)?)re");
    size_t layers = 0;
    for (const File& file : files_below({"shaders"}, {".comp", ".glsl"})) {
        // They make inputs, and run on whole textures.
        if (file.name.starts_with("shaders/scenes/") || file.name.starts_with("shaders/bench/"))
            continue;
        for (size_t i = 0; i < file.lines.size(); ++i) {
            std::smatch found;
            if (!std::regex_search(file.lines[i], found, query)) continue;
            EXPECT_TRUE(found[3].matched) << place_of(file, i) << file.lines[i];
            ++layers;
        }
    }
    EXPECT_GT(layers, 2u);
}

}  // namespace
}  // namespace postchain::structure
