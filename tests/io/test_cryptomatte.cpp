// Cryptomattes of files: ids, manifests, mattes, ranks. Expected: hashes that Blender wrote into
// its manifest and published test vectors of MurmurHash3, coverages stated here.
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <set>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/sequence/planes/cryptomatte.h"

namespace postchain::io {
namespace {

using test::must;
using testing::ElementsAre;
using testing::HasSubstr;

using CryptomatteFile = InOut;

const std::string kRendered = POSTCHAIN_SOURCE_DIR "/tests/data/layers/layers.0001.exr";

// Ids and coverages of four ranks for 3 x 1 pixels.
struct Sample {
    CryptoId id;
    float coverage;
};
using Pixel = std::array<Sample, 4>;

struct CryptoFile {
    std::map<std::string, std::string> attributes = {};
    std::array<const char*, 4> words = {"r", "g", "b", "a"};
    Imf::PixelType type = Imf::FLOAT;
    std::vector<Pixel> pixels = {{{{7, 0.5f}, {9, 0.25f}, {0, 0}, {0, 0}}},
                                 {{{9, 0.5f}, {7, 0.25f}, {11, 0.125f}, {7, 0.0625f}}},
                                 {{{0, 1}, {0, 0}, {0, 0}, {0, 0}}}};
};

// The ids with a coverage above 0, without id 0, sorted.
std::vector<CryptoId> ids_in(const RankedCoverage& ranks) {
    std::set<CryptoId> ids;
    for (size_t i = 0; i < ranks.ids.size(); ++i)
        if (ranks.ids[i] != 0 && ranks.coverages[i] > 0) ids.insert(ranks.ids[i]);
    return {ids.begin(), ids.end()};
}

void add_attributes(Imf::Header& header, const std::map<std::string, std::string>& attributes) {
    for (const auto& [what, value] : attributes)
        header.insert("cryptomatte/1234567/" + what, Imf::StringAttribute(value));
}

std::string write(const test::TempFolder& folder, const CryptoFile& file) {
    const std::string path = folder.path("crypto.exr");
    test::FilePart part;
    for (const char* level : {"00", "01"})
        for (const char* word : file.words)
            part.channels.push_back({concat("crypto_object", level, ".", word), file.type});
    part.data = part.display = {{0, 0}, {int(file.pixels.size()) - 1, 0}};
    part.edit = [&](Imf::Header& header) { add_attributes(header, file.attributes); };
    part.bits = [&](size_t channel, int x, int) {
        const Sample& sample = file.pixels[size_t(x)][channel / 2];
        return channel % 2 ? std::bit_cast<uint32_t>(sample.coverage) : sample.id;
    };
    test::write_file(path, {part});
    return path;
}

std::map<std::string, std::string> attributes(const std::map<std::string, std::string>& more = {}) {
    std::map<std::string, std::string> all = {
        {"name", "crypto_object"}, {"hash", "MurmurHash3_32"}, {"conversion", "uint32_to_float32"}};
    for (const auto& [what, value] : more) all[what] = value;
    return all;
}

Result<std::vector<Cryptomatte>> found(const std::string& path) {
    auto file = ExrFile::open(path);
    if (!file.ok()) return file.status();
    return find_cryptomattes(*file);
}

// Vectors: the tests of Apache Commons Codec and of Guava for murmur3_32 with seed 0.
TEST_F(CryptomatteFile, HashIsMurmur3) {
    for (const auto& [text, hash] : {std::pair("", 0u),
                                     {"hello", 0x248bfa47u},
                                     {"hello, world", 0x149bbb7fu},
                                     {"The quick brown fox jumps over the lazy dog", 0x2e4ff723u}})
        EXPECT_EQ(murmur_hash(text), hash) << text;
    EXPECT_EQ(id_of_name("hello"), 0x248bfa47u);
    EXPECT_EQ(id_of_hash(0x12345678u), 0x12345678u);
    EXPECT_EQ(id_of_hash(0x00000001u), 0x00800001u);  // otherwise a denormal
    EXPECT_EQ(id_of_hash(0xff812345u), 0xff012345u);  // otherwise a NaN
    EXPECT_EQ(id_of_hash(0x7f800000u), 0x7f000000u);  // otherwise Inf
}

TEST_F(CryptomatteFile, BlendersFileHasItsObjects) {
    const auto all = must(found(kRendered));
    ASSERT_EQ(all.size(), 1u);
    const Cryptomatte& one = all.front();
    EXPECT_EQ(one.name, "ViewLayer.CryptoObject");
    EXPECT_EQ(one.short_name(), "CryptoObject");
    EXPECT_EQ(one.ranks(), 4);
    EXPECT_EQ(one.no_manifest, "");
    ASSERT_EQ(one.manifest.size(), 4u);
    for (const auto& [name, id] : one.manifest) EXPECT_EQ(id, id_of_name(name)) << name;
    EXPECT_TRUE(one.holds(0, "ViewLayer.CryptoObject01.a"));
    EXPECT_FALSE(one.holds(0, "ViewLayer.Combined.R"));
    // Coverages add up to alpha.
    auto file = must(ExrFile::open(kRendered));
    const auto ranks = must(read_ranks(file, one, file.parts()[0].data_window));
    const auto ids = ids_in(ranks);
    EXPECT_EQ(ids.size(), 4u);
    const ImageF matte = coverage_of(ranks, ids);
    const auto alpha = must(file.read_channels(0, {"ViewLayer.Combined.A"}));
    for (size_t i = 0; i < matte.data.size(); ++i) EXPECT_NEAR(matte.data[i], alpha.data[i], 1e-5);
}

TEST_F(CryptomatteFile, ManifestsAreReadWhereAskedFor) {
    auto file = must(ExrFile::open(
        write(folder, {.attributes = attributes({{"manifest", "{\"hello\": \"248bfa47\"}"}})})));
    const auto read = must(find_cryptomattes(file, Manifests::read)).front(),
               not_read = must(find_cryptomattes(file, Manifests::not_read)).front();
    EXPECT_EQ(read.manifest.at("hello"), 0x248bfa47u);
    EXPECT_TRUE(not_read.manifest.empty());
    EXPECT_EQ(not_read.no_manifest, "");
    EXPECT_EQ(not_read.levels.size(), read.levels.size());
}

TEST_F(CryptomatteFile, EveryWordForChannels) {
    for (const std::array<const char*, 4>& words :
         {std::array{"R", "G", "B", "A"}, std::array{"red", "green", "blue", "alpha"}}) {
        CryptoFile file{.attributes = attributes(), .words = words};
        const auto all = must(found(write(folder, file)));
        EXPECT_EQ(all.front().levels[1].channels[3], std::string("crypto_object01.") + words[3]);
    }
}

// Levels of two digits; an attribute that only begins like a cryptomatte's.
TEST_F(CryptomatteFile, ManyLevels) {
    test::FilePart part;
    for (int level = 0; level < 12; ++level)
        for (const char* word : {"r", "g", "b", "a"})
            part.channels.push_back(
                {concat("crypto_object", level < 10 ? "0" : "", level, ".", word), Imf::FLOAT});
    part.edit = [](Imf::Header& header) {
        add_attributes(header, attributes());
        header.insert("cryptomatte/name", Imf::StringAttribute("another"));
    };
    test::write_file(folder.path("many.exr"), {part});
    const auto all = must(found(folder.path("many.exr")));
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].ranks(), 24);
    EXPECT_EQ(all[0].levels.back().channels[0], "crypto_object11.r");
}

