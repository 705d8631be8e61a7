#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <climits>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {
namespace {

using test::error_of;
using test::must;
using test::TempFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using FindFrames = InOut;
using ScanFolder = InOut;

using Frames = std::vector<int>;

void make_files(const TempFolder& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) test::write_text(folder.path(name), "x");
}

Frames frames_of(std::string_view text) {
    return must(FrameRange::parse(text)).frames;
}

TEST(FrameRange, TakesNumbersRangesAndStepsInTheirOrderAndEachFrameOnce) {
    const std::pair<const char*, Frames> cases[] = {{"7", {7}},
                                                    {"1-4", {1, 2, 3, 4}},
                                                    {"20-27x3", {20, 23, 26}},
                                                    {"-5--3", {-5, -4, -3}},
                                                    {"-1-1", {-1, 0, 1}},
                                                    {"-4-4x4", {-4, 0, 4}},
                                                    {"5-5", {5}},
                                                    {"9,1-3,2-4,1001", {9, 1, 2, 3, 4, 1001}},
                                                    {"1-3,3-4", {1, 2, 3, 4}},
                                                    {"3-4,1-3", {3, 4, 1, 2}},
                                                    {"1-3,4-5", {1, 2, 3, 4, 5}}};
    for (const auto& [text, frames] : cases) EXPECT_EQ(frames_of(text), frames) << text;
    EXPECT_EQ(frames_of("1-1000000").size(), 1000000u);
    EXPECT_EQ(frames_of("-999999999-999999999x999999999").size(), 3u);
}

TEST(FrameRange, RefusesWhatIsNoRange) {
    for (const char* text :
         {"",    ",",     "1,",    ",1",      "a",           "1-",         "-",
          "--1", "1-2-3", "1-10x", "1x2",     "1-10y2",      "1 - 3",      " 1",
          "+1",  "0x10",  "1.5",   "1-10x-2", "99999999999", "1000000000", "-1000000000"})
        EXPECT_EQ(FrameRange::parse(text).status().code(), StatusCode::usage) << text;
    for (const auto& [text, why] :
         {std::pair("1:10", "two things"),
          {"1-10:2", "1-10x2"},
          {"1-10x0", "step"},
          {"10-1", "backwards"},
          {"1-1000001", "more than 1000000"},
          {"1-600000,600001-1200000", "more than"},
          // Each listing costs its frames, also of those that are listed already.
          {"1-600000,1-600000", "more than"}})
        EXPECT_THAT(error_of(FrameRange::parse(text)), HasSubstr(why));
}

PathPattern pattern_of(std::string_view text) {
    return must(PathPattern::parse(text));
}

TEST(PathPattern, FormatsEveryToken) {
    for (const auto& [pattern, frame, path] :
         {std::tuple("a/b.####.exr", 7, "a/b.0007.exr"),
          {"b.@.exr", 7, "b.7.exr"},
          {"b.@@@@.exr", 12345, "b.12345.exr"},
          {"b.%04d.exr", 7, "b.0007.exr"},
          {"b.%d.exr", 1001, "b.1001.exr"},
          {"b.$F4.exr", 7, "b.0007.exr"},
          {"/x/b$F.exr", -7, "/x/b-7.exr"},
          {"b.####.exr", -5, "b.-005.exr"},  // the sign counts as a column, as in "%04d"
          {"shot#1/@x/b.##.exr", 3, "shot#1/@x/b.03.exr"}})  // in the file name alone
        EXPECT_EQ(pattern_of(pattern).format(frame), path);
    for (const char* none : {"shot####/b.exr", "100%.exr", "$HOME.exr"})
        EXPECT_FALSE(pattern_of(none).has_token()) << none;
    for (const auto& [path, folder] :
         {std::pair("b.exr", "."), {"/b.exr", "/"}, {"x/y/b.exr", "x/y"}})
        EXPECT_EQ(pattern_of(path).folder(), folder);
    for (const char* text : {"", "a/", "b.####.%04d.exr", "b.%4d.exr", "b.%099d.exr"})
        EXPECT_EQ(PathPattern::parse(text).status().code(), StatusCode::usage) << text;
}

