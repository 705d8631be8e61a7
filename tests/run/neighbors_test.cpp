// Neighboring frames as planes: which exist; each is read once; a part of a sequence gives the same
// result as the whole. The pass that reads them is tests/passes/echo.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numeric>

#include "config/profile.h"
#include "tests/run/fixture.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::sequence::neighbors_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::FrameFile;
using test::TempFolder;
using ::testing::HasSubstr;

constexpr int kWidth = 48, kHeight = 32;

// Result of the pass for frame n with those neighbors, from the planes as written. `sides`: 2 for
// `neighbors: both`.
ImageF echo_of(int n, bool before, bool after, bool vectors = true, int sides = 2) {
    ImageF sum = test::make_planes(kWidth, kHeight, n).color;
    for (float& value : sum.data) value *= 1 + 0.25f * float(sides);
    for (int other : {before ? n - 1 : n, after ? n + 1 : n}) {
        if (other == n) continue;
        const test::Planes planes = test::make_planes(kWidth, kHeight, other);
        for (size_t i = 0; i < sum.pixels(); ++i) {
            for (size_t c = 0; c < 4; ++c)
                sum.data[4 * i + c] -= 0.25f * planes.color.data[4 * i + c];
            if (!vectors) continue;
            sum.data[4 * i] += 1 / planes.depth.data[i];
            sum.data[4 * i + 1] += planes.motion.data[2 * i];
            sum.data[4 * i + 2] += planes.back.data[2 * i + 1];
        }
    }
    return sum;
}

// Their files may have them in another order, and some not at all.
TEST(AddNeighbors, LayersAreInTheOrderOfTheFrame) {
    const auto planes = [](std::initializer_list<float> values) {
        ImageF stack(1, int(values.size()), 4);
        int y = 0;
        for (const float value : values) std::fill_n(stack.pixel(0, y++), 4, value);
        return SharedPlanes{{Role::layers, std::make_shared<const ImageF>(std::move(stack))}};
    };
    const auto header_of = [](std::initializer_list<const char*> names) {
        FrameHeader header;
        header.window = {0, 0, 0, 0};
        for (const char* name : names) header.layers.filtered.emplace_back().name = name;
        return header;
    };
    SourceFrame frame;
    frame.header = header_of({"a", "b", "c"});
    frame.header.to_read = {Role::layers, Role::layers_before, Role::layers_after};
    frame.planes = planes({1, 2, 3});
    frame.description.width = frame.description.height = 1;
    const FrameHeader before = header_of({"c", "a", "b"}), after = header_of({"b", "a"});
    const SharedPlanes of_before = planes({6, 4, 5}), of_after = planes({8, 7});
    add_neighbors({{Neighbor::before, {&before, &of_before, nullptr}},
                   {Neighbor::after, {&after, &of_after, nullptr}}},
                  frame);
    const auto values = [](const SharedPlanes& of, Role role) {
        std::vector<float> found;
        if (const auto plane = of.find(role); plane != of.end())
            for (int y = 0; y < plane->second->height; ++y)
                found.push_back(plane->second->at(0, y));
        return found;
    };
    using Values = std::vector<float>;
    EXPECT_EQ(frame.description.layers, 2);
    EXPECT_EQ(values(frame.planes, Role::layers), (Values{1, 2}));
    EXPECT_EQ(values(frame.planes, Role::layers_before), (Values{4, 5}));
    EXPECT_EQ(values(frame.planes, Role::layers_after), (Values{7, 8}));
    ASSERT_EQ(frame.separate_layers.size(), 1u);
    const auto& [layers, apart] = frame.separate_layers[0];
    EXPECT_EQ(layers, std::vector<size_t>{2});
    EXPECT_EQ(values(apart, Role::layers), Values{3});
    EXPECT_EQ(values(apart, Role::layers_before), Values{6});
    EXPECT_EQ(values(apart, Role::layers_after), Values{});
}

class NeighborsTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.on_existing = io::OnExisting::overwrite;
        settings_.on_error = ErrorPolicy::keep_going;
        chain("both", true);
    }

    void chain(const char* neighbors, bool vectors) {
        vectors_ = vectors;
        chain_ =
            test::chain_of("echo", {{"neighbors", std::string(neighbors)}, {"vectors", vectors}});
    }
    void write(const std::vector<int>& numbers, const FrameFile& file = {}) {
        test::write_sequence(at(""), numbers, kWidth, kHeight, file);
    }
    RunSummary go() {
        reports_.clear();
        auto summary = SequenceTest::go([&](const FrameReport& report, const RunProgress&) {
            reports_[report.frame] = report;
        });
        EXPECT_TRUE(summary.ok()) << summary.status().message();
        return summary.ok() ? *summary : RunSummary();
    }
    // Runs, and expects frame n to have these neighbors, or this reason.
    void expect(int n, const std::string& no_before, const std::string& no_after) {
        ASSERT_EQ(reports_.at(n).outcome, Outcome::written) << reports_.at(n).status.message();
        const json missing = sidecar(n)["plan"].value("missing_neighbors", json::object());
        EXPECT_THAT(missing.value("before", ""), HasSubstr(no_before)) << n;
        EXPECT_THAT(missing.value("after", ""), HasSubstr(no_after)) << n;
        EXPECT_EQ(missing.size(), size_t(!no_before.empty()) + size_t(!no_after.empty())) << n;
        const ImageF expected = echo_of(n, no_before.empty(), no_after.empty(), vectors_);
        EXPECT_LE(test::largest_difference(test::read_color(out(n)), expected), 2e-6) << n;
        EXPECT_EQ(reports_.at(n).inputs.count(Role::color_before), size_t(no_before.empty()));
        EXPECT_EQ(reports_.at(n).inputs.count(Role::color_after), size_t(no_after.empty()));
    }

    std::map<int, FrameReport> reports_;
    bool vectors_ = true;
};

constexpr const char* kFirst = "is the first on disk";
constexpr const char* kLast = "is the last on disk";

TEST_F(NeighborsTest, EveryPlaneOfBothReachesThePass) {
    write({1, 2, 3, 4});
    go();
    expect(1, kFirst, "");
    expect(2, "", "");
    expect(3, "", "");
    expect(4, "", kLast);
    EXPECT_EQ(sidecar(3)["inputs"]["color_before"], in(2));
    EXPECT_EQ(sidecar(3)["inputs"]["color_after"], in(4));
    EXPECT_TRUE(reports_.at(1).warnings.empty());
}

TEST_F(NeighborsTest, AChainTakesThoseItAsksFor) {
    write({1, 2, 3});
    chain("before", false);
    frames("2");
    EXPECT_EQ(go().frames_decoded, 2u);
    EXPECT_LE(test::largest_difference(test::read_color(out(2)), echo_of(2, true, false, false, 1)),
              2e-6);
    // Planes that no pass needs are not converted, so no facts about them are known.
    EXPECT_TRUE(sidecar(2)["bounds"]["max_speed_px"].is_null());
    EXPECT_TRUE(sidecar(2)["bounds"]["max_inverse_depth"].is_null());
    chain("none", true);
    EXPECT_EQ(go().frames_decoded, 1u);
    EXPECT_EQ(sidecar(2)["inputs"].size(), 1u);
    EXPECT_FALSE(sidecar(2)["plan"].contains("missing_neighbors"));
}

TEST_F(NeighborsTest, APartGivesTheBitsOfTheWhole) {
    const std::vector<int> numbers = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    write(numbers);
    settings_.source.cuts = {7};
    EXPECT_EQ(go().frames_decoded, 10u);
    std::map<int, ImageF> whole;
    std::map<int, json> plans;
    for (int n : numbers) {
        whole[n] = test::read_color(out(n));
        plans[n] = sidecar(n)["plan"];
    }
    for (const char* part : {"5-8", "1", "9,2-4,3", "2-10x2", "10,9,8,7"}) {
        frames(part);
        go();
        for (const auto& [n, report] : reports_) {
            EXPECT_EQ(test::read_color(out(n)).data, whole.at(n).data) << part << " " << n;
            EXPECT_EQ(sidecar(n)["plan"], plans.at(n)) << part << " " << n;
        }
    }
    settings_.source.cuts.clear();
    frames("5-8");
    EXPECT_EQ(go().frames_decoded, 6u);
    frames("2-10x4");  // 2, 6, 10: each with its own neighbors
    EXPECT_EQ(go().frames_decoded, 8u);
}

