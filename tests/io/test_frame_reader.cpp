#include <ImfChromaticities.h>
#include <ImfRgbaYca.h>
#include <ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::io::test_frame_reader {
namespace {

using test::FilePart;
using test::must;
using test::sample_value;
using test::TempFolder;
using test::write_file;
using testing::ElementsAre;
using testing::HasSubstr;

using FrameReader = InOut;
using LumaWeights = InOut;

FilePart cycles() {
    FilePart part{
        .channels = {{"V.Combined.R"}, {"V.Combined.G"}, {"V.Combined.B"}, {"V.Combined.A"}},
        .data = {{-2, -1}, {13, 9}},
        .display = {{0, 0}, {11, 7}}};
    for (const char* name : {"Depth.Z", "Vector.X", "Vector.Y", "Vector.Z", "Vector.W"})
        part.channels.push_back({std::string("V.") + name, Imf::FLOAT});
    return part;
}

const FrameChannels kCycles = {
    {Role::color, {0, {"V.Combined.R", "V.Combined.G", "V.Combined.B", "V.Combined.A"}}},
    {Role::inverse_depth, {0, {"V.Depth.Z"}}},
    {Role::motion, {0, {"V.Vector.Z", "V.Vector.W"}}},
    {Role::motion_back, {0, {"V.Vector.X", "V.Vector.Y"}}}};

StoredFrame read_ok(const std::map<Role, std::string>& files, const FrameChannels& roles,
                    RoleSet wanted, Keep keep = Keep::nothing) {
    return must(read_frame(must(open_frame(files, 17)), roles, wanted, keep));
}

TEST_F(FrameReader, PlanesInTheFilesOwnConvention) {
    const FilePart part = cycles();
    write_file(in, {part});
    const StoredFrame frame =
        read_ok({{Role::color, in}}, kCycles,
                {Role::color, Role::inverse_depth, Role::motion, Role::motion_back}, Keep::all);
    EXPECT_EQ(frame.window, (Window{-2, -1, 13, 9}));
    EXPECT_EQ(frame.kept->planes.size(), 9u);
    EXPECT_FALSE(frame.half_depth);
    const std::map<Role, std::vector<size_t>> expected = {{Role::color, {0, 1, 2, 3}},
                                                          {Role::inverse_depth, {4}},
                                                          {Role::motion, {7, 8}},
                                                          {Role::motion_back, {5, 6}}};
    ASSERT_EQ(frame.planes.size(), expected.size());
    for (const auto& [role, channels] : expected) {
        const ImageF& plane = frame.planes.at(role);
        ASSERT_EQ(plane.channels, int(channels.size()));
        for (int y = 0; y < plane.height; ++y)
            for (int x = 0; x < plane.width; ++x)
                for (size_t c = 0; c < channels.size(); ++c)
                    ASSERT_EQ(plane.at(x, y, int(c)),
                              sample_value(part, channels[c], x - 2, y - 1));
    }
}

TEST_F(FrameReader, ReadsOnlyWhatIsWanted) {
    FilePart part = cycles();
    part.channels[4].type = Imf::HALF;
    write_file(in, {part});
    FrameChannels roles = kCycles;
    roles[Role::color].channels.pop_back();
    const StoredFrame frame = read_ok({{Role::color, in}}, roles, {Role::inverse_depth});
    EXPECT_EQ(frame.planes.size(), 2u);
    EXPECT_TRUE(frame.planes.contains(Role::inverse_depth));
    EXPECT_EQ(frame.kept, nullptr);
    EXPECT_TRUE(frame.half_depth);
    // Alpha that is not there is one.
    ASSERT_EQ(frame.planes.at(Role::color).channels, 4);
    EXPECT_EQ(frame.planes.at(Role::color).at(3, 3, 3), 1);
}

TEST_F(FrameReader, PlanesInPartsOfLargerWindowsAreCropped) {
    FilePart color{.name = "rgb", .channels = {{"R"}, {"G"}, {"B"}}, .data = {{2, 1}, {7, 5}}};
    FilePart depth{
        .name = "depth", .channels = {{"Z", Imf::FLOAT}}, .data = {{-3, 0}, {9, 9}}, .tile = 4};
    write_file(in, {color, depth});
    const FrameChannels roles = {{Role::color, {0, {"R", "G", "B"}}},
                                 {Role::inverse_depth, {1, {"Z"}}}};
    const StoredFrame frame = read_ok({{Role::color, in}}, roles, {Role::inverse_depth});
    const ImageF& z = frame.planes.at(Role::inverse_depth);
    ASSERT_EQ(z.width, 6);
    ASSERT_EQ(z.height, 5);
    EXPECT_EQ(z.at(0, 0), sample_value(depth, 0, 2, 1));
    EXPECT_EQ(z.at(5, 4), sample_value(depth, 0, 7, 5));

    // One column or row is missing.
    for (const Imath::Box2i& window :
         {Imath::Box2i{{3, 0}, {9, 9}}, {{-3, 0}, {6, 9}}, {{-3, 2}, {9, 9}}, {{-3, 0}, {9, 4}}}) {
        depth.data = window;
        write_file(in, {color, depth});
        const auto bad = read_frame(must(open_frame({{Role::color, in}}, 1)), roles,
                                    {Role::inverse_depth}, Keep::nothing);
        const auto& [min, max] = std::pair(window.min, window.max);
        EXPECT_THAT(bad.status().message(), HasSubstr(concat("(", min.x, ", ", min.y, ")-(", max.x,
                                                             ", ", max.y, "), does not cover")));
    }
}

// Counts how often the pixels of its part are read.
class CountedFile : public PixelFile {
  public:
    CountedFile() {
        ExrPart& part = parts_.emplace_back();
        part.data_window = {0, 0, 2, 1};
        for (const auto& [role, from] : kCycles)
            for (const auto& name : from.channels) part.channels.push_back({name});
    }
    int rows_at_once(int) const override { return 1; }
    int reads = 0;