TEST(PathPattern, MatchesWhatItFormatsAndNothingElse) {
    const PathPattern p = pattern_of("b.####.exr");
    for (const int frame : {0, 7, 1001, 9999, 12345, -5, -1234, 999999999})
        EXPECT_EQ(p.match(p.format(frame)), frame);
    EXPECT_EQ(p.match("b.-0005.exr"), -5);  // as some programs write it
    for (const char* name :
         {"b.007.exr", "b.00007.exr", "b..exr", "b.exr", "c.0007.exr", "b.0007.exr2", "b.00a7.exr",
          "b. 007.exr", "b.+007.exr", ".b.0007.exr.4711.tmp", "b.99999999999.exr", "b.-0000.exr",
          "b.-00005.exr"})
        EXPECT_FALSE(p.match(name).has_value()) << name;
    EXPECT_EQ(pattern_of("b.@.exr").match("b.0007.exr"), std::nullopt);
    EXPECT_EQ(pattern_of("#").match(".7.55.tmp"), std::nullopt);
    EXPECT_EQ(pattern_of("x/b.0007.exr").match("b.0007.exr"), 7);
    EXPECT_EQ(pattern_of("x/b.0007.exr").match("b.0008.exr"), std::nullopt);
}

TEST(PathPattern, NumberOfASingleFileIsItsLastGroupOfDigits) {
    for (const auto& [path, frame] : {std::pair("render.0010.exr", 10),
                                      {"v2/shot3_v012.exr", 12},
                                      {"shot3_final.exr", 3},
                                      {"v2/final.exr", 0},
                                      {"final.mp4", 0},
                                      {"f-5.exr", 5},
                                      {"20261120123456.exr", 0},
                                      {"f1234567890.exr", 0}})  // would fit into an int
        EXPECT_EQ(pattern_of(path).literal_frame(), frame) << path;
}

TEST(InputSpec, OnePatternOrOnePerPlane) {
    for (const char* text : {"a,b/A.####.exr", "./a=b.exr"}) {
        const auto one = must(InputSpec::parse(text));
        EXPECT_FALSE(one.separate_files());
        EXPECT_EQ(one.color().text(), text);
    }
    const auto many = must(
        InputSpec::parse("color=A,1.####.exr,depth=B.exr,motion=C.%04d.exr,motion_back=D.@.exr,"
                         "behind=E.##.exr"));
    EXPECT_TRUE(many.separate_files());
    for (const auto& [role, text] : {std::pair(Role::color, "A,1.####.exr"),
                                     {Role::inverse_depth, "B.exr"},
                                     {Role::motion, "C.%04d.exr"},
                                     {Role::motion_back, "D.@.exr"},
                                     {Role::behind, "E.##.exr"}})
        EXPECT_EQ(many.patterns.at(role).text(), text);
    for (const char* text : {"", "colr=A.exr", "color=", "depth=B.exr", "color=A.exr,color=B.exr",
                             "color=A.exr,deep=B.exr", "color=A.exr,depth="})
        EXPECT_EQ(InputSpec::parse(text).status().code(), StatusCode::usage) << text;
    EXPECT_THAT(error_of(InputSpec::parse("colr=A.exr")), HasSubstr("motion_back="));
}

TEST(PathPattern, RefusesAPathThatTheSystemDoesNotTake) {
    const std::string longest(PATH_MAX - 1, 'a');
    EXPECT_TRUE(PathPattern::parse(longest).ok());
    const std::string error = error_of(PathPattern::parse(longest + "a"));
    EXPECT_THAT(error, HasSubstr("longer than 4095 bytes"));
    EXPECT_LT(error.size(), 200u) << "it does not repeat the path";
    EXPECT_THAT(error_of(InputSpec::parse(std::string(6 * PATH_MAX, 'a'))),
                HasSubstr("longer than five paths"));
    EXPECT_THAT(error_of(InputSpec::parse("color=A.exr,depth=" + longest + "a")),
                HasSubstr("input depth: path 'aaaa"));
}

FrameList list_of(const std::string& input, const char* range = nullptr) {
    std::optional<FrameRange> frames;
    if (range != nullptr) frames = must(FrameRange::parse(range));
    return must(find_frames(must(InputSpec::parse(input)), frames));
}

