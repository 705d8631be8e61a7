#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {
namespace {

using test::must;
using test::TempFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

void make_files(const TempFolder& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) test::write_text(folder.path(name), "x");
}

std::vector<int> frames_of(std::string_view text) {
    return must(FrameRange::parse(text)).frames;
}

std::string range_error(std::string_view text) {
    const Result<FrameRange> range = FrameRange::parse(text);
    EXPECT_FALSE(range.ok()) << text;
    EXPECT_EQ(range.status().code(), StatusCode::usage);
    return range.status().message();
}

TEST(FrameRange, TakesNumbersRangesAndStepsInTheirOrderAndEachFrameOnce) {
    const std::pair<const char*, std::vector<int>> cases[] = {
        {"7", {7}},
        {"1-4", {1, 2, 3, 4}},
        {"20-27x3", {20, 23, 26}},
        {"-5--3", {-5, -4, -3}},
        {"-1-1", {-1, 0, 1}},
        {"-4-4x4", {-4, 0, 4}},
        {"5-5", {5}},
        {"9,1-3,2-4,1001", {9, 1, 2, 3, 4, 1001}}};
    for (const auto& [text, frames] : cases) EXPECT_EQ(frames_of(text), frames) << text;
}

TEST(FrameRange, RefusesWhatIsNoRange) {
    for (const char* text : {"",    ",",     "1,",    ",1",      "a",           "1-",        "-",
                             "--1", "1-2-3", "1-10x", "1x2",     "1-10y2",      "1 - 3",     " 1",
                             "+1",  "0x10",  "1.5",   "1-10x-2", "99999999999", "1000000000"})
        EXPECT_FALSE(range_error(text).empty());
    const std::pair<const char*, const char*> cases[] = {
        {"1:10", "two things"}, {"1-10:2", "1-10x2"}, {"1-10x0", "step"}, {"10-1", "backwards"}};
    for (const auto& [text, why] : cases) EXPECT_THAT(range_error(text), HasSubstr(why));
}

TEST(FrameRange, CapsTheNumberOfFrames) {
    EXPECT_EQ(frames_of("1-1000000").size(), 1000000u);
    EXPECT_THAT(range_error("1-1000001"), HasSubstr("more than 1000000"));
    EXPECT_THAT(range_error("1-600000,600001-1200000"), HasSubstr("more than"));
    EXPECT_EQ(frames_of("-999999999-999999999x999999999").size(), 3u);
}

PathPattern pattern_of(std::string_view text) {
    return must(PathPattern::parse(text));
}

TEST(PathPattern, FormatsEveryToken) {
    EXPECT_EQ(pattern_of("a/b.####.exr").format(7), "a/b.0007.exr");
    EXPECT_EQ(pattern_of("b.@.exr").format(7), "b.7.exr");
    EXPECT_EQ(pattern_of("b.@@@@.exr").format(12345), "b.12345.exr");
    EXPECT_EQ(pattern_of("b.%04d.exr").format(7), "b.0007.exr");
    EXPECT_EQ(pattern_of("b.%d.exr").format(1001), "b.1001.exr");
    EXPECT_EQ(pattern_of("b.$F4.exr").format(7), "b.0007.exr");
    EXPECT_EQ(pattern_of("/x/b$F.exr").format(-7), "/x/b-7.exr");
    // printf("%04d", -5): the sign counts as a column.
    EXPECT_EQ(pattern_of("b.####.exr").format(-5), "b.-005.exr");
}

TEST(PathPattern, OnlyTheFileNameHoldsTheToken) {
    EXPECT_EQ(pattern_of("shot#1/@x/b.##.exr").format(3), "shot#1/@x/b.03.exr");
    EXPECT_FALSE(pattern_of("shot####/b.exr").has_token());
    EXPECT_EQ(pattern_of("b.exr").folder(), ".");
    EXPECT_EQ(pattern_of("/b.exr").folder(), "/");
    EXPECT_EQ(pattern_of("x/y/b.exr").folder(), "x/y");
}

