// `--behind`: when the layer behind is read, and which files are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "chain/frame/behind.h"
#include "tests/run/fixture.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/run/plan_sequence.h"

namespace postchain::sequence {
namespace {

using ::testing::HasSubstr;

class BehindTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        test::write_sequence(folder_.path(""), {1, 2, 3});
        settings_.on_existing = io::OnExisting::overwrite;
        frames("2");
        chain_ = test::chain_of("motion_blur", {{"samples", int64_t(9)}});
    }
    void behind(const std::string& path) {
        settings_.input.patterns.insert_or_assign(Role::behind, *io::PathPattern::parse(path));
    }
    void behind_of_frame_2(const test::FrameFile& file = {}) {
        test::write_frame(at("behind.0002.exr"), test::make_planes(48, 32), file);
        behind(at("behind.####.exr"));
    }
};

// Neighbors need none of their own, and do not wait for one.
TEST_F(BehindTest, IsReadAndWaitedForOnlyForTheFrameItself) {
    behind_of_frame_2();
    for (const auto& watch : {std::optional<Watch>(), std::optional(Watch{.idle_s = 10})}) {
        settings_.watch = watch;
        EXPECT_TRUE(last_frame().status.ok());
        const auto written = sidecar(2);
        EXPECT_FALSE(written["plan"].contains("missing_neighbors")) << written["plan"];
        EXPECT_EQ(written["inputs"].size(), 4u) << written["inputs"];
        EXPECT_EQ(written["inputs"]["behind"], at("behind.0002.exr"));
    }
    frames("2-3");
    settings_.watch = Watch{.idle_s = 1};
    EXPECT_THAT(failure(), HasSubstr("behind.0003.exr: frame did not come"));
}

