// Runs over non-EXR images: metadata of the input that is still true is in the output.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/io/exr_files.h"
#include "tests/run/pictures.h"
#include "tests/support/status.h"

namespace postchain::test::image_metadata_test {
namespace {

class ImageMetadataTest : public FormatsTest {
  protected:
    // Noise of 48x32 with these attributes at this position.
    Stored write_noise(const std::string& name, OIIO::ImageSpec more, OIIO::TypeDesc type = kByte) {
        const Kind kind{"", type, type == kByte ? 8 : 16, 3};
        const Stored picture = noise_of(kind, 48, 32);
        OIIO::ImageSpec spec(48, 32, 3, type);
        spec.extra_attribs = more.extra_attribs;
        spec.x = more.x;
        spec.y = more.y;
        spec.full_width = std::max(48, more.full_width);
        spec.full_height = std::max(32, more.full_height);
        auto out = OIIO::ImageOutput::create(at(name));
        EXPECT_TRUE(out && out->open(at(name), spec)) << OIIO::geterror();
        EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, picture.values.data()) && out->close());
        return read_picture(at(name));
    }
    bool notes_say(const std::string& name, const char* words) const {
        return sidecar_of(name)["write_notes"].dump().find(words) != std::string::npos;
    }
};

TEST_F(ImageMetadataTest, ATiffIsPackedAsItsInputWhereThatLosesNothing) {
    for (const auto& [compression, expected] :
         {std::pair{"jpeg", "zip"}, {"lzw", "lzw"}, {"none", "none"}}) {
        OIIO::ImageSpec more;
        more.attribute("compression", compression);
        const Stored in = write_noise("c.tif", more);
        // OpenImageIO 2.5 writes zip in place of JPEG.
        OIIO::ImageSpec given;
        read_picture(at("c.tif"), &given);
        const auto outcome = through("c.tif", "o.tif");
        ASSERT_EQ(outcome.code, 0) << outcome.said;
        OIIO::ImageSpec found;
        EXPECT_EQ(read_picture(at("out/o.tif"), &found).values, in.values) << compression;
        EXPECT_EQ(found.get_string_attribute("compression"), expected);
        EXPECT_EQ(notes_say("o.tif", "packed with zip, not with jpeg"),
                  given.get_string_attribute("compression") == "jpeg");
    }
}

// A 128-byte header with the signature of ICC.1 7.2 and no tags.
std::vector<uint8_t> icc_profile() {
    std::vector<uint8_t> profile(132, 0);
    profile[3] = 132;
    std::memcpy(profile.data() + 36, "acsp", 4);
    return profile;
}

TEST_F(ImageMetadataTest, AnIccProfileIsKeptWhereValuesMeanTheSame) {
    OIIO::ImageSpec more;
    const auto profile = icc_profile();
    more.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, int(profile.size())),
                   profile.data());
    write_noise("c.tif", more);
    const auto has_profile = [&](const Words& arguments) {
        const auto outcome = through("c.tif", "o.tif", arguments);
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        OIIO::ImageSpec found;
        read_picture(at("out/o.tif"), &found);
        EXPECT_NE(found.find_attribute("ICCProfile") != nullptr,
                  notes_say("o.tif", "the ICC profile is left out"));
        return found.find_attribute("ICCProfile") != nullptr;
    };
    EXPECT_TRUE(has_profile({}));
    EXPECT_TRUE(has_profile({"--input-transfer", "rec709"}));
    EXPECT_FALSE(has_profile({"--output-transfer", "gamma22"}));
    EXPECT_FALSE(has_profile({"--bits", "32"}));
}

TEST_F(ImageMetadataTest, APlaceOnAPageIsNoWindow) {
    for (const char* name : {"c.png", "c.dpx"}) {
        OIIO::ImageSpec more;
        more.x = 5;
        more.y = 7;
        more.attribute("XResolution", 72.f);
        more.attribute("YResolution", 72.f);
        const Stored in = write_noise(name, more, std::string(name) == "c.png" ? kByte : kShort);
        const auto outcome = through(name, name);
        ASSERT_EQ(outcome.code, 0) << outcome.said;
        EXPECT_EQ(read_picture(at(std::string("out/") + name)).values, in.values) << name;
        ASSERT_EQ(through(name, "o.exr").code, 0);
        EXPECT_EQ(read_color(at("out/o.exr")).width, 48) << name;
    }
}

TEST_F(ImageMetadataTest, ThePixelAspectStays) {
    const auto aspect_of = [&](const std::string& name) {
        return name.ends_with(".exr") ? must(io::ExrFile::open(at(name))).parts()[0].pixel_aspect
                                      : must(io::ImageFile::open(at(name))).parts()[0].pixel_aspect;
    };
    OIIO::ImageSpec anamorphic;
    anamorphic.attribute("PixelAspectRatio", 2.f);
    for (const char* name : {"c.png", "c.tif", "c.dpx"}) write_noise(name, anamorphic, kShort);
    test::write_file(at("c.exr"), {{.channels = {{"R"}, {"G"}, {"B"}},
                                    .edit = [](Imf::Header& h) { h.pixelAspectRatio() = 2; }}});
    for (const char* from : {"c.exr", "c.png", "c.tif", "c.dpx"}) {
        ASSERT_EQ(aspect_of(from), 2) << from;
        for (const std::string to : {"o.exr", "o.png", "o.tif", "o.dpx"}) {
            ASSERT_EQ(through(from, to, {"--overflow", "clamp"}).code, 0) << from << " " << to;
            EXPECT_EQ(aspect_of("out/" + to), 2) << from << " " << to;
        }
    }
}

