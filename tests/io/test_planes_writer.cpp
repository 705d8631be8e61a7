#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <cstring>
#include <limits>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/planes_writer.h"

namespace postchain::io {
namespace {

using test::must;
using test::named;
using test::oiio_attributes;
using test::oiio_channels;
using test::OiioChannel;
using test::TempFolder;
using testing::IsEmpty;

TEST(PlanesWriter, TypesAttributesAndWindows) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    ImageF color(5, 3, 4);
    ImageF depth(5, 3, 1, 2.5f);
    for (size_t i = 0; i < color.data.size(); ++i) color.data[i] = float(i) / 8;
    PlanesFile file;
    file.channels = {{"ViewLayer.Combined.R", PixelType::half, &color, 0},
                     {"ViewLayer.Combined.A", PixelType::half, &color, 3},
                     {"ViewLayer.Depth.Z", PixelType::float32, &depth, 0},
                     {"id", PixelType::uint32, &color, 1}};
    file.attributes = {{"comment", "text"}, {"aperture", 2.8f}, {"frame", 7}};
    file.origin_x = -1;
    file.origin_y = 2;
    file.display_window = Window{0, 0, 9, 9};
    const auto report = must(write_planes_exr(path, file));
    const auto channels = oiio_channels(path);
    ASSERT_EQ(channels.size(), 4u);
    EXPECT_EQ(named(channels, "ViewLayer.Combined.R").type, "half");
    EXPECT_EQ(named(channels, "ViewLayer.Depth.Z").type, "float");
    EXPECT_EQ(named(channels, "id").type, "uint");
    const OiioChannel& alpha = named(channels, "ViewLayer.Combined.A");
    for (size_t p = 0; p < color.pixels(); ++p) {
        half h;
        std::memcpy(&h, alpha.bytes.data() + p * 2, 2);
        EXPECT_EQ(float(h), color.data[p * 4 + 3]);
    }
    const auto attributes = oiio_attributes(path);
    EXPECT_THAT(attributes, testing::Contains("windows = -1 2 5 3 of 0 0 10 10 tile 0 0"));
    EXPECT_THAT(attributes, testing::Contains("frame = 7"));
    const auto back = must(ExrFile::open(path));
    EXPECT_EQ(back.parts()[0].attributes.at("comment"), "text");
    EXPECT_EQ(back.parts()[0].attributes.at("aperture"), "2.8");
}

TEST(PlanesWriter, AWholeImageAsFloat) {
    const TempFolder folder;
    ImageF image(3, 2, 2);
    image.data = {1, 2, 3, 4, 5, 6, 7, 8, 9, 1e30f, std::numeric_limits<float>::infinity(), 12};
    const auto report = must(write_planes_exr(folder.path("f.exr"), image, {"x", "y"}));
    EXPECT_EQ(report.nonfinite_pixels, 1u);
    const auto back = must(ExrFile::open(folder.path("f.exr"))->read_channels(0, {"x", "y"}));
    EXPECT_TRUE(back == image);
}

TEST(PlanesWriter, SizesThatDifferAreADefectOfTheCaller) {
    const TempFolder folder;
    const ImageF a(3, 2, 1);
    const ImageF b(3, 3, 1);
    PlanesFile file;
    file.channels = {{"a", PixelType::half, &a, 0}, {"b", PixelType::half, &b, 0}};
    EXPECT_EQ(write_planes_exr(folder.path("f"), file).status().code(), StatusCode::internal);
    file.channels = {{"a", PixelType::half, &a, 1}};
    EXPECT_EQ(write_planes_exr(folder.path("f"), file).status().code(), StatusCode::internal);
    EXPECT_EQ(write_planes_exr(folder.path("f"), PlanesFile()).status().code(),
              StatusCode::internal);
    EXPECT_THAT(folder.names(), IsEmpty());
}

}  // namespace
}  // namespace postchain::io