TEST(PathPattern, MatchesWhatItFormatsAndNothingElse) {
    const PathPattern p = pattern_of("b.####.exr");
    for (const int frame : {0, 7, 1001, 9999, 12345, -5, -1234, 999999999}) {
        EXPECT_EQ(p.match(p.format(frame)), frame);
    }
    EXPECT_EQ(p.match("b.-0005.exr"), -5);  // as some programs write it
    for (const char* name :
         {"b.007.exr", "b.00007.exr", "b..exr", "b.exr", "c.0007.exr", "b.0007.exr2", "b.00a7.exr",
          "b. 007.exr", "b.+007.exr", ".b.0007.exr.4711.tmp", "b.99999999999.exr", "b.-0000.exr"}) {
        EXPECT_FALSE(p.match(name).has_value()) << name;
    }
    EXPECT_EQ(pattern_of("b.@.exr").match("b.0007.exr"), std::nullopt);
}

TEST(PathPattern, RefusesWhatHasNoOneMeaning) {
    for (const char* text : {"", "a/", "b.####.%04d.exr", "b.%4d.exr", "b.%099d.exr"}) {
        const Result<PathPattern> p = PathPattern::parse(text);
        EXPECT_FALSE(p.ok()) << text;
        EXPECT_EQ(p.status().code(), StatusCode::usage);
    }
    // No tokens: a percent sign or dollar that begins none.
    EXPECT_FALSE(pattern_of("100%.exr").has_token());
    EXPECT_FALSE(pattern_of("$HOME.exr").has_token());
}

TEST(PathPattern, NumberOfASingleFileIsItsLastGroupOfDigits) {
    EXPECT_EQ(pattern_of("render.0010.exr").literal_frame(), 10);
    EXPECT_EQ(pattern_of("v2/shot3_v012.exr").literal_frame(), 12);
    EXPECT_EQ(pattern_of("shot3_final.exr").literal_frame(), 3);
    EXPECT_EQ(pattern_of("final.exr").literal_frame(), 0);
    EXPECT_EQ(pattern_of("v2/final.exr").literal_frame(), 0);
    EXPECT_EQ(pattern_of("final.mp4").literal_frame(), 0);
    EXPECT_EQ(pattern_of("f-5.exr").literal_frame(), 5);
    EXPECT_EQ(pattern_of("20261120123456.exr").literal_frame(), 0);
    EXPECT_EQ(pattern_of("f1234567890.exr").literal_frame(), 0);  // would fit into an int
}

TEST(PathPattern, DiscoversFramesButNoTemporaries) {
    const TempFolder folder;
    make_files(folder, {"b.0010.exr", "b.0012.exr", "b.-003.exr", ".b.0011.exr.99.tmp",
                        "b.0013.exr.json", "c.0010.exr"});
    const auto found = pattern_of(folder.path("b.####.exr")).discover();
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found.at(10), folder.path("b.0010.exr"));
    EXPECT_EQ(found.at(-3), folder.path("b.-003.exr"));
    EXPECT_TRUE(found.contains(12));
    EXPECT_TRUE(pattern_of(folder.path("none/b.####.exr")).discover().empty());
    // The widest pattern does not match temporaries of either kind.
    make_files(folder, {".7.55.tmp"});
    EXPECT_TRUE(pattern_of(folder.path("#")).discover().empty());
}

TEST(InputSpec, OnePatternOrOnePerPlane) {
    auto one = must(InputSpec::parse("a,b/A.####.exr"));
    EXPECT_FALSE(one.separate_files());
    EXPECT_EQ(one.color().text(), "a,b/A.####.exr");

    auto many = must(
        InputSpec::parse("color=A,1.####.exr,depth=B.exr,motion=C.%04d.exr,motion_back=D.@.exr,"
                         "behind=E.##.exr"));
    EXPECT_TRUE(many.separate_files());
    EXPECT_EQ(many.patterns.at(Role::color).text(), "A,1.####.exr");
    EXPECT_EQ(many.patterns.at(Role::inverse_depth).text(), "B.exr");
    EXPECT_EQ(many.patterns.at(Role::motion).text(), "C.%04d.exr");
    EXPECT_EQ(many.patterns.at(Role::motion_back).text(), "D.@.exr");
    EXPECT_EQ(many.patterns.at(Role::behind).text(), "E.##.exr");

    auto equals = must(InputSpec::parse("./a=b.exr"));
    EXPECT_EQ(equals.color().text(), "./a=b.exr");
}

TEST(InputSpec, RefusesWhatItCannotRead) {
    for (const char* text : {"", "colr=A.exr", "color=", "depth=B.exr", "color=A.exr,color=B.exr",
                             "color=A.exr,deep=B.exr", "color=A.exr,depth="}) {
        const Result<InputSpec> spec = InputSpec::parse(text);
        EXPECT_FALSE(spec.ok()) << text;
        EXPECT_EQ(spec.status().code(), StatusCode::usage);
    }
    EXPECT_THAT(InputSpec::parse("colr=A.exr").status().message(), HasSubstr("motion_back="));
}

