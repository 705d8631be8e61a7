// What a run writes down, and what follows from it: fingerprints, outputs that are done already,
// exit codes.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "chain/base/text.h"
#include "chain/plan/elision.h"
#include "config/chain_file.h"
#include "tests/run/fixture.h"
#include "tools/sequence/record/check_outputs.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/record/record.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence::record_test {
namespace {

namespace fs = std::filesystem;

class Fingerprint : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        test::write_sequence(at(""), {1, 2});
        chain_ = test::chain_of("motion_blur", {{"mode", "guertin"}});
    }
    std::string of_frame(int frame) {
        SequenceReader reader(settings_.source, settings_.input,
                              [](const FrameHeader&) { return RoleSet(); });
        const auto opened = reader.open(frame, {{Role::color, in(frame)}});
        EXPECT_TRUE(opened.ok()) << opened.status().message();
        return opened.ok() ? fingerprint_of(chain_, settings_, *opened) : "";
    }
};

TEST_F(Fingerprint, DependsOnEverySettingThatChangesTheOutput) {
    const auto camera = [](const char* text) { return parse_camera(text, "camera.json"); };
    const std::set<int> cuts = {0, 1};
    const io::ExrCompression level_9{io::ExrMethod::dwaa, 9}, level_45{io::ExrMethod::dwaa, 45};
    const std::pair<const char*, std::function<void(RunSettings&)>> changes[] = {
        {"nothing", [](RunSettings&) {}},
        {"precision", [](RunSettings& s) { s.plan.precision = Precision::fp16; }},
        {"overflow", [](RunSettings& s) { s.overflow = io::HalfOverflow::clamp; }},
        {"half", [](RunSettings& s) { s.exr.half = true; }},
        {"compression", [&](RunSettings& s) { s.exr.compression = level_9; }},
        {"level of compression", [&](RunSettings& s) { s.exr.compression = level_45; }},
        {"channels", [](RunSettings& s) { s.exr.channels = {"*.Combined.*"}; }},
        {"bits", [](RunSettings& s) { s.picture.bits = 8; }},
        {"output curve", [](RunSettings& s) { s.picture.transfer = io::Curve::linear; }},
        {"nonfinite", [](RunSettings& s) { s.source.nonfinite_color = NonfiniteColor::zero; }},
        {"camera", [&](RunSettings& s) { s.source.camera = camera("{\"f_stop\": 9}"); }},
        {"fill mask", [](RunSettings& s) { s.source.layers.fill_mask = "fill"; }},
        {"cuts", [&](RunSettings& s) { s.source.cuts = cuts; }},
        {"cuts ignored",
         [&](RunSettings& s) {
             s.source.cuts = cuts;
             s.plan.rules_off = {kRuleCameraCut};
         }},
        {"rule", [](RunSettings& s) { s.plan.rules_on = {kRuleMissingPlane}; }},
        {"version", [](RunSettings& s) { s.version = "another"; }},
    };
    const RunSettings plain = settings_;
    std::map<std::string, std::string> made_by;
    for (const auto& [name, change] : changes) {
        settings_ = plain;
        change(settings_);
        const auto [same, is_new] = made_by.try_emplace(of_frame(1), name);
        EXPECT_TRUE(is_new) << name << " has the fingerprint of " << same->second;
    }
    settings_ = plain;
    EXPECT_TRUE(made_by.try_emplace(of_frame(2), "frame 2").second);
    chain_ = test::chain_of("motion_blur", {{"mode", "guertin"}, {"samples", int64_t(7)}});
    EXPECT_TRUE(made_by.try_emplace(of_frame(1), "another chain").second);
}

