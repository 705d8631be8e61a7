// Limits on headers of formats other than EXR: a case for each limit of docs/testing.md, with the
// largest allocation.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "exr_files.h"
#include "largest_allocation.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::test {
namespace {

using testing::HasSubstr;

class HostileImage : public testing::Test {
  protected:
    std::string bytes_of(const std::string& name, const OIIO::ImageSpec& given) {
        OIIO::ImageSpec spec = given;
        const std::string path = folder_.path("made_" + name);
        const std::vector<float> values(
            size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels), 0.5f);
        const auto out = OIIO::ImageOutput::create(path);
        EXPECT_TRUE(out && out->open(path, spec) &&
                    out->write_image(OIIO::TypeDesc::FLOAT, values.data()) && out->close())
            << OIIO::geterror();
        return read_text(path);
    }
    // Why the file cannot be read; empty: it can. Expects no large allocation before a failure.
    std::string fault_of(const std::string& name, const std::string& bytes) {
        const std::string path = folder_.path(name);
        write_text(path, bytes);
        forget_allocations();
        auto file = io::ImageFile::open(path);
        Status status = file.status();
        if (file.ok()) status = file->read_part(0).status();
        if (!status.ok()) {
            EXPECT_LT(largest_allocation(), size_t(2) << 20) << name << ": " << status.message();
        }
        return status.message();
    }
    TempFolder folder_;
};

std::string big(uint32_t v) {
    return {char(v >> 24), char(v >> 16), char(v >> 8), char(v)};
}

Bytef* bytes(std::string& text) {
    return reinterpret_cast<Bytef*>(text.data());
}

std::string chunk(const std::string& type, const std::string& body) {
    std::string whole = type + body;
    const auto sum = uint32_t(crc32(0, bytes(whole), uInt(whole.size())));
    return big(uint32_t(body.size())) + whole + big(sum);
}

std::string packed(std::string text) {
    uLongf size = compressBound(text.size());
    std::string to(size, '\0');
    EXPECT_EQ(compress(bytes(to), &size, bytes(text), text.size()), Z_OK);
    return to.substr(0, size);
}

constexpr size_t kAfterHeader = 8 + 12 + 13;  // of a PNG: signature and IHDR

std::string with_size(const std::string& png, uint32_t width, uint32_t height) {
    return png.substr(0, 8) + chunk("IHDR", big(width) + big(height) + png.substr(24, 5)) +
           png.substr(kAfterHeader);
}

// The value of a tag of a little-endian TIFF with one directory.
std::string with_tag(std::string tiff, uint16_t tag, uint32_t value) {
    const auto number = [&](size_t at, int count) {
        uint32_t v = 0;
        for (int i = count; i-- > 0;) v = v << 8 | uint8_t(tiff[at + size_t(i)]);
        return v;
    };
    const size_t directory = number(4, 4);
    for (uint32_t i = 0; i < number(directory, 2); ++i) {
        const size_t at = directory + 2 + 12 * size_t(i);
        if (number(at, 2) != tag) continue;
        tiff[at + 2] = 4;  // a long
        for (size_t k = 0; k < 4; ++k) tiff[at + 8 + k] = char(value >> (8 * k));
        return tiff;
    }
    ADD_FAILURE() << "no tag " << tag;
    return tiff;
}