TEST_F(FindFrames, WithoutARangeTakesWhatIsThereAndNamesTheGaps) {
    make_files(folder, {"b.0010.exr", "b.0011.exr", "b.0014.exr"});
    const FrameList list = list_of(folder.path("b.####.exr"));
    EXPECT_THAT(list.frames, ElementsAre(10, 11, 14));
    EXPECT_THAT(list.missing, IsEmpty());
    EXPECT_THAT(list.gaps, ElementsAre(12, 13));
    const FrameList asked = list_of(folder.path("b.####.exr"), "9-11");
    EXPECT_THAT(asked.frames, ElementsAre(9, 10, 11));
    EXPECT_THAT(asked.missing, ElementsAre(9));
    EXPECT_EQ(asked.files.at(10).at(Role::color), folder.path("b.0010.exr"));
    EXPECT_THAT(asked.gaps, IsEmpty());
    // A single file is one frame.
    EXPECT_THAT(list_of(folder.path("b.0010.exr")).frames, ElementsAre(10));
    EXPECT_THAT(list_of(folder.path("b.0010.exr"), "10-11").missing, ElementsAre(11));
}

TEST_F(FindFrames, AFrameIsMissingWhenAnyOfItsPlanesIs) {
    make_files(folder, {"c.1.exr", "c.2.exr", "d.2.exr", "m.exr"});
    const FrameList list =
        list_of("color=" + folder.path("c.@.exr") + ",depth=" + folder.path("d.@.exr") +
                ",motion=" + folder.path("m.exr"));
    EXPECT_THAT(list.frames, ElementsAre(1, 2));
    EXPECT_THAT(list.missing, ElementsAre(1));
    EXPECT_EQ(list.files.at(2).at(Role::motion), folder.path("m.exr"));  // serves every frame
}

TEST_F(FindFrames, RefusesWhatHasNoOneFile) {
    const auto error = [&](const std::string& name) {
        const auto frames = find_frames(must(InputSpec::parse(folder.path(name))), std::nullopt);
        EXPECT_EQ(frames.status().code(), StatusCode::input);
        return error_of(frames);
    };
    for (const char* name : {"b.####.exr", "b.exr", "none/b.####.exr"})
        EXPECT_THAT(error(name), HasSubstr(name));
    make_files(folder, {"b.0001.exr", "b.-005.exr", "b.-0006.exr", "a#b.exr"});
    EXPECT_THAT(error("a#b.exr"), HasSubstr("the file of this very name must be renamed"));
    EXPECT_THAT(list_of(folder.path("b.####.exr")).frames, ElementsAre(-6, -5, 1));
    make_files(folder, {"b.-0005.exr"});
    EXPECT_THAT(error("b.####.exr"),
                testing::AllOf(HasSubstr("b.-005.exr"), HasSubstr("b.-0005.exr")));
}

TEST(Chunk, ReadsIOfN) {
    const auto chunk = must(Chunk::parse("3/8"));
    EXPECT_EQ(chunk.index, 3);
    EXPECT_EQ(chunk.count, 8);
    for (const char* text : {"1/1", "1/8", "8/8", "1000000/1000000"})
        EXPECT_TRUE(Chunk::parse(text).ok()) << text;
    for (const char* text : {"", "3", "3/", "3x8", "/8", "0/8", "9/8", "-1/8", "3/8 ", "3/8/1",
                             "3/-8", "a/b", "1/1000001", "99999999999/99999999999"}) {
        EXPECT_EQ(Chunk::parse(text).status().code(), StatusCode::usage) << text;
        EXPECT_THAT(error_of(Chunk::parse(text)), HasSubstr("I/N"));
    }
}

TEST(Chunk, PartsAreTheWholeAndNearlyEqual) {
    for (const size_t size : {0, 1, 7, 8, 9, 100, 1'000'000}) {
        for (const int count : {1, 2, 3, 8, 1000}) {
            size_t next = 0, least = size, most = 0;
            for (int index = 1; index <= count; ++index) {
                const auto [first, end] = Chunk{index, count}.of(size);
                EXPECT_EQ(first, next);
                least = std::min(least, end - first);
                most = std::max(most, end - first);
                next = end;
            }
            EXPECT_EQ(next, size);
            EXPECT_LE(most - least, 1u) << size << " frames, " << count << " parts";
        }
    }
}

