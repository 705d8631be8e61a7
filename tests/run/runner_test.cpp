// The runner in this process: overlap, stopping, exceptions, foreign locales.

#include <ImfMultiView.h>
#include <ImfStandardAttributes.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <locale>
#include <new>
#include <numeric>
#include <sstream>
#include <thread>

#include "config/chain_file.h"
#include "passes/registry.h"
#include "tests/io/exr_files.h"
#include "tests/run/fixture.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

class RunnerTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        chain(test::kAllPasses);
    }
    void TearDown() override { EXPECT_TRUE(test::temporaries(at("out")).empty()); }

    std::vector<int> write(int count) const {
        std::vector<int> numbers(static_cast<size_t>(count));
        std::iota(numbers.begin(), numbers.end(), 1);
        test::write_sequence(at(""), numbers);
        return numbers;
    }
    // The summary of a run that does this when a frame has been read.
    RunSummary before_the_filter(const std::function<void()>& change,
                                 const std::atomic<bool>* stop = nullptr) {
        const auto at_step = [&](FrameStep step, int, bool begins) {
            if (begins && step == FrameStep::filter) change();
        };
        const auto summary = run_sequence(chain_, settings_, test::executor(), "renderer",
                                          {.stop = stop, .steps = at_step});
        EXPECT_TRUE(summary.ok()) << summary.status().message();
        return summary.ok() ? *summary : RunSummary();
    }
    void chain(const char* text) {
        auto parsed = parse_chain(text, "chain.yaml", builtin_passes());
        ASSERT_TRUE(parsed.status().ok()) << parsed.status().message();
        chain_ = std::move(parsed.chain);
    }
};

TEST_F(RunnerTest, ReportsEveryFrameInOrderAndStaysBounded) {
    const std::vector<int> numbers = write(30);
    std::vector<int> seen;
    size_t done = 0;
    const auto summary = go([&](const FrameReport& report, const RunProgress& progress) {
        seen.push_back(report.frame);
        EXPECT_EQ(report.outcome, Outcome::written) << report.status.message();
        EXPECT_EQ(progress.done, ++done);
        EXPECT_EQ(progress.total, 30u);
        EXPECT_GE(progress.remaining_s, 0);
        EXPECT_LE(report.frames_in_flight, kFramesInFlight);
    });
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(seen, numbers);
    EXPECT_EQ(summary->written, 30u);
    EXPECT_LE(summary->frames_in_flight, kFramesInFlight);
    EXPECT_GE(summary->frames_in_flight, 2);  // frames overlap
    // The given order is kept, even if it is not numeric.
    frames("7,3,5");
    settings_.on_existing = io::OnExisting::overwrite;
    seen.clear();
    EXPECT_TRUE(go([&](const FrameReport& report, const RunProgress&) {
                    seen.push_back(report.frame);
                }).ok());
    EXPECT_EQ(seen, (std::vector<int>{7, 3, 5}));
}

TEST_F(RunnerTest, StopsWhenAsked) {
    const std::vector<int> numbers = write(40);
    std::atomic<bool> stop = false;
    const auto summary =
        go([&](const FrameReport& report, const RunProgress&) { stop = report.frame >= 2; }, &stop);
    ASSERT_TRUE(summary.ok());
    EXPECT_GE(summary->written, 2u);
    EXPECT_LE(summary->written, 2u + kFramesInFlight);
    EXPECT_EQ(summary->failed, 0u);
    size_t files = 0;
    for (int frame : numbers) files += fs::exists(out(frame)) ? 1 : 0;
    EXPECT_EQ(files, summary->written);
    // Stop requested before the start: nothing is done, and existing outputs are not looked for.
    const auto none = go({}, &stop);
    ASSERT_TRUE(none.ok()) << none.status().message();
    EXPECT_EQ(none->written, 0u);
    EXPECT_EQ(none->total, 40u);
}

// The executor counts dispatches when a frame is finished: a frame that is given up adds none.
TEST_F(RunnerTest, StopsWithinAFrame) {
    test::write_sequence(at(""), {1});
    const uint64_t before = test::executor().counters().dispatches;
    std::atomic<bool> stop = false;
    const RunSummary summary = before_the_filter([&] { stop = true; }, &stop);
    EXPECT_TRUE(stop);
    EXPECT_EQ(test::executor().counters().dispatches, before);
    EXPECT_EQ(summary.written, 0u);
    EXPECT_EQ(summary.failed, 0u);
    EXPECT_FALSE(fs::exists(out(1)));
}