TEST_F(NeighborsTest, PlanesAreSharedAndMemoryIsFlat) {
    std::vector<int> numbers(40);
    std::iota(numbers.begin(), numbers.end(), 1);
    write(numbers);
    std::vector<std::weak_ptr<const ImageF>> planes;
    std::shared_ptr<const ImageF> last_after, last_color;
    long most = 0;
    const auto summary = visit_sequence(
        settings_, chain_.required() | chain_.optional(),
        [&](SourceFrame& frame, FrameReport&) {
            const int n = frame.description.frame_number;
            EXPECT_EQ(frame.planes.size(), n == 1 || n == 40 ? 8u : 12u);
            const auto color = frame.planes.at(Role::color);
            if (n > 1) {
                EXPECT_EQ(color, last_after) << n;
                EXPECT_EQ(frame.planes.at(Role::color_before), last_color) << n;
            }
            if (n < 40) last_after = frame.planes.at(Role::color_after);
            last_color = color;
            planes.push_back(color);
            most = std::max(most, long(std::ranges::count_if(
                                      planes, [](const auto& one) { return !one.expired(); })));
            return Status();
        },
        {}, nullptr);
    ASSERT_TRUE(summary.ok());
    EXPECT_EQ(summary->frames_decoded, 40u);
    EXPECT_LE(most, kFramesInFlight + 1);
    // The reader keeps a frame only for neighbors.
    for (const bool kept : {false, true}) {
        SequenceReader reader(settings_.source, settings_.input, [&](const FrameHeader&) {
            return kept ? chain_.required() | chain_.optional() : RoleSet();
        });
        const auto opened = reader.open(2, {{Role::color, in(2)}});
        ASSERT_TRUE(opened.ok()) << opened.status().message();
        const auto frame = reader.read(*opened);
        ASSERT_TRUE(frame.ok()) << frame.status().message();
        EXPECT_EQ(frame->planes.at(Role::color).use_count(), kept ? 2 : 1);
    }
}

// Vectors are per frame of the renderer, whatever the step between files.
TEST_F(NeighborsTest, ThereIsNoneAcrossAGapOrACut) {
    struct Case {
        std::vector<int> frames;
        std::set<int> cuts;
        int frame;
        const char *no_before, *no_after;
    };
    const char *gap_after = "frame 3 is not on disk, and frame 4 is not the next one",
               *gap_before = "frame 3 is not on disk, and frame 2 is not the previous one",
               *gap_of_5 = "frame 5 is not on disk, and frame 6 is not the next one",
               *cut = "a cut follows frame 2";
    const Case cases[] = {
        {{1, 2, 4, 5}, {}, 2, "", gap_after},     {{1, 2, 4, 5}, {}, 4, gap_before, ""},
        {{2, 4, 6}, {}, 4, gap_before, gap_of_5}, {{1, 2, 3, 4}, {2}, 1, kFirst, ""},
        {{1, 2, 3, 4}, {2}, 2, "", cut},          {{1, 2, 3, 4}, {2}, 3, cut, ""},
    };
    for (const Case& one : cases) {
        for (int n = 1; n <= 6; ++n) fs::remove(in(n));
        write(one.frames);
        settings_.source.cuts = one.cuts;
        chain("both", one.cuts.empty());
        go();
        expect(one.frame, one.no_before, one.no_after);
    }
    input("in.0002.exr");
    go();
    expect(2, "the input is one file", "the input is one file");
}

// Another data window does not change positions: the same image pixels correspond, and pixels that
// the neighbor lacks are clear.
TEST_F(NeighborsTest, OneOfAnotherDataWindowIsAlignedInTheDisplayWindow) {
    write({1, 2, 3, 4});
    const io::Window display = {0, 0, kWidth - 1, kHeight - 1};
    const auto with = [&](const io::Window& data) {
        const test::Planes whole = test::make_planes(kWidth, kHeight, 3);
        FrameFile file;
        file.origin_x = data.min_x;
        file.origin_y = data.min_y;
        file.display = display;
        test::write_frame(
            in(3),
            {io::placed(whole.color, display, data), io::placed(whole.depth, display, data),
             io::placed(whole.motion, display, data), io::placed(whole.back, display, data)},
            file);
        go();
    };
    with({-4, -3, kWidth + 1, kHeight - 1});  // overscan
    expect(2, "", "");
    const io::Window crop = {5, 2, kWidth - 1, kHeight - 4};
    with(crop);
    ImageF expected = echo_of(2, true, true);
    const test::Planes left_out = test::make_planes(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if (crop.contains({x, y, x, y})) continue;
            for (int c = 0; c < 4; ++c) expected.at(x, y, c) += 0.25f * left_out.color.at(x, y, c);
            expected.at(x, y, 0) -= 1 / left_out.depth.at(x, y);
            expected.at(x, y, 1) -= left_out.motion.at(x, y, 0);
            expected.at(x, y, 2) -= left_out.back.at(x, y, 1);
        }
    }
    EXPECT_LE(test::largest_difference(test::read_color(out(2)), expected), 2e-6);
}