FrameList list_of(const std::string& input, const char* range = nullptr) {
    std::optional<FrameRange> frames;
    if (range != nullptr) frames = must(FrameRange::parse(range));
    return must(find_frames(must(InputSpec::parse(input)), frames));
}

TEST(FindFrames, WithoutARangeTakesWhatIsThereAndNamesTheGaps) {
    const TempFolder folder;
    make_files(folder, {"b.0010.exr", "b.0011.exr", "b.0014.exr"});
    const FrameList list = list_of(folder.path("b.####.exr"));
    EXPECT_THAT(list.frames, ElementsAre(10, 11, 14));
    EXPECT_THAT(list.missing, IsEmpty());
    EXPECT_THAT(list.gaps, ElementsAre(12, 13));

    const FrameList asked = list_of(folder.path("b.####.exr"), "9-11");
    EXPECT_THAT(asked.frames, ElementsAre(9, 10, 11));
    EXPECT_THAT(asked.missing, ElementsAre(9));
    EXPECT_TRUE(asked.is_missing(9));
    EXPECT_EQ(asked.files.at(10).at(Role::color), folder.path("b.0010.exr"));
    EXPECT_THAT(asked.gaps, IsEmpty());
}

TEST(FindFrames, ASingleFileIsOneFrame) {
    const TempFolder folder;
    make_files(folder, {"b.0010.exr"});
    EXPECT_THAT(list_of(folder.path("b.0010.exr")).frames, ElementsAre(10));
    EXPECT_THAT(list_of(folder.path("b.0010.exr"), "10-11").missing, ElementsAre(11));
}

TEST(FindFrames, AFrameIsMissingWhenAnyOfItsPlanesIs) {
    const TempFolder folder;
    make_files(folder, {"c.1.exr", "c.2.exr", "d.2.exr", "m.exr"});
    const FrameList list =
        list_of("color=" + folder.path("c.@.exr") + ",depth=" + folder.path("d.@.exr") +
                ",motion=" + folder.path("m.exr"));
    EXPECT_THAT(list.frames, ElementsAre(1, 2));
    EXPECT_THAT(list.missing, ElementsAre(1));
    EXPECT_EQ(list.files.at(2).at(Role::motion), folder.path("m.exr"));  // serves every frame
}

