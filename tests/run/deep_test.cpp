// Deep files as input and as the layer behind: they give the result of the frame and the layer in
// two flat files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/io/exr_files.h"
#include "tests/run/fixture.h"
#include "tests/run/scene_files.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using test::FilePart;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

FilePart deep_part(int width = 13, int height = 9) {
    FilePart part{.channels = {{"A"}, {"B"}, {"G"}, {"R"}, {"Z", Imf::FLOAT}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    part.data = part.display = {{0, 0}, {width - 1, height - 1}};
    return part;
}

class DeepTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.on_existing = io::OnExisting::overwrite;
        frames("2");
        chain_ = test::chain_of("joint_blur", {{"samples", int64_t(8)}});
        scene("wheels");
    }
    void scene(const std::string& name) {
        scene_ = name;
        settings_.source.camera = *load_camera(scene_file(name, "camera.json"));
    }
    void read(const std::string& color, const std::string& behind = {}) {
        settings_.input = *io::InputSpec::parse(color);
        if (!behind.empty())
            settings_.input.patterns.insert_or_assign(Role::behind,
                                                      *io::PathPattern::parse(behind));
    }
    std::string shot(const std::string& name) const {
        return scene_file(scene_, name + ".####.exr");
    }
    FrameReport last_frame() { return last_ = SequenceTest::last_frame(); }
    ImageF result() {
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        EXPECT_THAT(report.warnings, Not(Contains(HasSubstr("without the layer"))));
        return test::read_color(out(2));
    }
    // The last result.
    bool reads_layer() const {
        return std::ranges::any_of(last_.plan.value().steps, [](const Step& step) {
            return step.name.find("second_surfaces") != std::string::npos;
        });
    }
    std::string scene_;
    FrameReport last_;
};

// Every pixel of this scene is opaque: the flattened frame is `sharp`, and what is behind `behind`.
TEST_F(DeepTest, IsTheFrameAndItsLayerBehind) {
    read(shot("sharp"), shot("behind"));
    const ImageF two = result();
    read(shot("sharp"));
    const ImageF alone = result();
    read(shot("deep"));
    const ImageF deep = result();
    EXPECT_TRUE(deep.data == two.data);
    EXPECT_NE(deep.data, alone.data);
    EXPECT_TRUE(reads_layer());
    read(shot("sharp"), shot("deep"));
    EXPECT_EQ(result().data, two.data);
}

// A hole with alpha 0 and a pane of alpha 0.5. Color is the sum of two halves, which are rounded.
// At the rim of the hole a pixel that hides nothing has one sample that is not opaque: there the
// deep file says that nothing is behind, and `behind` shows the rim again.
TEST_F(DeepTest, IsCompositedWhereItIsNotOpaque) {
    scene("crossing");
    read(shot("sharp"), shot("behind"));
    const ImageF two = result();
    read(shot("deep"));
    const ImageF deep = result();
    size_t off = 0;
    for (size_t i = 0; i < two.data.size(); ++i)
        off += std::abs(deep.data[i] - two.data[i]) > 2e-3F * (1 + std::abs(two.data[i]));
    EXPECT_LT(double(off), 0.01 * double(two.data.size()));
}

TEST_F(DeepTest, IsWrittenFlat) {
    read(shot("deep"));
    const FrameReport report = last_frame();
    ASSERT_TRUE(report.status.ok()) << report.status.message();
    EXPECT_THAT(sidecar(2).dump(), HasSubstr("deep samples flattened"));
    const auto in = io::ExrFile::open(scene_file(scene_, "deep.0002.exr")),
               flat = io::ExrFile::open(out(2));
    ASSERT_TRUE(in.ok() && flat.ok());
    const io::ExrPart& part = flat->parts()[0];
    EXPECT_EQ(part.type, "scanlineimage");
    EXPECT_FALSE(part.deep);
    EXPECT_EQ(part.compression, "zips");
    EXPECT_EQ(part.channels, in->parts()[0].channels);
    for (const char* name : {"maxSamplesPerPixel", "version"})
        EXPECT_FALSE(part.attributes.contains(name)) << name;
    // Read by another program: depth is the frame's.
    const auto depth = test::named(test::oiio_channels(out(2)), "Z");
    EXPECT_EQ(depth.bytes, test::named(test::oiio_channels(scene_file(scene_, "sharp.0002.exr")),
                                       "ViewLayer.Depth.Z")
                               .bytes);
}