TEST_F(NeighborsTest, OneThatDoesNotFitIsNone) {
    FrameFile left, right, still, arnold;
    left.attributes["view"] = std::string("left");
    right.attributes["view"] = std::string("right");
    still.motion = false;
    arnold.convention = "arnold";
    struct Case {
        FrameFile file, third;  // of the others, of frame 3
        int width;              // of frame 3
        std::set<int> cuts;
        const char *after_2, *before_4;
    };
    const Case cases[] = {
        {{},
         {},
         kWidth + 2,
         {},
         "frame 3 has display window (0, 0)-(49, 31), this one (0, 0)",
         "frame 3 has display window"},
        {left, right, kWidth, {}, "frame 3 has no view left", "frame 3 has no view left"},
        // Nothing says how the last frame of a shot moves.
        {arnold,
         arnold,
         kWidth,
         {3},
         "the motion of frame 3 crosses a cut",
         "a cut follows frame 3"},
        {{}, still, kWidth, {}, "frame 3 has no motion", "frame 3 has no motion"},
    };
    for (const Case& one : cases) {
        SCOPED_TRACE(one.after_2);
        write({1, 2, 4}, one.file);
        test::write_frame(in(3), test::make_planes(one.width, kHeight, 3), one.third);
        settings_.source.cuts = one.cuts;
        chain("both", one.cuts.empty());
        go();
        expect(2, "", one.after_2);
        expect(4, one.before_4, kLast);
    }
    // A frame uses only neighbor planes that it has itself.
    ASSERT_EQ(reports_.at(3).outcome, Outcome::written);
    EXPECT_TRUE(reports_.at(3).plan->missing_neighbors.empty());
    EXPECT_FALSE(reports_.at(3).plan->reads.has(Role::motion_before));
    EXPECT_TRUE(reports_.at(3).plan->reads.has(Role::inverse_depth_before));
}

TEST_F(NeighborsTest, OneThatCannotBeReadIsNoneAndIsWarnedOf) {
    write({1, 2, 3, 4});
    for (const uintmax_t bytes : {uintmax_t(100), fs::file_size(in(3)) - 200}) {
        write({3});
        fs::resize_file(in(3), bytes);
        go();
        expect(2, "", "in.0003.exr");
        expect(4, "in.0003.exr", kLast);
        ASSERT_EQ(reports_.at(2).warnings.size(), 1u) << bytes;
        EXPECT_THAT(reports_.at(2).warnings[0], HasSubstr("filtered without the frame after: "));
        EXPECT_EQ(reports_.at(3).outcome, Outcome::failed);
        // A part of the sequence that finds the damage itself gives the same result.
        const ImageF two = test::read_color(out(2));
        frames("2");
        go();
        EXPECT_EQ(test::read_color(out(2)).data, two.data);
        settings_.frames.reset();
    }
}

// Its caller tries the files.
TEST_F(NeighborsTest, OneWhoseTrialFailsIsNotOpened) {
    write({1, 2, 3, 4});
    std::set<int> tried;
    const auto summary = run_sequence(
        chain_, settings_, test::executor(), "renderer",
        {.finished = [&](const FrameReport& report,
                         const RunProgress&) { reports_[report.frame] = report; },
         .try_file =
             [&](const std::string& path, int number) {
                 EXPECT_EQ(path, in(number));
                 tried.insert(number);
                 return number == 3 ? Status(StatusCode::input, path + ": crashes") : Status();
             }});
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(tried, (std::set<int>{1, 2, 3, 4}));
    expect(1, kFirst, "");
    expect(2, "", "in.0003.exr: crashes");
    expect(4, "in.0003.exr: crashes", kLast);
    EXPECT_EQ(reports_.at(3).outcome, Outcome::failed);
    EXPECT_THAT(reports_.at(3).status.message(), HasSubstr("in.0003.exr: crashes"));
}