TEST_F(Fingerprint, DependsOnEveryFileThatTheFrameReads) {
    test::write_sequence(at(""), {1, 2, 3});
    const std::string behind = at("behind.exr");
    fs::copy_file(in(2), behind);
    settings_.input.patterns.emplace(Role::behind, *io::PathPattern::parse(behind));
    RoleSet wanted = {Role::color_before, Role::color_after, Role::behind};
    const auto made = [&] {
        SequenceReader reader(settings_.source, settings_.input,
                              [&](const FrameHeader&) { return wanted; });
        auto opened = reader.open(2, {{Role::color, in(2)}, {Role::behind, behind}});
        EXPECT_TRUE(opened.ok()) << opened.status().message();
        return opened.ok() ? fingerprint_of(chain_, settings_, *opened) : "";
    };
    std::set<std::string> all = {made()};
    EXPECT_EQ(made(), *all.begin());
    for (const std::string& path : {in(1), in(2), in(3), behind}) {
        fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(7));
        EXPECT_TRUE(all.insert(made()).second) << path;
    }
    for (const Role role : {Role::color_before, Role::color_after, Role::behind}) {
        const RoleSet whole = std::exchange(wanted, wanted - RoleSet{role});
        EXPECT_TRUE(all.insert(made()).second) << name_of(role);
        wanted = whole;
    }
    for (const int cut : {1, 2}) {
        settings_.source.cuts = {cut};
        EXPECT_TRUE(all.insert(made()).second) << "cut " << cut;
    }
}

TEST_F(Fingerprint, DependsOnNothingElse) {
    const std::string base = of_frame(1);
    settings_.strict = settings_.preview = true;
    settings_.plan.elide = false;
    settings_.source.max_memory = 1 << 30;
    settings_.output = *io::PathPattern::parse(at("elsewhere.####.exr"));
    EXPECT_EQ(of_frame(1), base);
}

// A chain without passes: nothing is computed.
class SkipTest : public SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        test::write_sequence(at(""), {1});
        settings_.on_existing = io::OnExisting::skip;
    }
    bool makes_again() {
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        return report.outcome != Outcome::skipped;
    }
    // The output is done; after `damage` it is made again, with the bytes it had.
    void expect_made_again(const std::string& what, const std::string& path,
                           const std::function<void()>& damage) {
        makes_again();
        EXPECT_FALSE(makes_again()) << what;
        const std::string whole = test::read_text(path);
        damage();
        EXPECT_TRUE(makes_again()) << what;
        const bool has_times = path == sidecar_of_1();
        EXPECT_TRUE(has_times || test::read_text(path) == whole) << what;
    }
    std::string sidecar_of_1() const { return out(1) + ".json"; }
};

TEST_F(SkipTest, IsForCompleteOutputs) {
    settings_.preview = true;
    makes_again();
    const std::string preview = fs::path(out(1)).replace_extension(".png");
    for (const std::string& path : {out(1), preview, sidecar_of_1()}) {
        // Times in a sidecar differ in length from run to run.
        const auto cut_to = [&](const char* what, uintmax_t (*keep)(uintmax_t bytes)) {
            expect_made_again(concat(path, ": ", what, " left"), path,
                              [&] { fs::resize_file(path, keep(fs::file_size(path))); });
        };
        cut_to("0 bytes are", [](uintmax_t) { return uintmax_t(0); });
        cut_to("100 bytes are", [](uintmax_t) { return uintmax_t(100); });
        cut_to("half is", [](uintmax_t bytes) { return bytes / 2; });
        cut_to("all but 3 bytes are", [](uintmax_t bytes) { return bytes - 3; });
        expect_made_again(path + " removed", path, [&] { fs::remove(path); });
    }
    for (const char* foreign : {"{\"work\": \"another\"}", "{\"work\": 3}", "[]", "no JSON"})
        expect_made_again(foreign, sidecar_of_1(),
                          [&] { test::write_text(sidecar_of_1(), foreign); });
    // Without a sidecar only reading all pixels shows that an output is whole.
    settings_.sidecar = settings_.preview = false;
    std::string bytes;
    expect_made_again("a damaged pixel without a sidecar", out(1), [&] {
        bytes = test::read_text(out(1));
        fs::resize_file(out(1), bytes.size() - 3);
    });
}

TEST_F(SkipTest, IsForTheSameWork) {
    EXPECT_TRUE(makes_again());
    EXPECT_FALSE(makes_again());
    const std::pair<const char*, std::function<void()>> changes[] = {
        {"input", [&] { fs::last_write_time(in(1), fs::file_time_type::clock::now()); }},
        {"half", [&] { settings_.exr.half = true; }},
        {"preview", [&] { settings_.preview = true; }},
    };
    for (const auto& [what, change] : changes) {
        change();
        EXPECT_TRUE(makes_again()) << what;
        EXPECT_FALSE(makes_again()) << what;
    }
}