// Each sample as a part of its own would be: a flat part goes first, and for the layer behind the
// deep one.
TEST_F(DeepTest, PartsOfOneFileAreFlatAndDeep) {
    FilePart deep = deep_part();
    deep.name = "deep";
    for (const char* name : {"motion.x", "motion.y"}) deep.channels.push_back({name, Imf::FLOAT});
    FilePart flat{.name = "flat", .channels = deep.channels};
    // As some programs name color.
    FilePart small = flat;
    for (size_t i : {1, 2, 3}) small.channels[i].name = std::string(1, "bgr"[i - 1]);
    deep.samples = [](int, int, size_t channel) {
        if (channel == 4) return std::vector<float>{2, 5};
        return std::vector<float>{channel == 0 ? 1.0F : 0.5F, 1};
    };
    test::write_file(at("both.0002.exr"), {flat, deep});
    const std::map<Role, std::string> files = {{Role::color, at("both.0002.exr")}};
    SourceSettings settings;
    const auto front = open_source_frame(settings, files, 2);
    settings.behind = true;
    const auto behind = open_source_frame(settings, files, 2);
    ASSERT_TRUE(front.ok() && behind.ok());
    EXPECT_EQ(color_part(*front).name, "flat");
    EXPECT_FALSE(front->has_behind);
    EXPECT_EQ(color_part(*behind).name, "deep");
    const auto frame =
        read_source_frame(settings, *behind, {Role::inverse_depth}, io::Keep::nothing);
    ASSERT_TRUE(frame.ok()) << frame.status().message();
    EXPECT_EQ(frame->planes.at(Role::inverse_depth)->data[0], 0.2F);
    EXPECT_EQ(frame->planes.at(Role::color)->data[0], 1);

    test::write_file(at("small.0002.exr"), {small, deep});
    const auto named = open_source_frame({}, {{Role::color, at("small.0002.exr")}}, 2);
    ASSERT_TRUE(named.ok()) << named.status().message();
    EXPECT_EQ(color_part(*named).name, "flat");
}

// A file without color (deep opacity), and one with r, g and b: their deep channels count.
TEST_F(DeepTest, ChannelsOfADeepPartAreReadUnlessAFlatOneHasColor) {
    const auto depth_of = [&](const std::string& name, const std::vector<std::string>& colors,
                              Role role) {
        FilePart deep = deep_part(160, 90);
        deep.channels = {{"A"}, {"Z", Imf::FLOAT}};
        for (const std::string& color : colors) deep.channels.push_back({color});
        deep.samples = [](int, int, size_t channel) {
            return channel == 1 ? std::vector<float>{2, 5} : std::vector<float>{.75F, 1};
        };
        test::write_file(at(name), {deep});
        std::map<Role, std::string> files = {{Role::color, scene_file(scene_, "sharp.0002.exr")}};
        files[role] = at(name);
        auto header = open_source_frame({}, files, 2);
        if (!header.ok()) return concat(header.status().message());
        const auto frame = read_source_frame({}, *header, {Role::inverse_depth}, io::Keep::nothing);
        return frame.ok() ? concat(frame->planes.at(Role::inverse_depth)->data[0])
                          : frame.status().message();
    };
    EXPECT_EQ(depth_of("z.exr", {}, Role::inverse_depth), "0.5");
    EXPECT_EQ(depth_of("rgb.exr", {"b", "g", "r"}, Role::color), "0.5");
}