// A neighbor without memory fails the frame: if it were left out, the image would depend on the
// machine.
TEST_F(NeighborsTest, OneTooLargeForMemoryFailsTheFrame) {
    write({1, 2, 3, 4});
    FrameFile overscan;
    overscan.origin_x = overscan.origin_y = -200;
    overscan.display = io::Window{0, 0, kWidth - 1, kHeight - 1};
    test::write_frame(in(3), test::make_planes(kWidth + 400, kHeight + 400, 3), overscan);
    settings_.source.max_memory = 4 << 20;
    go();
    EXPECT_EQ(reports_.at(1).outcome, Outcome::written) << reports_.at(1).status.message();
    for (const int frame : {2, 3, 4}) {
        EXPECT_EQ(reports_.at(frame).outcome, Outcome::failed) << frame;
        EXPECT_EQ(reports_.at(frame).status.code(), StatusCode::memory) << frame;
        EXPECT_FALSE(fs::exists(out(frame))) << frame;
    }
    // Also if only the reader notices it.
    SequenceReader reader(settings_.source, settings_.input, [&](const FrameHeader& header) {
        return planes_needed(chain_, settings_.source, header, settings_.plan);
    });
    const auto opened = reader.open(2, {{Role::color, in(2)}});
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    EXPECT_EQ(opened->neighbors.count(Neighbor::after), 1u);
    const auto frame = reader.read(*opened);
    EXPECT_EQ(frame.status().code(), StatusCode::memory);
    EXPECT_THAT(frame.status().message(), HasSubstr("in.0003.exr"));
}

// The frame and what is kept beside it.
TEST_F(NeighborsTest, MemoryOfNeighborsCounts) {
    write({1, 2, 3});
    frames("2");
    chain("none", false);
    settings_.source.max_memory = 1 << 14;
    do {
        settings_.source.max_memory *= 2;
        go();
    } while (reports_.at(2).status.code() == StatusCode::memory);
    EXPECT_EQ(reports_.at(2).outcome, Outcome::written) << reports_.at(2).status.message();
    chain("both", false);
    go();
    EXPECT_EQ(reports_.at(2).status.code(), StatusCode::memory);
}

// A missing frame is replaced by the image of another one with that one's neighbors.
TEST_F(NeighborsTest, AHeldFrameIsThePictureOfItsSource) {
    write({1, 2, 4});
    settings_.missing = MissingPolicy::hold;
    frames("1-4");
    go();
    EXPECT_EQ(reports_.at(3).outcome, Outcome::held);
    EXPECT_EQ(test::read_color(out(3)).data, test::read_color(out(2)).data);
    expect(2, "", "frame 3 is not on disk");
    expect(4, "frame 3 is not on disk", kLast);
}

TEST_F(NeighborsTest, AWrongPixelOfANeighborIsAnErrorUnderStrict) {
    write({1, 2, 3, 4, 5});
    test::Planes planes = test::make_planes(kWidth, kHeight, 3);
    planes.color.at(5, 7, 1) = std::numeric_limits<float>::quiet_NaN();
    test::write_frame(in(3), planes);
    go();
    for (int n = 1; n <= 5; ++n) EXPECT_EQ(reports_.at(n).outcome, Outcome::written) << n;
    settings_.strict = true;
    go();
    for (int n : {1, 5}) EXPECT_EQ(reports_.at(n).outcome, Outcome::written) << n;
    for (int n : {2, 3, 4}) {
        EXPECT_EQ(reports_.at(n).status.code(), StatusCode::health) << n;
        EXPECT_THAT(reports_.at(n).status.message(), HasSubstr("in.0003.exr: 1 non-finite"));
    }
}