// Each view has its own ranks and manifest: in a part of the view, or by the view's word.
TEST_F(CryptomatteFile, OfAView) {
    const auto add_ranks = [](test::FilePart& part, const std::string& view) {
        for (const char* channel : {"r", "g", "b", "a"})
            part.channels.push_back({concat("crypto_object00.", view, channel), Imf::FLOAT});
    };
    const auto part_of = [&](const std::string& view) {
        test::FilePart part{.name = "beauty." + view, .data = {{0, 0}, {3, 3}}};
        add_ranks(part, "");
        part.edit = [view](Imf::Header& header) {
            header.setView(view);
            add_attributes(header, attributes({{"manifest", "{\"" + view + "\": \"248bfa47\"}"}}));
        };
        return part;
    };
    test::write_file(folder.path("parts.exr"), {part_of("left"), part_of("right")});
    auto parts = must(ExrFile::open(folder.path("parts.exr")));
    for (const std::string view : {"left", "right"}) {
        const auto all =
            must(find_cryptomattes(parts, Manifests::read, {}, {view, view == "left"}));
        ASSERT_EQ(all.size(), 1u);
        EXPECT_EQ(all[0].levels[0].part, view == "left" ? 0 : 1);
        EXPECT_EQ(all[0].manifest.size(), 1u);
        EXPECT_EQ(all[0].manifest.count(view), 1u);
    }
    test::FilePart one = part_of("left");
    one.name = "";
    add_ranks(one, "right.");
    one.edit = [edit = one.edit](Imf::Header& header) {
        edit(header);
        header.erase("view");
        Imf::addMultiView(header, {"left", "right"});
    };
    test::write_file(folder.path("one.exr"), {one});
    auto file = must(ExrFile::open(folder.path("one.exr")));
    const auto of = [&](const CryptoView& view) {
        const auto all = must(find_cryptomattes(file, Manifests::read, {}, view));
        return all.empty() || all[0].levels.empty() ? "" : all[0].levels[0].channels[0];
    };
    EXPECT_EQ(of({"left", true}), "crypto_object00.r");
    EXPECT_EQ(of({"right", false}), "crypto_object00.right.r");
    EXPECT_EQ(of({"center", false}), "") << "the channels are the left view's";
}