TEST_F(RunnerTest, AnInputThatChangesMeanwhileFailsItsFrame) {
    settings_.preview = true;
    const std::pair<const char*, std::function<void()>> changes[] = {
        {"rewritten", [&] { test::write_frame(in(1), test::make_planes(48, 32, 2)); }},
        {"touched", [&] { fs::last_write_time(in(1), fs::file_time_type::clock::now()); }},
        {"removed", [&] { fs::remove(in(1)); }},
    };
    for (const auto& [how, change] : changes) {
        SCOPED_TRACE(how);
        test::write_sequence(at(""), {1});
        const Status failure = before_the_filter(change).first_failure;
        EXPECT_EQ(failure.code(), StatusCode::input);
        for (const std::string& word : {in(1), std::string("while")})
            EXPECT_NE(failure.message().find(word), std::string::npos) << failure.message();
        EXPECT_TRUE(fs::is_empty(at("out")));
    }
}

// A failure must not affect frames before it, wherever they are in the pipeline.
TEST_F(RunnerTest, FramesBeforeAFailureAreFinished) {
    for (const int bad : {1, 4, 8}) {
        fs::remove_all(at("out"));
        fs::create_directory(at("out"));
        write(8);
        fs::resize_file(in(bad), 900);
        const auto summary = go();
        ASSERT_TRUE(summary.ok()) << summary.status().message();
        EXPECT_EQ(summary->written, size_t(bad - 1));
        EXPECT_EQ(summary->failed, 1u);
        EXPECT_EQ(summary->first_failure.code(), StatusCode::input);
        for (int frame = 1; frame <= 8; ++frame)
            EXPECT_EQ(fs::exists(out(frame)), frame < bad) << frame << " with " << bad;
    }
}

TEST_F(RunnerTest, NothingThatIsThrownLeavesIt) {
    test::write_sequence(at(""), {1, 2, 3, 4});
    const auto summary = go([](const FrameReport& report, const RunProgress&) {
        if (report.frame == 2) throw std::bad_alloc();
    });
    ASSERT_TRUE(summary.ok());
    EXPECT_EQ(summary->failed, 1u);
    EXPECT_EQ(summary->first_failure.code(), StatusCode::memory);
}

TEST_F(RunnerTest, CountersAreThoseOfThePlan) {
    test::write_sequence(at(""), {1, 2, 3});
    ASSERT_TRUE(go().ok());
    const auto first = sidecar(1)["counters"], last = sidecar(3)["counters"];
    EXPECT_EQ(first["texture_allocations"], last["texture_allocations"]);
    EXPECT_EQ(first["programs"], last["programs"]);
    int planned = 0;
    const auto plan = sidecar(3)["plan"];
    for (const auto& pass : plan["passes"]) planned += pass["dispatches"].get<int>();
    EXPECT_EQ(last["dispatches"].get<int>() - sidecar(2)["counters"]["dispatches"].get<int>(),
              planned);
}

// Comma as decimal point, dots between thousands, as on a German desktop.
struct German : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

TEST_F(RunnerTest, AForeignLocaleChangesNothing) {
    test::write_sequence(at(""), {1, 1001});
    ASSERT_TRUE(go().ok());
    const ImageF color = test::read_color(out(1001));
    const auto first = sidecar(1001);
    settings_.on_existing = io::OnExisting::overwrite;
    settings_.dump_folder = at("stages");
    fs::create_directory(settings_.dump_folder);
    const std::locale before = std::locale::global(std::locale(std::locale(), new German));
    std::ostringstream shown;
    shown << 1001.5;
    EXPECT_EQ(shown.str(), "1.001,5");  // the locale is active
    chain(test::kAllPasses);            // parsing uses it too
    const auto summary = go();
    const auto second = sidecar(1001);
    std::locale::global(before);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->written, 2u);
    EXPECT_TRUE(fs::exists(at("stages/0.motion_blur.color.1001.exr")));
    EXPECT_EQ(test::read_color(out(1001)).data, color.data);
    ASSERT_TRUE(second.is_object());
    for (const char* key : {"work", "plan", "frame"}) EXPECT_EQ(second[key], first[key]) << key;
}