  private:
    Status read_planes(PartPixels& pixels) override {
        for (auto& plane : pixels.planes)
            std::fill_n(plane.bytes.get(), plane.total_bytes(), std::byte(0));
        ++reads;
        return {};
    }
};

TEST_F(FrameReader, EveryPartIsReadOnce) {
    const auto file = std::make_shared<CountedFile>();
    const FrameFiles files{.files = {{Role::color, file}}};
    const RoleSet all = {Role::color, Role::inverse_depth, Role::motion, Role::motion_back};
    EXPECT_EQ(must(read_frame(files, kCycles, all, Keep::nothing)).planes.size(), 4u);
    EXPECT_EQ(file->reads, 1);
}

TEST_F(FrameReader, PlanesInFilesOfTheirOwn) {
    FilePart color{.channels = {{"R"}, {"G"}, {"B"}}};
    FilePart depth{.channels = {{"R", Imf::FLOAT}}};
    FilePart motion{.channels = {{"R", Imf::FLOAT}, {"G", Imf::FLOAT}}};
    write_file(folder.path("c.exr"), {color});
    write_file(folder.path("d.exr"), {depth});
    write_file(folder.path("m.exr"), {motion});
    const StoredFrame frame = read_ok({{Role::color, folder.path("c.exr")},
                                       {Role::inverse_depth, folder.path("d.exr")},
                                       {Role::motion, folder.path("m.exr")}},
                                      {{Role::color, {0, {"R", "G", "B"}}},
                                       {Role::inverse_depth, {0, {"R"}}},
                                       {Role::motion, {0, {"R", "G"}}}},
                                      {Role::inverse_depth, Role::motion}, Keep::all);
    EXPECT_EQ(frame.planes.at(Role::inverse_depth).at(4, 5), sample_value(depth, 0, 4, 5));
    EXPECT_EQ(frame.planes.at(Role::motion).at(4, 5, 1), sample_value(motion, 1, 4, 5));
    EXPECT_EQ(frame.kept->planes.size(), 3u) << "color's file alone is written back";
}

std::array<double, 3> weights_in_file(const std::string& in, const Imf::Chromaticities* c) {
    FilePart part = cycles();
    if (c != nullptr) part.edit = [c](Imf::Header& h) { Imf::addChromaticities(h, *c); };
    write_file(in, {part});
    return luma_weights(must(open_pixels(in))->parts()[0].chromaticities);
}

TEST_F(LumaWeights, ComeFromTheFilesPrimaries) {
    EXPECT_THAT(weights_in_file(in, nullptr), ElementsAre(0.2126, 0.7152, 0.0722));
    // Rec. 709, ACES AP1, ACES AP0, against OpenEXR's own computation.
    const Imf::Chromaticities rec709;
    const Imf::Chromaticities ap1({0.713f, 0.293f}, {0.165f, 0.830f}, {0.128f, 0.044f},
                                  {0.32168f, 0.33767f});
    const Imf::Chromaticities ap0({0.7347f, 0.2653f}, {0, 1}, {0.0001f, -0.077f},
                                  {0.32168f, 0.33767f});
    for (const Imf::Chromaticities& c : {rec709, ap1, ap0}) {
        const std::array<double, 3> w = weights_in_file(in, &c);
        const Imath::V3f expected = Imf::RgbaYca::computeYw(c);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(w[size_t(i)], expected[i], 1e-5);
    }
}

TEST_F(LumaWeights, DegeneratePrimariesFallBackToRec709) {
    EXPECT_THAT(luma_weights({{0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f}}),
                ElementsAre(0.2126, 0.7152, 0.0722));
    EXPECT_THAT(luma_weights({{0.64f, 0, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f}}),
                ElementsAre(0.2126, 0.7152, 0.0722));
}

}  // namespace
}  // namespace postchain::io::test_frame_reader