// Without --strict a NaN is replaced and the frame is written: its values were not checked.
TEST_F(SkipTest, UnderStrictIsForCheckedValues) {
    for (const bool sidecar : {true, false}) {
        SCOPED_TRACE(sidecar);
        settings_.sidecar = sidecar;
        settings_.strict = false;
        test::write_sequence(at(""), {1});
        EXPECT_TRUE(makes_again());
        settings_.strict = true;
        EXPECT_TRUE(makes_again());
        EXPECT_FALSE(makes_again());
        settings_.strict = false;
        EXPECT_FALSE(makes_again());

        test::Planes planes = test::make_planes(48, 32);
        planes.color.at(3, 2, 1) = NAN;
        test::write_frame(in(1), planes);
        EXPECT_TRUE(makes_again());
        const std::string before = test::read_text(out(1));
        settings_.strict = true;
        EXPECT_EQ(last_frame().status.code(), StatusCode::health);
        EXPECT_TRUE(test::read_text(out(1)) == before);
    }
}

// --like repeats a record: a field that is not read back would be lost without a word.
TEST_F(SequenceTest, ARecordReadsBackAsItWasWritten) {
    test::write_sequence(at(""), {1, 2});
    test::write_text(at("camera.json"), R"({"f_stop": 2.5, "focus_distance": 3})");
    chain_ = test::chain_of("motion_blur", {{"mode", "guertin"}, {"samples", int64_t(7)}});
    auto camera = load_camera(at("camera.json"));
    ASSERT_TRUE(camera.status().ok()) << camera.status().message();
    settings_.source.camera = *camera;
    settings_.strict = true;
    frames("2");
    settings_.given = {{"input", std::string("in.####.exr")},
                       {"precision", std::string("fp16")},
                       {"half", true},
                       {"a_count", int64_t(-3)},
                       {"a_number", 0.1}};
    const FrameReport report = last_frame();
    ASSERT_TRUE(report.status.ok()) << report.status.message();
    const auto record = read_record(out(2));
    ASSERT_TRUE(record.ok()) << record.status().message();
    auto expected = settings_.given;
    expected["input"] = at("in.####.exr");
    EXPECT_EQ(record->settings, expected);
    EXPECT_EQ(record->version, "test");
    EXPECT_EQ(record->work, report.provenance);
    EXPECT_TRUE(record->work.ends_with(" strict"));
    EXPECT_EQ(record->frame, 2);
    EXPECT_EQ(record->chain, write_chain(chain_));
    EXPECT_EQ(parse_camera(record->camera, "record").camera, settings_.source.camera->camera);
    EXPECT_EQ(record->camera_hash, hex_of(settings_.source.camera->text_hash));
    ASSERT_EQ(record->inputs.size(), 1u);
    EXPECT_EQ(record->inputs[0].path, in(2));
    EXPECT_EQ(record->inputs[0].bytes, fs::file_size(in(2)));
}

TEST_F(SequenceTest, OutputsAreToldApartByWhatMadeThem) {
    test::write_sequence(at(""), {1, 2, 3, 4});
    frames("1-2");
    ASSERT_TRUE(last_frame().status.ok());
    settings_.strict = true;
    frames("3");
    ASSERT_TRUE(last_frame().status.ok());
    // Files of another program, and of a version that wrote no record.
    for (const auto& [frame, provenance] :
         {std::pair(4, "postchain 3"), {5, "postchain test chain 1 work 2 strict"}}) {
        test::FrameFile file;
        file.attributes["postchain"] = std::string(provenance);
        test::write_frame(out(frame), test::make_planes(8, 8), file);
    }
    const auto checked = check_outputs(settings_.output, {}, "");
    ASSERT_TRUE(checked.ok()) << checked.status().message();
    using enum OutputState;
    const OutputState states[] = {whole, whole, other, foreign, other};
    for (size_t i = 0; i < 5; ++i)
        EXPECT_EQ((*checked)[i].state, states[i]) << (*checked)[i].why << i;
    EXPECT_TRUE((*checked)[2].settings.find(" strict") != std::string::npos);
    EXPECT_EQ((*checked)[4].settings, "postchain test chain 1 strict");
}