TEST_F(RunnerTest, RefusalsBeforeAnythingIsDone) {
    test::write_sequence(at(""), {1, 2});
    const auto refused = [&](StatusCode code) {
        size_t calls = 0;
        const auto summary = go([&](const FrameReport&, const RunProgress&) { ++calls; });
        EXPECT_FALSE(summary.ok());
        EXPECT_EQ(summary.status().code(), code) << summary.status().message();
        EXPECT_EQ(calls, 0u);
    };
    frames("1-3");
    refused(StatusCode::input);  // frame 3 is missing
    settings_.frames.reset();
    std::ofstream(out(2)) << "something";
    refused(StatusCode::output);
    EXPECT_FALSE(fs::exists(out(1)));
    settings_.on_existing = io::OnExisting::overwrite;
    std::ofstream(at("file")) << "something";
    settings_.dump_folder = at("file");
    refused(StatusCode::output);
    settings_.dump_folder.clear();
    for (const auto& [output, code] : {std::pair{"out/o.exr", StatusCode::usage},
                                       {"in.####.exr", StatusCode::usage},
                                       {"none/o.####.exr", StatusCode::output},
                                       {"out/o.####.gif", StatusCode::usage}}) {
        settings_.output = *io::PathPattern::parse(at(output));
        refused(code);
    }
}

// Files that may get the name of a stage, or of an output of a watch, whose frames are not known.
TEST_F(RunnerTest, RefusesFilesThatCouldBeReplaced) {
    fs::create_directory(at("stages"));
    settings_.dump_folder = at("stages");
    const auto refuses = [&](const std::string& name) {
        test::write_text(at(name), "mine");
        std::vector<FrameTask> tasks;
        if (!settings_.watch) tasks.push_back({.frame = 1, .source = 1, .output = out(1)});
        const io::OutputFiles files = files_of_run(chain_, settings_, tasks);
        const Status status = files.check();
        fs::remove(at(name));
        EXPECT_EQ(status.ok() ? "" : at(name),
                  status.message().substr(0, status.message().find(':')));
        return !status.ok();
    };
    EXPECT_TRUE(refuses("stages/0.motion_blur.color.0001.exr"));
    for (const char* name : {"0.motion_blur.color.0002.exr", "0.fxaa.color.0001.exr", "o.0001.exr"})
        EXPECT_FALSE(refuses(concat("stages/", name))) << name;
    for (const bool watches : {false, true})
        for (const bool more : {false, true}) {
            if (watches) settings_.watch = Watch();
            settings_.sidecar = settings_.preview = more;
            EXPECT_EQ(refuses("out/o.0007.exr"), watches);
            EXPECT_EQ(refuses("out/o.0007.exr.json"), watches && more);
            EXPECT_EQ(refuses("out/o.0007.png"), watches && more);
            for (const char* name : {"out/p.0007.exr", "out/o.0007.json", "out/p.0007.exr.json"})
                EXPECT_FALSE(refuses(name)) << name;
        }
}

// Waits in each frame until the next one is known.
class PatientJob final : public FrameJob {
  public:
    explicit PatientJob(int last) : last_(last) {}
    std::vector<int> known;

    io::Keep keep() const override { return io::Keep::nothing; }
    RoleSet planes(const FrameHeader&) const override { return {}; }
    Result<bool> begin(const FrameTask&, const FrameToRead&, FrameReport&) override { return true; }
    Status prepare(const SourceFrame&, FrameReport&) override { return Status(); }
    Status process(FrameInFlight& frame, const Upcoming& upcoming) override {
        if (frame.report.frame == last_) {
            EXPECT_EQ(upcoming(), nullptr);
            return Status();
        }
        const auto last = std::chrono::steady_clock::now() + std::chrono::minutes(2);
        const FrameInFlight* next = nullptr;
        while (!(next = upcoming()) && std::chrono::steady_clock::now() < last)
            std::this_thread::yield();
        if (!next) return Status(StatusCode::internal, "the next frame is not known");
        EXPECT_EQ(upcoming(), next);
        EXPECT_TRUE(next->source);
        known.push_back(next->report.frame);
        return Status();
    }
    Status write(FrameInFlight&) override { return Status(); }

  private:
    int last_;
};

// Fails frame 2 before it is filtered, 3 then and 4 when it is written.
class FailingJob final : public FrameJob {
  public:
    io::Keep keep() const override { return io::Keep::nothing; }
    RoleSet planes(const FrameHeader&) const override { return {}; }
    Result<bool> begin(const FrameTask& task, const FrameToRead&, FrameReport&) override {
        return task.frame != 1;
    }
    Status prepare(const SourceFrame&, FrameReport& report) override {
        return status_of(report, 2);
    }
    Status process(FrameInFlight& frame, const Upcoming&) override {
        return status_of(frame.report, 3);
    }
    Status write(FrameInFlight& frame) override { return status_of(frame.report, 4); }

