// Deep parts as flat ones: against OpenImageIO's flatten, and files that are damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "tests/io/exr_files.h"
#include "tests/io/largest_allocation.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::io::test_deep_reader {
namespace {

using test::bytes_of_file;
using test::FilePart;
using test::MemoryFile;
using test::must;
using test::TempFolder;
using test::write_file;
using testing::AllOf;
using testing::HasSubstr;

// Up to five sorted samples in each pixel, and none in some; the last one may be opaque.
FilePart deep_part(const std::string& name = {}) {
    FilePart part{.name = name,
                  .data = {{-3, 5}, {27, 24}},
                  .display = {{0, 0}, {31, 31}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    part.channels = {{"A"}, {"B", Imf::FLOAT}, {"G"},
                     {"R"}, {"Z", Imf::FLOAT}, {"id.R", Imf::UINT}};
    part.samples = [](int x, int y, size_t channel) {
        std::minstd_rand random(unsigned(1000 + x * 64 + y));
        random.discard(5);
        const size_t count = random() % 6;
        std::vector<float> values;
        for (size_t s = 0; s < count; ++s) {
            const float alpha =
                s + 1 == count && random() % 2 ? 1.0F : float(random() % 15) / 16.0F;
            const float color[] = {alpha, 2 * alpha, alpha / 2, alpha * float(s + 1)};
            values.push_back(channel < 4    ? color[channel]
                             : channel == 4 ? 1 + float(s) * 1.5F + float(random() % 8) / 16
                                            : float(7 * s + 1));
            if (channel < 4) random();
        }
        return values;
    };
    return part;
}

Result<PartPixels> read(const std::string& path, bool behind = false, int part = 0) {
    Result<ExrFile> file = ExrFile::open(path);
    if (!file.ok()) return file.status();
    file->flattening.behind = behind;
    return file->read_part(part);
}

std::vector<float> values_of(const PartPixels& pixels, const std::string& channel) {
    return pixels.interleaved({channel}, pixels.window).data;
}

const auto kCompressions = {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION};

TEST(DeepReader, FlattensAsOpenImageIoDoesWholeAndInRows) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    for (const auto compression : kCompressions)
        for (const int tile : {0, 8}) {
            SCOPED_TRACE(concat("compression ", int(compression), ", tile ", tile));
            FilePart part = deep_part();
            part.compression = compression;
            part.tile = tile;
            write_file(path, {part});
            auto file = must(ExrFile::open(path));
            const auto pixels = must(file.read_part(0));
            for (const char* channel : {"R", "G", "B", "A"}) {
                const std::vector<float> own = values_of(pixels, channel),
                                         theirs = test::oiio_flattened(path, channel);
                const double tolerance = *channel == 'B' ? 1e-6 : 1e-3;
                ASSERT_EQ(own.size(), theirs.size());
                for (size_t i = 0; i < own.size(); ++i)
                    ASSERT_NEAR(own[i], theirs[i], tolerance * std::abs(theirs[i])) << channel << i;
            }
            // Depth is one sample's, and so is an integer, whatever its name.
            const std::vector<float> depth = values_of(pixels, "Z"), id = values_of(pixels, "id.R");
            size_t i = 0;
            for (int y = 5; y <= 24; ++y)
                for (int x = -3; x <= 27; ++x, ++i) {
                    const std::vector<float> depths = part.samples(x, y, 4);
                    const auto found = std::find(depths.begin(), depths.end(), depth[i]);
                    if (depths.empty())
                        ASSERT_TRUE(depth[i] == 1e10F && id[i] == 0) << x << " " << y;
                    else
                        ASSERT_EQ(id[i], float(7 * (found - depths.begin()) + 1)) << x << " " << y;
                }
            // A part of the lines has the values of the whole.
            for (const bool behind : {false, true}) {
                file.flattening.behind = behind;
                const auto whole = must(file.read_part(0));
                const auto rows = must(file.read_part(0, {"R", "Z"}, Window{-3, 11, 27, 14}));
                EXPECT_LT(rows.window.height(), whole.window.height());
                for (const char* channel : {"R", "Z"})
                    EXPECT_EQ(whole.interleaved({channel}, rows.window).data,
                              values_of(rows, channel));
            }
        }
}

// A file of one row: the samples of each pixel, each with a value for each channel.
using Samples = std::vector<std::vector<float>>;
std::string write_row(const TempFolder& folder, const std::vector<test::FileChannel>& channels,
                      const std::vector<Samples>& pixels) {
    const std::string path = folder.path("f.exr");
    FilePart part{.channels = channels,
                  .data = {{0, 0}, {int(pixels.size()) - 1, 0}},
                  .compression = Imf::ZIPS_COMPRESSION,
                  .deep = true};
    part.display = part.data;
    part.samples = [&](int x, int, size_t channel) {
        std::vector<float> values;
        for (const auto& sample : pixels[size_t(x)]) values.push_back(sample[channel]);
        return values;
    };
    write_file(path, {part});
    return path;
}

const std::vector<test::FileChannel> kAlphaRedDepth = {{"A"}, {"R"}, {"Z", Imf::FLOAT}};
using V = std::vector<float>;

// Flat color comes first, except a cryptomatte's preview.
TEST(DeepReader, DeepColorIsUsedIfThereIsNoOther) {
    const TempFolder folder;
    const std::string path = folder.path("f.exr");
    const std::vector<const char*> rgba = {"A", "B", "G", "R"};
    for (const auto& [layer, words, is_color] : {std::tuple("CryptoObject00", rgba, false),
                                                 {"uCryptoAsset00", rgba, false},
                                                 {"diffuse", rgba, true},
                                                 {"small", {"a", "b", "g", "r"}, true},
                                                 {"gray", {"A", "B", "R", "Y"}, false},
                                                 {"warm", {"A", "G", "R", "Y"}, false}}) {
        FilePart flat{.name = "flat", .data = {{-3, 5}, {27, 24}}, .display = {{0, 0}, {31, 31}}};
        for (const char* word : words)
            flat.channels.push_back({concat(layer, ".", word), Imf::FLOAT});
        write_file(path, {deep_part("deep"), flat});
        const FileChannels found = channels_of(must(ExrFile::open(path)));
        ASSERT_EQ(found.parts.size(), 2u);
        EXPECT_EQ(found.parts[0].channels.empty(), is_color) << layer;
        EXPECT_EQ(found.parts[1].channels.size(), 4u) << layer;
    }
}

TEST(DeepReader, ShowsWhatIsBehind) {
    const TempFolder folder;
    std::vector<test::FileChannel> channels = kAlphaRedDepth;
    channels.push_back({"ZBack", Imf::FLOAT});
    channels.push_back({"motion.x", Imf::FLOAT});
    // An edge before a wall; a wall before another, from back to front; a wall; nothing.
    const std::string path = write_row(folder, channels,
                                       {{{.75F, 3, 1, 1, 10}, {1, 8, 4, 4, -1}},
                                        {{1, 5, 9, 9, 2}, {1, 6, 4, 4, 3}},
                                        {{1, 7, 4, 4.5F, 1}},
                                        {}});
    const auto front = read(path), behind = read(path, true);
    ASSERT_TRUE(front.ok() && behind.ok());
    const std::tuple<const char*, V, V> expected[] = {
        {"R", {5, 6, 7, 0}, {8, 5, 7, 0}},
        {"A", {1, 1, 1, 0}, {1, 1, 1, 0}},
        {"Z", {1, 4, 4, 1e10F}, {4, 9, 4, 1e10F}},
        {"ZBack", {1, 4, 4.5F, 1e10F}, {4, 9, 4.5F, 1e10F}},
        {"motion.x", {10, 3, 1, 0}, {-1, 2, 1, 0}}};
    for (const auto& [channel, shown, hidden] : expected) {
        EXPECT_EQ(values_of(*front, channel), shown) << channel;
        EXPECT_EQ(values_of(*behind, channel), hidden) << channel;
    }
}

TEST(DeepReader, DepthOfEveryTypeSortsTheSamples) {
    const TempFolder folder;
    for (const auto& [type, nothing] :
         {std::pair(Imf::FLOAT, 1e10F), {Imf::HALF, INFINITY}, {Imf::UINT, 0.0F}}) {
        std::vector<test::FileChannel> channels = kAlphaRedDepth;
        channels[2].type = type;
        const auto flat = must(read(write_row(folder, channels, {{{1, 5, 9}, {1, 6, 4}}, {}})));
        EXPECT_EQ(values_of(flat, "R"), (V{6, 0})) << type;
        EXPECT_EQ(values_of(flat, "Z"), (V{4, nothing})) << type;
    }
}

// A half that overflows is infinite, as in a flat file; a hidden NaN does not count.
TEST(DeepReader, KeepsValuesThatAreNotFinite) {
    const TempFolder folder;
    const auto pixel =
        read(write_row(folder, kAlphaRedDepth,
                       {{{.5F, 60000, 1}, {1, 60000, 2}},
                        {{1, 1, 1}, {1, NAN, 2}},
                        {{.5F, NAN, NAN}},
                        {{.5F, NAN, 1}, {1, 1, 2}},
                        {{0, 8, 1}, {1, 65504, 2}},  // 65512 is nearer to 65504 than to 65536
                        {{.5F, 1, 1}, {1, 1, 2}, {1, NAN, 3}},
                        {{1, -0.0F, 1}}}));
    ASSERT_TRUE(pixel.ok());
    const V red = values_of(*pixel, "R");
    EXPECT_EQ(red[0], INFINITY);
    EXPECT_EQ(red[1], 1);
    EXPECT_TRUE(std::isnan(red[2]));
    EXPECT_TRUE(std::isnan(values_of(*pixel, "Z")[2]));
    EXPECT_TRUE(std::isnan(red[3]));
    EXPECT_EQ(red[4], 65504);
    EXPECT_EQ(red[5], 1.5F);
    EXPECT_TRUE(std::signbit(red[6])) << "the bits of a sample that is shown alone";
}

// Every byte of its chunks changed: an error that names the place, or other values, but never more
// memory than the file accounts for. CompleteFile has every end of the file.
TEST(DeepReader, DamagedFilesAreRefused) {
    for (const int tile : {0, 8})
        for (const auto compression : kCompressions) {
            FilePart part = deep_part();
            part.data = {{0, 0}, {8, 3}};
            part.compression = compression;
            part.tile = tile;
            const std::string whole = bytes_of_file({part});
            MemoryFile file;
            test::forget_allocations();
            size_t refused = 0, unpacked = 0;
            for (size_t at = whole.size() * 2 / 5; at < whole.size(); ++at)
                for (const int bits : {1, 255}) {
                    std::string bytes = whole;
                    bytes[at] = char(bytes[at] ^ bits);
                    file.set(bytes);
                    const Status status = read(file.path()).status();
                    if (status.ok()) continue;
                    ++refused;
                    unpacked += status.message().find("cannot be unpacked") != std::string::npos;
                    ASSERT_EQ(status.code(), StatusCode::input);
                }
            EXPECT_GT(refused, 50u);
            EXPECT_EQ(unpacked > 10, compression != Imf::NO_COMPRESSION) << unpacked;
            EXPECT_LT(test::largest_allocation(), size_t(4) << 20);
        }
}

// The sizes that a chunk states.
TEST(DeepReader, ImpossibleSizesAreRefusedBeforeTheyAreAllocated) {
    FilePart part{.channels = {{"A", Imf::FLOAT}, {"R", Imf::FLOAT}, {"Z", Imf::FLOAT}},
                  .data = {{0, 0}, {3, 0}},
                  .display = {{0, 0}, {3, 0}},
                  .compression = Imf::NO_COMPRESSION,
                  .deep = true};
    part.samples = [](int, int, size_t) { return std::vector<float>{1, 2}; };
    const std::string whole = bytes_of_file({part});
    // One chunk: line, three sizes, four running sums, eight samples of twelve bytes.
    const size_t sizes = whole.size() - 8 * 12 - 16 - 24;
    MemoryFile file;
    const auto error_of = [&](size_t at, auto value) {
        std::string bytes = whole;
        std::memcpy(bytes.data() + at, &value, sizeof(value));
        file.set(bytes);
        test::forget_allocations();
        const Status status = read(file.path()).status();
        EXPECT_LT(test::largest_allocation(), size_t(4) << 20);
        EXPECT_EQ(status.code(), StatusCode::input);
        return status.message();
    };
    EXPECT_THAT(error_of(sizes + 16, uint64_t(1) << 43),
                AllOf(HasSubstr("a deep chunk states 8796093022208 bytes of samples"),
                      HasSubstr("has 96 in the file"), HasSubstr("copy or render it again")));
    EXPECT_THAT(error_of(sizes, uint64_t(12)), HasSubstr("lines 0 to 0: damaged: its size"));
    for (const auto& [at, value, why] :
         {std::tuple(24, -1, "are no running sums"),
          {28, 1, "are no running sums"},
          {36, 2000000000, "its sample counts and the size of its samples differ"},
          {-4, 7, "another chunk is in its place"}})
        EXPECT_THAT(error_of(sizes + size_t(at), int32_t(value)), HasSubstr(why));

    part.samples = [](int, int, size_t) { return std::vector<float>{1, 2, 3, 4}; };
    for (const auto& [tile, place] :
         {std::pair(0, "a deep line takes"), {2, "a deep tile takes"}}) {
        part.tile = tile;
        file.set(bytes_of_file({part}));
        EXPECT_THAT(
            ExrFile::open(file.path(), ReadLimits{.max_chunk_bytes = 64}).status().message(),
            AllOf(HasSubstr(place), HasSubstr("with fewer samples or smaller tiles")));
    }
}

}  // namespace
}  // namespace postchain::io::test_deep_reader