TEST_F(CryptomatteFile, RanksOfOneIdAddUp) {
    auto file = must(ExrFile::open(write(folder, {.attributes = attributes()})));
    const auto ranks = must(read_ranks(file, must(find_cryptomattes(file)).front(), {-1, 0, 2, 0}));
    EXPECT_THAT(ids_in(ranks), ElementsAre(7, 9, 11));
    EXPECT_THAT(coverage_of(ranks, {7}).data, ElementsAre(0, 0.5f, 0.3125f, 0));
    EXPECT_THAT(coverage_of(ranks, {7, 11}).data, ElementsAre(0, 0.5f, 0.4375f, 0));
}

// No hash is NaN or Inf, and no filter makes much more than a whole of a pixel.
TEST_F(CryptomatteFile, FaultySlotsAreCleared) {
    constexpr CryptoId kNan = 0x7fc00000, kInf = 0x7f800000;
    const std::vector<Pixel> pixels = {{{{kNan, 0.5f}, {9, 0.25f}, {kInf, 0.25f}, {0, 0}}},
                                       {{{9, NAN}, {7, INFINITY}, {11, 7}, {7, -2}}},
                                       {{{9, 1.01f}, {7, -0.01f}, {0, 0}, {0, 0}}}};
    auto file = must(ExrFile::open(write(folder, {.attributes = attributes(), .pixels = pixels})));
    const auto ranks = must(read_ranks(file, must(find_cryptomattes(file)).front(), {0, 0, 2, 0}));
    EXPECT_EQ(ranks.faulty, 6u);
    EXPECT_THAT(ids_in(ranks), ElementsAre(9));
    EXPECT_THAT(coverage_of(ranks, {9}).data, ElementsAre(0.25f, 0, 1.01f));
}

TEST_F(CryptomatteFile, ManifestsThatAreNone) {
    const auto found_with = [&](const char* attribute, const char* value) {
        auto more = attributes();
        if (*attribute != 0) more[attribute] = value;
        return must(found(write(folder, {.attributes = more}))).front();
    };
    for (const auto& [attribute, value, why] :
         {std::tuple("", "", "it has no manifest"),
          {"manifest", "[]", "its manifest is not a JSON object"},
          {"manifest", "{\"ball\": \"64", "its manifest is not a JSON object"},
          {"manifest", "{}", "its manifest is empty"},
          {"manifest", "{\"a\": \"1\", \"ball\": \"64x\"}",
           "its manifest has no hash of 8 digits for \"ball\""},
          {"manifest", "{\"ball\": 64}", "no hash of 8 digits for \"ball\""},
          {"manifest", "{\"ball\": \"\"}", "no hash of 8 digits for \"ball\""},
          {"manif_file", "", "its manifest file \"\" is not in the frame's folder"},
          {"manif_file", ".", "is not a file"},
          {"manif_file", "names.json", "names.json does not exist"},
          {"manif_file", "../names.json", "not in the frame's folder"},
          {"manif_file", "/etc/passwd", "not in the frame's folder"}}) {
        const Cryptomatte one = found_with(attribute, value);
        EXPECT_TRUE(one.manifest.empty()) << value;
        EXPECT_THAT(one.no_manifest, HasSubstr(why));
    }
    test::write_text(folder.path("names.json"), R"({"ball": "00000007"})");
    const Cryptomatte in_file = found_with("manif_file", "names.json");
    EXPECT_EQ(in_file.no_manifest, "");
    EXPECT_EQ(in_file.manifest.at("ball"), 0x00800007u);
    test::write_text(folder.path("names.json"), "[]");
    EXPECT_THAT(found_with("manif_file", "names.json").no_manifest,
                HasSubstr("names.json: its manifest is not a JSON object"));
    std::filesystem::resize_file(folder.path("names.json"), (1u << 26) + 1);
    EXPECT_THAT(found_with("manif_file", "names.json").no_manifest,
                HasSubstr("is larger than 64 MiB"));
    // One in the frame goes before it.
    const auto both = attributes({{"manif_file", "names.json"}, {"manifest", R"({"ball": "7"})"}});
    const auto own = must(found(write(folder, {.attributes = both}))).front();
    EXPECT_EQ(own.manifest.size(), 1u);
    EXPECT_EQ(own.manifest_file, "");
}