  private:
    static Status status_of(const FrameReport& report, int failing) {
        return report.frame == failing ? Status(StatusCode::internal, "meant to") : Status();
    }
};

// The limit is one frame's memory: if a part of it did not come back, the next frame would wait
// forever, and the alarm ends the test.
TEST_F(RunnerTest, TheMemoryOfAFrameComesBackHoweverItEnds) {
    test::write_sequence(at(""), {1, 2, 3, 4, 5, 6, 7});
    fs::resize_file(in(5), fs::file_size(in(5)) - 200);  // fails while it is read
    settings_.on_error = ErrorPolicy::keep_going;
    auto header = open_source_frame(settings_.source, {{Role::color, in(1)}}, 1);
    ASSERT_TRUE(header.ok()) << header.status().message();
    settings_.source.max_memory =
        frame_bytes(*header, {Role::color}, io::Keep::nothing, header->window.height());
    std::vector<int> gaps;
    auto tasks = plan_tasks(settings_, false, gaps);
    ASSERT_TRUE(tasks.ok()) << tasks.status().message();
    ListFeed feed(std::move(*tasks), settings_);
    FailingJob job;
    ::alarm(120);
    const auto summary = walk_sequence(job, settings_, feed, {});
    ::alarm(0);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->skipped, 1u);
    EXPECT_EQ(summary->failed, 4u);
    EXPECT_EQ(summary->written, 2u);
}

// Both eyes in one file: each is filtered as it is alone, and its memory and faults count.
TEST_F(RunnerTest, EveryViewIsFilteredAsAlone) {
    const auto write = [&](std::optional<size_t> nan_in) {
        test::FilePart part{.data = {{0, 0}, {23, 15}}, .display = {{0, 0}, {23, 15}}};
        for (const char* name : {"B", "G", "R", "right.B", "right.G", "right.R"})
            part.channels.push_back({name});
        part.edit = [](Imf::Header& header) { Imf::addMultiView(header, {"left", "right"}); };
        const test::FilePart noise = part;
        if (nan_in)
            part.bits = [=](size_t channel, int x, int y) {
                return channel == nan_in && x == 3 && y == 4
                           ? 0x7e00u
                           : test::sample_bits(noise, channel, x, y);
            };
        test::write_file(in(1), {part});
    };
    const auto filtered = [&](const char* view, const std::string& prefix) {
        settings_.source.view = view;
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        auto file = io::ExrFile::open(out(1));
        EXPECT_TRUE(file.ok());
        auto color = file->read_channels(0, {prefix + "R", prefix + "G", prefix + "B"});
        EXPECT_TRUE(color.ok()) << color.status().message();
        return std::move(*color);
    };
    chain("postchain: 1\npasses: [fxaa]\n");
    settings_.on_existing = io::OnExisting::overwrite;
    write(std::nullopt);
    const ImageF left = filtered("all", ""), right = filtered("all", "right.");
    EXPECT_EQ(filtered("left", ""), left);
    EXPECT_NE(filtered("right", ""), left);
    EXPECT_EQ(filtered("right", "right."), right);
    EXPECT_NE(filtered("left", "right."), right);
    // One fits, and two do not.
    settings_.source.view = "left";
    settings_.source.max_memory = 1 << 10;
    while (last_frame().status.code() == StatusCode::memory) settings_.source.max_memory *= 2;
    EXPECT_TRUE(last_frame().status.ok());
    settings_.source.view = "all";
    EXPECT_EQ(last_frame().status.code(), StatusCode::memory);
    settings_.source.max_memory = 0;
    settings_.strict = true;
    EXPECT_TRUE(last_frame().status.ok());
    for (const size_t channel : {size_t(1), size_t(4)}) {
        write(channel);
        EXPECT_EQ(last_frame().status.code(), StatusCode::health) << channel;
    }
}