// The deep file has no vectors of its own: the frame is filtered with those of another file, the
// layer behind would stand still.
TEST_F(DeepTest, WithoutMotionThereIsNoLayerBehind) {
    FilePart deep = deep_part(160, 90);
    deep.samples = [](int x, int, size_t channel) {
        if (channel == 4) return std::vector<float>{1, 5};
        const float color = x % 16 < 8 ? 1 : 0.25F;
        return std::vector<float>{channel == 0 ? 1 : color, 1};
    };
    test::write_file(at("d.0002.exr"), {deep});
    const std::string vectors = scene_file(scene_, "sharp.####.exr");
    // The camera file has matrices. The camera's vectors are not those of moving objects.
    for (const CameraMotion made : {CameraMotion::missing, CameraMotion::none}) {
        settings_.source.camera_motion = made;
        settings_.input = *io::InputSpec::parse(
            concat("color=", at("d.####.exr"), ",motion=", vectors, ",motion_back=", vectors));
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        EXPECT_FALSE(reads_layer());
        EXPECT_THAT(report.warnings,
                    Contains(testing::AllOf(
                        HasSubstr("filtered without the layer behind: "),
                        HasSubstr("d.0002.exr: the layer behind has no motion, motion_back"),
                        HasSubstr("write them into the deep file, a value for each sample"))));
        read(shot("sharp"), at("d.####.exr"));
        EXPECT_THAT(failure(),
                    HasSubstr("d.0002.exr: the layer behind has no motion, motion_back"));
    }
    // Without vectors at all it is read: depth of field needs none.
    chain_ =
        test::chain_of("depth_of_field", {{"method", "inverse_warp"}, {"samples", int64_t(16)}});
    read(at("d.####.exr"));
    EXPECT_THAT(last_frame().warnings, Not(Contains(HasSubstr("without the layer"))));
    EXPECT_TRUE(reads_layer());
}

TEST_F(DeepTest, MemoryOfItsSamplesCountsAndPartsAreWrittenFlat) {
    FilePart deep = deep_part(16, 2);
    deep.name = "beauty";
    deep.samples = [](int, int, size_t) { return std::vector<float>(20000, .5F); };
    FilePart data{.name = "data", .channels = {{"id", Imf::UINT}}};
    data.data = data.display = deep.display;
    test::write_file(at("d.0002.exr"), {deep, data});
    chain_ = test::chain_of("fxaa", {});  // reads no layer behind
    read(at("d.####.exr"));
    settings_.source.max_memory = 4 << 20;
    EXPECT_THAT(failure(), testing::AllOf(HasSubstr("d.0002.exr: this frame needs "),
                                          HasSubstr("but {max_memory} allows 4.0 MiB"_keyed)));
    settings_.source.max_memory = 0;
    const FrameReport report = last_frame();
    ASSERT_TRUE(report.status.ok()) << report.status.message();
    EXPECT_THAT(report.warnings, Not(Contains(HasSubstr("not read"))));
    EXPECT_FALSE(reads_layer());
    // OpenEXR writes no part without a type into a file of several.
    const auto flat = io::ExrFile::open(out(2));
    ASSERT_TRUE(flat.ok()) << flat.status().message();
    ASSERT_EQ(flat->parts().size(), 2u);
    for (const io::ExrPart& part : flat->parts()) EXPECT_EQ(part.type, "scanlineimage");
}

// Samples are sorted by distance.
TEST_F(DeepTest, DepthThatDecreasesIsRefused) {
    Profile profile = *find_profile("generic");
    for (auto& source : profile.roles.at(Role::inverse_depth))
        source.depth = DepthEncoding::reverse;
    settings_.source.profile = profile;
    read(shot("deep"));
    EXPECT_THAT(failure(), HasSubstr("is deep, and its depth decreases with distance"));
}

}  // namespace
}  // namespace postchain::sequence