TEST_F(ImageMetadataTest, APlaceInTheDisplayWindowStays) {
    OIIO::ImageSpec placed;
    placed.x = 5;
    placed.y = 3;
    placed.full_width = 64;
    placed.full_height = 40;
    write_noise("c.tif", placed);
    const io::ExrPart in = must(io::ImageFile::open(at("c.tif"))).parts()[0];
    EXPECT_EQ(in.data_window, (io::Window{5, 3, 52, 34}));
    EXPECT_EQ(in.display_window, (io::Window{0, 0, 63, 39}));
    ASSERT_EQ(through("c.tif", "o.exr").code, 0);
    const io::ExrPart out = must(io::ExrFile::open(at("out/o.exr"))).parts()[0];
    EXPECT_EQ(out.data_window, in.display_window) << "it grows, as those of cropped frames do";
    EXPECT_EQ(out.display_window, in.display_window);
    ASSERT_EQ(through("c.tif", "o.exr", {"--data-window", "keep"}).code, 0);
    const io::ExrPart kept = must(io::ExrFile::open(at("out/o.exr"))).parts()[0];
    EXPECT_EQ(kept.data_window, in.data_window);
    EXPECT_EQ(kept.display_window, in.display_window);
}

TEST_F(ImageMetadataTest, NoTimeIsInvented) {
    write_exr("in.exr", {{0.5f, 0.25f, 0.125f, 1}});
    for (const char* name : {"o.tif", "o.dpx"}) {
        ASSERT_EQ(through("in.exr", name).code, 0);
        OIIO::ImageSpec found;
        read_picture(at(std::string("out/") + name), &found);
        EXPECT_EQ(found.get_string_attribute("DateTime", "0000:00:00 00:00:00"),
                  "0000:00:00 00:00:00")
            << name;
    }
    OIIO::ImageSpec more;
    more.attribute("DateTime", "2013:07:19 12:00:00");
    write_noise("c.tif", more);
    ASSERT_EQ(through("c.tif", "o.tif").code, 0);
    OIIO::ImageSpec found;
    read_picture(at("out/o.tif"), &found);
    EXPECT_EQ(found.get_string_attribute("DateTime"), "2013:07:19 12:00:00");
}

TEST_F(ImageMetadataTest, PagesThatAreLeftOutAreNoted) {
    const std::vector<float> page(48 * 32 * 3, 0.5f);
    const OIIO::ImageSpec spec(48, 32, 3, kByte);
    auto out = OIIO::ImageOutput::create(at("c.tif"));
    ASSERT_TRUE(out->open(at("c.tif"), spec));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, page.data()));
    ASSERT_TRUE(out->open(at("c.tif"), spec, OIIO::ImageOutput::AppendSubimage));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, page.data()) && out->close());
    for (const char* name : {"o.tif", "o.exr"}) {
        ASSERT_EQ(through("c.tif", name).code, 0);
        EXPECT_TRUE(notes_say(name, "the input has several pages"));
    }
    write_noise("one.tif", {});
    ASSERT_EQ(through("one.tif", "o.tif").code, 0);
    EXPECT_FALSE(notes_say("o.tif", "pages"));
}

TEST_F(ImageMetadataTest, ChannelsOfEveryPartThatAreLeftOutAreCounted) {
    write_file(at("in.exr"),
               {{.name = "beauty", .channels = {{"R"}, {"G"}, {"B"}, {"key.R"}}},
                {.name = "data", .channels = {{"Z", Imf::FLOAT}, {"id", Imf::UINT}}}});
    const auto outcome = through("in.exr", "o.tif");
    ASSERT_EQ(outcome.code, 0) << outcome.said;
    EXPECT_TRUE(notes_say("o.tif", "3 channels other than color"));
}

TEST_F(ImageMetadataTest, WhatAFileDoesNotSayOfItsCurveIsNoted) {
    // Dark enough that curves differing by more than eight bits are wrong.
    write_exr("in.exr", std::vector<std::array<float, 4>>(16, {0.02f, 0.02f, 0.02f, 1}));
    int noted = 0;
    for (const char* name : {"o.png", "o.tif", "o.dpx", "o.jpg", "o.hdr"})
        for (const char* curve : {"linear", "srgb", "rec709", "gamma22", "cineon"}) {
            Words more = {"--output-transfer", curve};
            if (std::string(name) == "o.tif") more.insert(more.end(), {"--bits", "16"});
            const auto outcome = through("in.exr", name, more);
            ASSERT_EQ(outcome.code, 0) << outcome.said;
            // Either it reads back as the same light, or a note was printed.
            ASSERT_EQ(through("out/" + std::string(name), "back.exr").code, 0);
            const bool same = std::abs(read_color(at("out/back.exr")).data[0] / 0.02f - 1) < 0.1f;
            const bool says = outcome.says("does not say that its values are");
            EXPECT_NE(same, says) << name << " " << curve;
            noted += says;
        }
    EXPECT_EQ(noted, 4 + 4 + 4 + 1);
}

TEST_F(ImageMetadataTest, EveryCodeOf16BitsComesBackThroughEveryCurve) {
    Stored ramp{256, 256, 3, {}};
    for (int i = 0; i < 65536; ++i)
        for (int c = 0; c < 3; ++c) ramp.values.push_back(float((i * (1 + c)) % 65536) / 65535);
    write_picture(at("c.png"), {"c.png", kShort, 16, 3}, ramp);
    const Stored in = read_picture(at("c.png"));
    for (const char* curve : {"linear", "srgb", "rec709", "gamma22"}) {
        const auto outcome = through("c.png", "o.png", {"--input-transfer", curve});
        ASSERT_EQ(outcome.code, 0) << outcome.said;
        EXPECT_EQ(read_picture(at("out/o.png")).values, in.values) << curve;
    }
}

}  // namespace
}  // namespace postchain::test::image_metadata_test