// A setting that decides pixels or the file, and one that decides neither.
TEST_F(SequenceTest, OutputsOfOtherSettingsAreToldApart) {
    test::write_sequence(at(""), {1, 2, 3});
    settings_.on_existing = io::OnExisting::overwrite;
    ASSERT_TRUE(last_frame().status.ok());
    const auto state_with = [&](const char* key) {
        settings_.given = {{key, std::string("x")}};
        frames("2");
        EXPECT_TRUE(last_frame().status.ok());
        const auto checked = check_outputs(settings_.output, {}, "");
        EXPECT_TRUE(checked.ok()) << checked.status().message();
        for (const size_t other : {0, 2}) EXPECT_EQ((*checked)[other].state, OutputState::whole);
        return (*checked)[1].state;
    };
    for (const char* key :
         {"input", "output", "frames", "chunk", "on_existing", "on_error", "missing", "sidecar",
          "png", "max_memory", "mkdir", "watch", "idle", "dump_stages", "camera"})
        EXPECT_EQ(state_with(key), OutputState::whole) << key;
    for (const char* key : {"precision", "half", "overflow", "compression", "channels", "profile",
                            "view_layer", "nonfinite", "aovs", "cryptomatte", "cuts"})
        EXPECT_EQ(state_with(key), OutputState::other) << key;
    // The text of a camera file counts, not its name.
    for (const char* name : {"camera.json", "copy.json"})
        test::write_text(at(name), R"({"f_stop": 2.5})");
    test::write_text(at("other.json"), R"({"f_stop": 2})");
    const auto state_by = [&](const char* camera) {
        settings_.source.camera = test::must(load_camera(at(camera)));
        return state_with("camera");
    };
    EXPECT_EQ(state_by("camera.json"), OutputState::other);
    settings_.given = {};
    frames("1-3");
    ASSERT_TRUE(last_frame().status.ok());
    EXPECT_EQ(state_by("copy.json"), OutputState::whole);
    EXPECT_EQ(state_by("other.json"), OutputState::other);
}

TEST(ExitCode, OfAStatus) {
    const std::pair<StatusCode, int> codes[] = {
        {StatusCode::ok, 0},       {StatusCode::usage, 2},  {StatusCode::chain, 3},
        {StatusCode::input, 4},    {StatusCode::memory, 4}, {StatusCode::output, 5},
        {StatusCode::gl, 6},       {StatusCode::health, 7}, {StatusCode::canceled, 1},
        {StatusCode::internal, 1},
    };
    for (const auto& [status, code] : codes) {
        const Status failure = status == StatusCode::ok ? Status() : Status(status, "why");
        EXPECT_EQ(exit_code(failure), code) << name_of(status);
        EXPECT_EQ(exit_code(failure, 0), code) << name_of(status);
        EXPECT_EQ(exit_code(failure, 1), failure.ok() ? 0 : 1) << name_of(status);
    }
}

TEST(ExitCode, OfARun) {
    const Status input(StatusCode::input, "why");
    const auto of = [&](size_t written, size_t skipped, size_t held, size_t failed, size_t missing,
                        bool unhealthy = false) {
        RunSummary summary;
        std::tie(summary.written, summary.skipped, summary.held, summary.failed, summary.missing,
                 summary.unhealthy) = std::tie(written, skipped, held, failed, missing, unhealthy);
        if (failed + missing > 0) summary.first_failure = input;
        return exit_code(summary);
    };
    EXPECT_EQ(of(2, 1, 0, 0, 0), 0);
    EXPECT_EQ(of(2, 0, 1, 0, 0), 1);
    EXPECT_EQ(of(0, 1, 0, 1, 0), 1);
    EXPECT_EQ(of(1, 0, 0, 0, 1), 1);
    EXPECT_EQ(of(0, 0, 0, 2, 0), 4);
    EXPECT_EQ(of(0, 0, 0, 0, 2), 4);
    EXPECT_EQ(of(5, 0, 0, 1, 0, true), 7);
}

}  // namespace
}  // namespace postchain::sequence::record_test