TEST(Chunk, ReadsIOfN) {
    const auto chunk = must(Chunk::parse("3/8"));
    EXPECT_EQ(chunk.index, 3);
    EXPECT_EQ(chunk.count, 8);
    for (const char* text : {"", "3", "3/", "/8", "0/8", "9/8", "-1/8", "3/8 ", "3/8/1", "3/-8",
                             "a/b", "1/1000001", "99999999999/99999999999"}) {
        const Result<Chunk> bad = Chunk::parse(text);
        ASSERT_FALSE(bad.ok()) << text;
        EXPECT_EQ(bad.status().code(), StatusCode::usage);
        EXPECT_THAT(bad.status().message(), HasSubstr("I/N"));
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

    FrameList asked = list_of(folder.path("b.##.exr"), "1-8");
    asked.keep({1, 2});
    EXPECT_THAT(asked.frames, ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(asked.missing, ElementsAre(3, 4));
    // In the requested order.
    FrameList reversed = list_of(folder.path("b.##.exr"), "8,5,2,1");
    reversed.keep({1, 4});
    EXPECT_THAT(reversed.frames, ElementsAre(8));
    reversed.keep({2, 2});
    EXPECT_THAT(reversed.frames, ElementsAre(8));
    reversed.keep({1, 2});
    EXPECT_THAT(reversed.frames, IsEmpty());
}

TEST(ScanFolder, FilesThatDifferInTheirNumberAreOneSequence) {
    const TempFolder folder;
    make_files(
        folder,
        {"a.0008.exr", "a.0009.exr", "a.0012.exr", "a.10000.exr",  // one, longer than its padding
         "b_v2.9.exr", "b_v2.10.exr",                              // no padding
         "b_v3.9.exr",                                             // another version
         "beauty.1001.left.exr", "beauty.1002.left.exr", "still.EXR", "shot_20261121120000.exr",
         ".a.0008.exr.77.tmp", ".hidden.0001.exr", "a.0008.exr.json", "notes.txt"});
    std::filesystem::create_directory(folder.path("folder.0001.exr"));
    const auto found = must(scan_folder(folder.path("")));
    std::vector<std::string> patterns;
    for (const auto& sequence : found) {
        patterns.push_back(sequence.pattern.substr(folder.path("").size()));
        // Each is an --input that finds these frames.
        const FrameList list = list_of(sequence.pattern);
        EXPECT_EQ(list.frames, sequence.frames) << sequence.pattern;
        EXPECT_EQ(list.gaps, sequence.gaps) << sequence.pattern;
    }
    EXPECT_THAT(patterns,
                ElementsAre("a.####.exr", "b_v2.#.exr", "b_v3.9.exr", "beauty.####.left.exr",
                            "shot_20261121120000.exr", "still.EXR"));
    EXPECT_THAT(found[0].frames, ElementsAre(8, 9, 12, 10000));
}

TEST(ScanFolder, NegativeFramesAreOfTheSequence) {
    const TempFolder folder;
    for (const char* name :
         {"a.-010.exr", "a.-002.exr", "a.-001.exr", "a.0000.exr", "a.0001.exr",  // sign counted
          "b.-0002.exr", "b.-0001.exr", "b.0000.exr",                            // sign not counted
          "c.-2.exr", "c.-1.exr", "c.1.exr", "d_-03.exr", "d_-02.exr",           // only negative
          "e-0001.exr", "e-0002.exr", "f.-0007.exr"})                            // a separator
        test::write_text(folder.path(name), "x");
    const auto found = must(scan_folder(folder.path("")));
    std::map<std::string, std::vector<int>> frames;
    for (const auto& sequence : found) {
        frames[sequence.pattern.substr(folder.path("").size())] = sequence.frames;
        EXPECT_EQ(list_of(sequence.pattern).frames, sequence.frames) << sequence.pattern;
    }
    const std::map<std::string, std::vector<int>> expected = {{"a.####.exr", {-10, -2, -1, 0, 1}},
                                                              {"b.####.exr", {-2, -1, 0}},
                                                              {"c.#.exr", {-2, -1, 1}},
                                                              {"d_##.exr", {-3, -2}},
                                                              {"e-####.exr", {1, 2}},
                                                              {"f.-0007.exr", {-7}}};
    EXPECT_EQ(frames, expected);
}

TEST(ScanFolder, AFileThatNoInputCanNameIsLeftOut) {
    const TempFolder folder;
    make_files(folder, {"a#b#.exr", "d.exr"});
    const auto found = must(scan_folder(folder.path("")));
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found.front().pattern, folder.path("d.exr"));
}

TEST(ScanFolder, WhatHasNoFrameIsAnError) {
    const TempFolder folder;
    const auto empty = scan_folder(folder.path(""));
    EXPECT_EQ(empty.status().code(), StatusCode::input);
    EXPECT_THAT(empty.status().message(), HasSubstr("no EXR file"));
    const auto none = scan_folder(folder.path("none"));
    EXPECT_EQ(none.status().code(), StatusCode::input);
    EXPECT_THAT(none.status().message(), HasSubstr("cannot be read"));
}

std::string find_error(const std::string& input) {
    const Status status = find_frames(must(InputSpec::parse(input)), std::nullopt).status();
    EXPECT_EQ(status.code(), StatusCode::input);
    return status.message();
}

TEST(FindFrames, RefusesWhatHasNoOneFile) {
    const TempFolder folder;
    for (const char* name : {"b.####.exr", "b.exr"})
        EXPECT_THAT(find_error(folder.path(name)), HasSubstr(name));
    make_files(folder, {"b.0001.exr", "b.-005.exr", "b.-0006.exr", "a#b.exr"});
    EXPECT_THAT(find_error(folder.path("a#b.exr")),
                HasSubstr("the file of this very name must be renamed"));
    EXPECT_THAT(list_of(folder.path("b.####.exr")).frames, ElementsAre(-6, -5, 1));
    make_files(folder, {"b.-0005.exr"});
    EXPECT_THAT(find_error(folder.path("b.####.exr")),
                testing::AllOf(HasSubstr("b.-005.exr"), HasSubstr("b.-0005.exr")));
}

}  // namespace
}  // namespace postchain::io