TEST(Chunk, APartKeepsItsOwnMissingFramesAndGaps) {
    const TempFolder folder;
    make_files(folder, {"b.01.exr", "b.02.exr", "b.05.exr", "b.08.exr"});
    FrameList list = list_of(folder.path("b.##.exr"));
    list.keep({2, 2});
    EXPECT_THAT(list.frames, ElementsAre(5, 8));
    EXPECT_THAT(list.gaps, ElementsAre(6, 7));
    EXPECT_EQ(list.files.size(), 2u);
    list = list_of(folder.path("b.##.exr"));
    list.keep({1, 8});
    EXPECT_THAT(list.frames, IsEmpty());
    EXPECT_THAT(list.gaps, IsEmpty());
    FrameList asked = list_of(folder.path("b.##.exr"), "1-8");
    asked.keep({1, 2});
    EXPECT_THAT(asked.frames, ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(asked.missing, ElementsAre(3, 4));
    // In the requested order; a part may be empty.
    FrameList reversed = list_of(folder.path("b.##.exr"), "8,5,2,1");
    reversed.keep({1, 4});
    EXPECT_THAT(reversed.frames, ElementsAre(8));
    reversed.keep({1, 2});
    EXPECT_THAT(reversed.frames, IsEmpty());
}

// Frames by the pattern in the folder; each pattern is an --input that finds these frames.
std::map<std::string, Frames> scanned(const TempFolder& folder) {
    std::map<std::string, Frames> frames;
    for (const auto& sequence : must(scan_folder(folder.path("")))) {
        frames[sequence.pattern.substr(folder.path("").size())] = sequence.frames;
        const FrameList list = list_of(sequence.pattern);
        EXPECT_EQ(list.frames, sequence.frames) << sequence.pattern;
        EXPECT_EQ(list.gaps, sequence.gaps) << sequence.pattern;
    }
    return frames;
}

TEST_F(ScanFolder, FilesThatDifferInTheirNumberAreOneSequence) {
    make_files(
        folder,
        {"a.0008.exr", "a.0009.exr", "a.0012.exr", "a.10000.exr",  // one, longer than its padding
         "b_v2.9.exr", "b_v2.10.exr",                              // no padding
         "b_v3.9.exr",                                             // another version
         "beauty.1001.left.exr", "beauty.1002.left.exr", "still.EXR", "shot_20261121120000.exr",
         ".a.0008.exr.77.tmp", ".hidden.0001.exr", "a.0008.exr.json", "notes.txt"});
    make_files(folder, {"x#y#.exr"});  // no input can name it
    std::filesystem::create_directory(folder.path("folder.0001.exr"));
    const std::map<std::string, Frames> expected = {{"a.####.exr", {8, 9, 12, 10000}},
                                                    {"b_v2.#.exr", {9, 10}},
                                                    {"b_v3.9.exr", {9}},
                                                    {"beauty.####.left.exr", {1001, 1002}},
                                                    {"shot_20261121120000.exr", {0}},
                                                    {"still.EXR", {0}}};
    EXPECT_EQ(scanned(folder), expected);
}

TEST_F(ScanFolder, NegativeFramesAreOfTheSequence) {
    make_files(folder, {"a.-010.exr", "a.-002.exr", "a.-001.exr", "a.0000.exr", "a.0001.exr",
                        "b.-0002.exr", "b.-0001.exr", "b.0000.exr",  // the sign is not counted
                        "c.-2.exr", "c.-1.exr", "c.1.exr", "d_-03.exr", "d_-02.exr", "e-0001.exr",
                        "e-0002.exr", "f.-0007.exr",  // a separator
                        "g.001.exr", "g.0001.exr", "g.100.exr"});
    const std::map<std::string, Frames> expected = {{"a.####.exr", {-10, -2, -1, 0, 1}},
                                                    {"b.####.exr", {-2, -1, 0}},
                                                    {"c.#.exr", {-2, -1, 1}},
                                                    {"d_##.exr", {-3, -2}},
                                                    {"e-####.exr", {1, 2}},
                                                    {"f.-0007.exr", {-7}},
                                                    {"g.###.exr", {1, 100}},
                                                    {"g.0001.exr", {1}}};
    EXPECT_EQ(scanned(folder), expected);
}

TEST_F(ScanFolder, WhatHasNoFrameIsAnError) {
    EXPECT_EQ(scan_folder(folder.path("")).status().code(), StatusCode::input);
    EXPECT_THAT(error_of(scan_folder(folder.path(""))), HasSubstr("no EXR file"));
    EXPECT_THAT(error_of(scan_folder(folder.path("none"))), HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace postchain::io