TEST_F(HostileImage, MorePixelsThanTheFileCanHold) {
    const OIIO::ImageSpec small(16, 16, 3, OIIO::TypeDesc::UINT8);
    const std::string png = bytes_of("a.png", small);
    EXPECT_EQ(fault_of("a.png", png), "");
    EXPECT_THAT(fault_of("b.png", with_size(png, 16384, 16384)), HasSubstr("bytes can hold"));
    for (const char* packing : {"none", "lzw", "zip", "packbits"}) {
        OIIO::ImageSpec spec = small;
        spec.attribute("compression", packing);
        const std::string tiff = bytes_of("a.tif", spec);
        EXPECT_EQ(fault_of("a.tif", tiff), "") << packing;
        EXPECT_THAT(fault_of("b.tif", with_tag(with_tag(tiff, 256, 16000), 257, 16000)),
                    HasSubstr("bytes can hold"))
            << packing;
    }
    std::string jpeg = bytes_of("a.jpg", small);
    EXPECT_EQ(fault_of("a.jpg", jpeg), "");
    for (const size_t missing : {1, 2})
        EXPECT_THAT(fault_of("b.jpg", jpeg.substr(0, jpeg.size() - missing)),
                    HasSubstr("truncated"));
    const size_t frame = jpeg.find("\xff\xc0");
    ASSERT_NE(frame, std::string::npos);
    jpeg.replace(frame + 5, 4, "\x3e\x80\x3e\x80");  // 16000 x 16000
    EXPECT_THAT(fault_of("b.jpg", jpeg), HasSubstr("bytes can hold"));
    EXPECT_THAT(fault_of("b.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n" +
                                      std::string(1000, '\2')),
                HasSubstr("bytes can hold"));
    std::string dpx = bytes_of("a.dpx", small);
    EXPECT_EQ(fault_of("a.dpx", dpx), "");
    const bool little = dpx[0] == 'X';
    std::string side = big(16000);
    if (little) std::reverse(side.begin(), side.end());
    EXPECT_THAT(fault_of("b.dpx", std::string(dpx).replace(772, 4, side).replace(776, 4, side)),
                HasSubstr("truncated"));
}

TEST_F(HostileImage, TextsAndDataThatBecomeMoreThanTheirLimit) {
    const std::string png = bytes_of("a.png", {16, 16, 3, OIIO::TypeDesc::UINT8});
    const auto with = [&](const std::string& chunks) {
        return fault_of("b.png", std::string(png).insert(kAfterHeader, chunks));
    };
    // 9 MB of nothing each, in 9 KB.
    const std::string text =
        chunk("zTXt", std::string("Comment\0\0", 9) + packed(std::string(9000000, '\0')));
    EXPECT_EQ(with(text), "");
    std::string texts;
    for (int i = 0; i < 8; ++i) texts += text;
    EXPECT_THAT(with(texts), HasSubstr("more than 64 MiB"));
    // With a language and a translated keyword; one that is not packed; some that end too early.
    const auto international = [](const std::string& head, size_t size) {
        return chunk("iTXt", head + packed(std::string(size, '\0')));
    };
    const std::string head("Comment\0\1\0en\0Kommentar\0", 23), plain("Comment\0\0\0\0\0", 12);
    EXPECT_EQ(with(international(head, 9000000)), "");
    EXPECT_THAT(with(international(head, 67108864)), HasSubstr("more than 64 MiB"));
    EXPECT_THAT(with(international(plain, 67108864)), testing::Not(HasSubstr("64 MiB")));
    for (const size_t end : {3, 8, 9, 10, 12, 16})
        EXPECT_THAT(with(chunk("iTXt", head.substr(0, end))), testing::Not(HasSubstr("64 MiB")));
    EXPECT_THAT(with(chunk("zTXt", "Comment")), testing::Not(HasSubstr("64 MiB")));
    // A profile with a stated size of 1.9 GB and few packed bytes.
    const std::string profile = big(0x70000000) + std::string(200, '\0');
    EXPECT_THAT(with(chunk("iCCP", std::string("p\0\0", 3) + packed(profile))),
                HasSubstr("more than 64 MiB"));
    EXPECT_THAT(with(big(0x70000000) + "tEXtComment"), HasSubstr("a part of 1879048192 bytes"));
    // A number in a text: read, or refused by name.
    EXPECT_THAT(with(chunk("tEXt", std::string("oiio:BitsPerSample\0", 19) + "40")),
                testing::AnyOf("", HasSubstr("40 bits")));
    OIIO::ImageSpec spec(16, 16, 3, OIIO::TypeDesc::UINT8);
    for (const char* order : {"big", "little"})
        for (const uint32_t stated : {0x70000000, 0x10000}) {
            spec.attribute("oiio:Endian", order);
            const std::string dpx = bytes_of("a.dpx", spec);
            std::string size = big(stated);
            if (dpx[0] == 'X') std::reverse(size.begin(), size.end());
            EXPECT_THAT(fault_of("b.dpx", std::string(dpx).replace(32, 4, size)),
                        HasSubstr(concat("states ", stated, " bytes of data of its writer")));
        }
}