// The reach of guertin's blur: 1.006 max_blur_px + 0.5 (docs/motion_blur.md).
TEST_F(RunnerTest, TheDataWindowGrowsByTheReachOfTheChain) {
    const io::Window crop = {40, 34, 61, 51};
    test::write_frame(
        in(1), test::make_planes(crop.width(), crop.height(), 1),
        {.origin_x = crop.min_x, .origin_y = crop.min_y, .display = {{0, 0, 119, 89}}});
    settings_.on_existing = io::OnExisting::overwrite;
    const auto expect_window = [&](DataWindow how, const io::Window& expected) {
        settings_.source.data_window = how;
        EXPECT_TRUE(go().ok());
        EXPECT_EQ(test::must(io::ExrFile::open(out(1))).parts()[0].data_window, expected);
    };
    chain("postchain: 1\npasses: [motion_blur: {mode: guertin, max_blur_px: 10, samples: 5}]\n");
    expect_window(DataWindow::grow, crop.grown(11));
    EXPECT_THAT(sidecar(1)["write_notes"].dump(), HasSubstr("grown to " + crop.grown(11).text()));
    expect_window(DataWindow::keep, crop);
    chain("postchain: 1\npasses: [motion_blur: {shutter_frames: 0}]\n");
    expect_window(DataWindow::grow, crop);
}

// FXAA is left out of a view of one color, which therefore needs no more pixels than it has.
TEST_F(RunnerTest, TheDataWindowHoldsWhatEveryViewReaches) {
    chain("postchain: 1\npasses: [fxaa]\n");
    settings_.on_existing = io::OnExisting::overwrite;
    settings_.source.data_window = DataWindow::grow;
    const auto written = [&](const char* view) {
        settings_.source.view = view;
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        return test::must(io::ExrFile::open(out(1))).parts()[0].data_window;
    };
    for (const bool left_is_plain : {true, false}) {
        test::FilePart part{.data = {{24, 20}, {47, 35}}, .display = {{0, 0}, {71, 55}}};
        for (const char* name : {"B", "G", "R", "right.B", "right.G", "right.R"})
            part.channels.push_back({name});
        part.edit = [](Imf::Header& header) { Imf::addMultiView(header, {"left", "right"}); };
        const test::FilePart noise = part;
        part.bits = [=](size_t channel, int x, int y) {
            return (channel < 3) == left_is_plain ? 0u : test::sample_bits(noise, channel, x, y);
        };
        test::write_file(in(1), {part});
        const io::Window large = written(left_is_plain ? "right" : "left");
        EXPECT_LT(large.min_x, 24);
        EXPECT_EQ(written(left_is_plain ? "left" : "right"), (io::Window{24, 20, 47, 35}));
        EXPECT_EQ(written("all"), large) << left_is_plain;
    }
}

// Its frame is read as a neighbor, and its manifest for the matte.
TEST_F(RunnerTest, TheManifestOfANeighborIsNotReplaced) {
    chain("postchain: 1\npasses: [fxaa: {matte: \"cryptomatte:ball\"}]\n");
    settings_.output = *io::PathPattern::parse(at("o.####.exr"));
    frames("2");
    for (const auto& [frame, refused] : {std::pair(1, true), {2, true}, {3, true}, {4, false}}) {
        test::write_sequence(at(""), {1, 2, 3, 4});
        test::FrameFile file;
        for (const char* channel : {"R", "G", "B", "A"})
            file.mattes[concat("crypto00.", channel)] = ImageF(48, 32, 1);
        const std::string key = "cryptomatte/1234567/";
        file.attributes = {{key + "name", std::string("crypto")},
                           {key + "hash", std::string("MurmurHash3_32")},
                           {key + "conversion", std::string("uint32_to_float32")},
                           {key + "manif_file", std::string("o.0002.exr.json")}};
        test::write_frame(in(frame), test::make_planes(48, 32), file);
        test::write_text(at("o.0002.exr.json"), "{\"ball\": \"64a1a2a3\"}");
        const std::string why = failure();
        EXPECT_EQ(why.find("the manifest of cryptomatte crypto") != why.npos, refused)
            << frame << ": " << why;
    }
}

TEST_F(RunnerTest, AFrameThatIsProcessedKnowsTheNextOne) {
    test::write_sequence(at(""), {1, 2, 3, 4, 5});
    std::vector<int> gaps;
    auto tasks = plan_tasks(settings_, false, gaps);
    ASSERT_TRUE(tasks.ok()) << tasks.status().message();
    ListFeed feed(std::move(*tasks), settings_);
    PatientJob job(5);
    const auto summary = walk_sequence(job, settings_, feed, {});
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->written, 5u);
    EXPECT_EQ(job.known, (std::vector<int>{2, 3, 4, 5}));
}

}  // namespace
}  // namespace postchain::sequence