TEST_F(BehindTest, IsNotReplaced) {
    behind_of_frame_2();
    settings_.output = *io::PathPattern::parse(at("behind.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("would replace the layer behind"));
}

TEST_F(BehindTest, IsInTheMemoryOfThePlan) {
    const auto planned = [&] {
        Memory memory;
        const Status status = plan_sequence(chain_, settings_, [&](const PlanReport& frame) {
            memory = frame.memory;
            return true;
        });
        EXPECT_TRUE(status.ok()) << status.message();
        return memory;
    };
    const Memory without = planned();
    behind_of_frame_2();
    const Memory with = planned();
    // Color, depth and vectors as stored and as planes, and the planes of the frame behind.
    const uint64_t bytes = 48 * 32 * (2 * 4 * (4 + 1 + 2) + 16 * uint64_t(kBehindPlanes));
    EXPECT_GE(with.frame, without.frame + bytes);
    EXPECT_GE(with.process - with.textures, without.process - without.textures + bytes);
}

TEST_F(BehindTest, DecidesWhatIsMadeAgain) {
    EXPECT_TRUE(last_frame().status.ok());
    settings_.on_existing = io::OnExisting::skip;
    EXPECT_EQ(last_frame().outcome, Outcome::skipped);
    behind_of_frame_2();
    EXPECT_EQ(last_frame().outcome, Outcome::written);
    EXPECT_EQ(last_frame().outcome, Outcome::skipped);
}

TEST_F(BehindTest, IsLeftAloneByChainsThatDoNotReadIt) {
    chain_ = test::chain_of("fxaa");
    behind_of_frame_2();
    const FrameReport report = last_frame();
    EXPECT_TRUE(report.status.ok());
    EXPECT_THAT(report.warnings, ::testing::Contains(HasSubstr("behind.0002.exr: not read")));
    EXPECT_THAT(sidecar(2).dump(), ::testing::Not(HasSubstr("second_surfaces")));
}

TEST_F(BehindTest, FindingsInItsPixelsAreWarnings) {
    test::Planes planes = test::make_planes(48, 32);
    planes.color.at(30, 20) = NAN;
    test::write_frame(at("nan.0002.exr"), planes);
    behind(at("nan.####.exr"));
    const FrameReport report = last_frame();
    EXPECT_TRUE(report.status.ok()) << report.status.message();
    EXPECT_THAT(report.warnings,
                ::testing::Contains(HasSubstr("the first non-finite pixel is (30, 20)")));
    settings_.strict = true;
    EXPECT_THAT(failure(),
                HasSubstr("nan.0002.exr: 1 non-finite pixels under {strict=true}"_keyed));
}

TEST_F(BehindTest, ThatChangesMeanwhileFailsTheFrame) {
    behind_of_frame_2();
    const auto touch = [&](FrameStep step, int, bool begins) {
        if (begins && step == FrameStep::filter)
            std::filesystem::last_write_time(at("behind.0002.exr"),
                                             std::filesystem::file_time_type::clock::now());
    };
    const auto summary =
        run_sequence(chain_, settings_, test::executor(), "renderer", {.steps = touch});
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_THAT(summary->first_failure.message(), HasSubstr("behind.0002.exr: was changed"));
}

TEST_F(BehindTest, HasTheLayersOfTheFrame) {
    const io::Window own = {0, 0, 47, 31}, larger = {-4, -3, 55, 36};
    const auto with_layers = [](const std::vector<std::string>& layers, float value) {
        test::FrameFile file;
        for (const std::string& layer : layers)
            for (const char* channel : {".R", ".G", ".B"})
                file.mattes["ViewLayer." + layer + channel] =
                    ImageF(48, 32, 1, layer == "light" ? value : 99);
        return file;
    };
    test::write_sequence(folder_.path(""), {1, 2, 3}, 48, 32, with_layers({"light"}, 0.5f));
    settings_.source.layers.aovs = "all";
    const auto light = [&](test::FrameFile file, const io::Window& window = {0, 0, 47, 31}) {
        test::Planes planes = test::make_planes(48, 32);
        for (ImageF* plane : {&planes.color, &planes.depth, &planes.motion, &planes.back})
            *plane = io::placed(*plane, own, window);
        for (auto& [name, plane] : file.mattes) plane = io::placed(plane, own, window);
        file.origin_x = window.min_x;
        file.origin_y = window.min_y;
        file.display = own;
        test::write_frame(at("behind.0002.exr"), planes, file);
        behind(at("behind.####.exr"));
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        return *io::ExrFile::open(out(2))->read_channels(0, {"ViewLayer.light.R"});
    };
    const ImageF plain = light(with_layers({"light"}, 8));
    EXPECT_GT(*std::max_element(plain.data.begin(), plain.data.end()), 0.6f) << "it is seen";
    EXPECT_EQ(light(with_layers({"extra", "light", "more"}, 8)), plain);
    EXPECT_EQ(light(with_layers({"light"}, 8), larger), plain);
    behind_of_frame_2();
    EXPECT_THAT(failure(), HasSubstr("behind lacks these layers of the frame: ViewLayer.light"));
    // Neither is filtered with it.
    const auto without = HasSubstr("filtered without the layer behind: ");
    light(with_layers({"light"}, 8));
    test::write_frame(in(3), test::make_planes(48, 32, 3));
    EXPECT_THAT(last_frame().warnings, ::testing::Contains(without));
    test::FrameFile ids = with_layers({"crypto00"}, 0);
    ids.mattes["ViewLayer.crypto00.A"] = ImageF(48, 32, 1);
    ids.attributes["cryptomatte/1/name"] = std::string("ViewLayer.crypto");
    test::write_frame(in(2), test::make_planes(48, 32, 2), ids);
    settings_.source.layers.aovs.clear();
    settings_.source.layers.cryptomatte = CryptomatteChoice::filter;
    EXPECT_THAT(last_frame().warnings, ::testing::Contains(without));
}

TEST_F(BehindTest, FilesThatDoNotFitAreRefused) {
    behind(at("none.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("none.0002.exr: requested frames are not on disk: 2 "));
    behind_of_frame_2({.depth = false, .motion = false});
    EXPECT_THAT(failure(),
                HasSubstr("behind.0002.exr: the layer behind has no inverse_depth, motion"));
    test::write_frame(at("right.0002.exr"), test::make_planes(48, 32),
                      {.attributes = {{"view", std::string("right")}}});
    behind(at("right.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("right.0002.exr: the layer behind has no view"));
    test::write_frame(at("small.0002.exr"), test::make_planes(40, 32));
    behind(at("small.####.exr"));
    EXPECT_THAT(failure(), HasSubstr("small.0002.exr: the layer behind has display window"));
}

}  // namespace
}  // namespace postchain::sequence