TEST_F(HostileImage, OtherFormatsTypesAndChannels) {
    const std::string png = bytes_of("a.png", {16, 16, 3, OIIO::TypeDesc::UINT8});
    EXPECT_THAT(fault_of("a.tif", png), HasSubstr("the format png, and its name says tiff"));
    EXPECT_THAT(fault_of("b.png", std::string(png).replace(1, 1, "p")),
                HasSubstr("not of the format of its name"));
    EXPECT_NE(fault_of("c.png", ""), "");
    for (const auto& [channels, type, why] :
         {std::tuple(1, OIIO::TypeDesc::UINT8, "has 1 channels"),
          {2, OIIO::TypeDesc::UINT8, "has 2 channels"},
          {5, OIIO::TypeDesc::UINT8, "has 5 channels"},
          {3, OIIO::TypeDesc::DOUBLE, "has values of the type double"},
          {3, OIIO::TypeDesc::UINT32, "has values of the type uint"},
          {3, OIIO::TypeDesc::HALF, ""},
          {4, OIIO::TypeDesc::UINT16, ""}}) {
        const std::string fault = fault_of("d.tif", bytes_of("d.tif", {16, 16, channels, type}));
        EXPECT_THAT(fault, HasSubstr(why));
        EXPECT_EQ(fault.empty(), *why == 0) << fault;
    }
}

// OpenImageIO gives what is in memory for what is missing.
TEST_F(HostileImage, EveryFormOfDpxEndsWithItsLastPixel) {
    for (const char* order : {"big", "little"})
        for (const char* packing : {"Packed", "Filled, method A"})
            for (const int bits : {8, 10, 12, 16}) {
                SCOPED_TRACE(testing::Message() << order << " " << packing << " " << bits);
                OIIO::ImageSpec spec(17, 16, 3,
                                     bits == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
                spec.attribute("oiio:BitsPerSample", bits);
                spec.attribute("oiio:Endian", order);
                spec.attribute("dpx:Packing", packing);
                const std::string dpx = bytes_of("a.dpx", spec);
                EXPECT_EQ(dpx[0], *order == 'b' ? 'S' : 'X');
                EXPECT_EQ(fault_of("a.dpx", dpx), "");
                EXPECT_THAT(fault_of("b.dpx", dpx.substr(0, dpx.size() - 4)),
                            HasSubstr("truncated"));
            }
    EXPECT_NE(fault_of("c.dpx", std::string("SDPX\0\0\0\0", 8)), "");
}

TEST_F(HostileImage, TilesLargerThanTheirLimit) {
    OIIO::ImageSpec spec(32, 32, 3, OIIO::TypeDesc::UINT8);
    spec.tile_width = spec.tile_height = 16;
    const std::string tiff = bytes_of("a.tif", spec);
    EXPECT_EQ(fault_of("a.tif", tiff), "");
    EXPECT_THAT(fault_of("b.tif", with_tag(with_tag(tiff, 322, 1 << 16), 323, 1 << 16)),
                HasSubstr("tiles"));
    EXPECT_THAT(fault_of("c.tif", with_tag(with_tag(tiff, 322, 8192), 323, 8192)),
                HasSubstr("bytes can hold"));
}

}  // namespace
}  // namespace postchain::test