// Depths next to 0 have the largest inverse that a float holds: the pass adds those of both
// neighbors.
TEST_F(NeighborsTest, AResultThatIsNotFiniteIsAnErrorUnderStrict) {
    for (const int n : {1, 2, 3}) {
        test::Planes planes = test::make_planes(kWidth, kHeight, n);
        planes.depth.at(5, 7) = 1e-45f;
        test::write_frame(in(n), planes);
    }
    settings_.overflow = io::HalfOverflow::clamp;
    go();
    for (const int n : {1, 2, 3}) {
        EXPECT_EQ(reports_.at(n).outcome, Outcome::written) << reports_.at(n).status.message();
        EXPECT_EQ(reports_.at(n).output_nonfinite, n == 2 ? 1u : 0u) << n;
    }
    settings_.strict = true;
    go();
    for (const int n : {1, 3}) EXPECT_EQ(reports_.at(n).outcome, Outcome::written) << n;
    EXPECT_EQ(reports_.at(2).status.code(), StatusCode::health);
    EXPECT_THAT(reports_.at(2).status.message(), HasSubstr("o.0002.exr: 1 non-finite output"));

    // Also if only its division by a small alpha makes it so.
    settings_.source.profile =
        parse_profile(
            "profile: 1\nname: own\ncolor: [{channels: [[R, G, B, A]], unpremultiplied: true}]\n",
            "own.yaml")
            .profile;
    ImageF before(8, 8, 4), color(8, 8, 4, 1);
    for (size_t i = 0; i < color.pixels(); ++i) {
        before.data[4 * i + 3] = 5 - 0x1p-20f;  // leaves an alpha of 2^-22
        color.data[4 * i] = i == 9 ? 1e33f : 1;
    }
    for (const auto& [n, image] : {std::pair(1, before), {2, color}})
        ASSERT_TRUE(
            io::write_planes_exr(in(n), image, {"R", "G", "B", "A"}, io::OnExisting::overwrite)
                .ok());
    chain("before", false);
    frames("2");
    for (const bool strict : {false, true}) {
        settings_.strict = strict;
        go();
        EXPECT_EQ(reports_.at(2).status.code(), strict ? StatusCode::health : StatusCode::ok)
            << reports_.at(2).status.message();
        EXPECT_EQ(reports_.at(2).output_nonfinite, 1u);
    }
}

// A neighbor is read with the layers that it has. As a frame it fails without one that is named.
TEST_F(NeighborsTest, OneWithoutANamedLayerFailsAsAFrame) {
    FrameFile light;
    for (const char* channel : {"light.R", "light.G", "light.B"})
        light.mattes[channel] = ImageF(kWidth, kHeight, 1, 0.5f);
    write({1, 2}, light);
    write({3});
    settings_.source.layers.aovs = "light";
    go();
    expect(2, "", "");
    EXPECT_EQ(reports_.at(3).status.code(), StatusCode::usage);
}

TEST_F(NeighborsTest, OneThatChangesMeanwhileFailsTheFrame) {
    for (const int changed : {1, 3}) {
        write({1, 2, 3});
        frames("2");
        const auto touch = [&](FrameStep step, int, bool begins) {
            if (begins && step == FrameStep::filter)
                fs::last_write_time(in(changed), fs::file_time_type::clock::now());
        };
        const auto summary =
            run_sequence(chain_, settings_, test::executor(), "renderer", {.steps = touch});
        ASSERT_TRUE(summary.ok()) << summary.status().message();
        EXPECT_THAT(summary->first_failure.message(), HasSubstr(in(changed) + ": was changed"));
    }
}

TEST_F(NeighborsTest, AFrameIsDoneOnlyWithTheSameNeighbors) {
    write({1, 2, 3, 4, 5});
    settings_.on_existing = io::OnExisting::skip;
    const auto redone = [&] {
        go();
        std::string text;
        for (const auto& [n, report] : reports_)
            if (report.outcome == Outcome::written) text += std::to_string(n);
        return text;
    };
    const auto touch = [&](int n) {
        fs::last_write_time(in(n), fs::last_write_time(in(n)) + std::chrono::hours(1));
    };
    EXPECT_EQ(redone(), "12345");
    EXPECT_EQ(redone(), "");
    touch(3);
    EXPECT_EQ(redone(), "234");
    write({6});
    EXPECT_EQ(redone(), "56");
    settings_.source.cuts = {2};
    EXPECT_EQ(redone(), "1234");  // the vectors of 2 and 3 too
    chain("none", true);
    EXPECT_EQ(redone(), "123456");
    touch(3);
    EXPECT_EQ(redone(), "3");
}

}  // namespace
}  // namespace postchain::sequence::neighbors_test
