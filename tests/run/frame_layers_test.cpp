// Layers and mattes of a file that cannot be filtered with its color.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/exr_files.h"
#include "tools/sequence/layers/frame_layers.h"

namespace postchain::sequence::frame_layers_test {
namespace {

using testing::HasSubstr;

// One layer of each kind beside color, in the part of color and in others.
class FrameLayersTest : public testing::Test {
  protected:
    void SetUp() override {
        test::FilePart main{.name = "main", .channels = {{"R"}, {"G"}, {"B"}, {"Z", Imf::FLOAT}}};
        main.data = main.display = {{0, 0}, {15, 7}};
        for (const char* word : {"R", "G", "B"}) {
            main.channels.push_back({std::string("key.") + word});
            main.channels.push_back({std::string("sampled.") + word, Imf::HALF, 2});
            main.channels.push_back({std::string("whole.") + word, Imf::UINT});
        }
        test::FilePart small{.name = "small", .channels = {{"R"}, {"G"}, {"B"}}};
        small.data = {{0, 0}, {11, 7}};
        small.display = main.display;
        test::write_file(folder_.path("f.exr"), {main, small});
        auto file = io::open_pixels(folder_.path("f.exr"));
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
    }
    Result<FrameLayers> found(const LayerSettings& settings) const {
        const auto match = detect_profile(builtin_profiles(), io::channels_of(*file_), "", "");
        if (!match.ok()) return match.status();
        return find_frame_layers(settings, data_names(*find_profile(match->profile)), *file_,
                                 *match);
    }

    const test::TempFolder folder_;
    std::shared_ptr<io::PixelFile> file_;
};

TEST_F(FrameLayersTest, AllLeavesWhatCannotBeFiltered) {
    const auto layers = found({.layers = "all"});
    ASSERT_TRUE(layers.ok()) << layers.status().message();
    ASSERT_EQ(layers->filtered.size(), 1u);
    EXPECT_EQ(layers->filtered[0].name, "main.key");
    std::map<std::string, std::string> left;
    for (const LeftLayer& layer : layers->left) left[layer.name] = layer.why;
    EXPECT_THAT(left["main.sampled"], HasSubstr("subsampled channel (sampled.R)"));
    EXPECT_THAT(left["main.whole"], HasSubstr("integer channel (whole.R)"));
    EXPECT_THAT(left["small"], HasSubstr("its data window is (0, 0)-(11, 7)"));
}

TEST_F(FrameLayersTest, ALayerOrMatteThatCannotBeFilteredIsAnError) {
    for (const auto& [name, why] : {std::pair("sampled", "subsampled"), {"whole", "integer"}}) {
        const auto layers = found({.layers = name});
        EXPECT_EQ(layers.status().code(), StatusCode::input) << name;
        EXPECT_THAT(layers.status().message(), HasSubstr(why));
        const auto matte = found({.mattes = {std::string(name) + ".G"}});
        EXPECT_EQ(matte.status().code(), StatusCode::input) << name;
        EXPECT_THAT(matte.status().message(), HasSubstr(why));
    }
    EXPECT_EQ(found({.mattes = {"small.G"}}).status().code(), StatusCode::input);
    EXPECT_TRUE(found({.mattes = {"key.G"}}).ok());
}

}  // namespace
}  // namespace postchain::sequence::frame_layers_test