TEST_F(CryptomatteFile, RanksInPartsOfTheirOwn) {
    const auto level_in_part = [](const std::string& name, int width) {
        test::FilePart part{.name = name, .data = {{0, 0}, {width - 1, 3}}};
        for (const char* word : {"r", "g", "b", "a"}) part.channels.push_back({word, Imf::FLOAT});
        part.edit = [](Imf::Header& header) { add_attributes(header, attributes()); };
        return part;
    };
    const auto in_parts = [&](const std::string& end, int second_width) {
        test::write_file(folder.path("parts.exr"),
                         {level_in_part("crypto_object00" + end, 4),
                          level_in_part("crypto_object01" + end, second_width)});
        auto file = must(ExrFile::open(folder.path("parts.exr")));
        const CryptoView view{end.empty() ? "" : end.substr(1), true};
        return must(find_cryptomattes(file, Manifests::not_read, {}, view)).at(0);
    };
    for (const char* end : {"", ".left"}) {
        const Cryptomatte one = in_parts(end, 4);
        ASSERT_EQ(one.levels.size(), 2u) << one.fault.message();
        EXPECT_TRUE(one.fault.ok()) << one.fault.message();
        EXPECT_TRUE(one.holds(1, "r"));
        EXPECT_FALSE(one.holds(2, "r"));
    }
    EXPECT_THAT(in_parts("", 5).fault.message(), HasSubstr("ranks are of parts of different size"));
}

TEST_F(CryptomatteFile, WhatCannotBeRead) {
    const auto error = [&](const CryptoFile& file) {
        const auto all = must(found(write(folder, file)));
        return all.empty() ? "" : all.front().fault.message();
    };
    for (const auto& [attribute, value, why] :
         {std::tuple("hash", "MD5", "only MurmurHash3_32 is known"),
          {"conversion", "none", "only uint32_to_float32 is known"},
          {"name", "other", "other00.r, .g, .b, .a are missing"}})
        EXPECT_THAT(error({.attributes = attributes({{attribute, value}})}), HasSubstr(why));
    EXPECT_THAT(error({.attributes = attributes(), .type = Imf::UINT}),
                HasSubstr("crypto_object00.r is uint"));
    EXPECT_EQ(error({.attributes = {}}), "");
    EXPECT_EQ(error({.attributes = {{"hash", "MurmurHash3_32"}}}), "") << "it has no name";
    EXPECT_EQ(error({.attributes = attributes()}), "");
}

TEST_F(CryptomatteFile, AttributesAreTrueOfItsFirstRanks) {
    auto file =
        must(ExrFile::open(write(folder, {.attributes = attributes({{"manif_file", "m.json"}})})));
    const auto lost = [&](const std::vector<std::string>& channels) {
        return attributes_without_ranks(file.parts()[0], file.parts(), {.channels = channels})
            .size();
    };
    EXPECT_EQ(lost({}), 0u);
    EXPECT_EQ(lost({"crypto_object00.*"}), 0u);
    EXPECT_EQ(lost({"crypto_object01.*"}), 4u);
    EXPECT_EQ(lost({"crypto_object00.r"}), 4u);
    // Attributes that were already invalid are kept.
    for (const auto& invalid : {attributes({{"name", "other"}}), {{"hash", "MurmurHash3_32"}}}) {
        auto other = ExrFile::open(write(folder, {.attributes = invalid}));
        EXPECT_THAT(
            attributes_without_ranks(other->parts()[0], other->parts(), {.channels = {"a"}}),
            ElementsAre());
    }
}

ImageF plane(const std::array<float, 3>& values) {
    return test::make_image(3, 1, 1, [&](int x, int, int) { return values[size_t(x)]; });
}

TEST_F(CryptomatteFile, RerankingKeepsTheLargest) {
    Reranking ranking(3, 1, 2);
    ranking.add(5, plane({0.2f, 0.3f, 0}), 0, {0, 0, 2, 0});
    ranking.add(3, plane({0.5f, 0.3f, 0}), 0, {0, 0, 2, 0});
    EXPECT_EQ(ranking.pixels_short(), 0u);
    ranking.add(4, plane({0.1f, 0.4f, 0.6f}), 0, {0, 0, 2, 0});
    EXPECT_THAT(ranking.result().ids, ElementsAre(3, 5, 4, 3, 4, 0));
    EXPECT_THAT(ranking.result().coverages, ElementsAre(0.5f, 0.2f, 0.4f, 0.3f, 0.6f, 0));
    EXPECT_EQ(ranking.pixels_short(), 2u);
    EXPECT_EQ(ranking.largest_lost(), 0.3f);
    ranking.add(9, plane({1, 1, 1}), 0, {2, 0, 2, 0});
    EXPECT_THAT(ranking.result().ids, ElementsAre(3, 5, 4, 3, 9, 4));
}

}  // namespace
}  // namespace postchain::io
