// Results of the service: previews, plans, reports.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"
#include "tools/service/work/job_files.h"
#include "tools/service/work/previews.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::got;
using test::problem_of;
using testing::HasSubstr;
using Results = test::ServiceTest;

constexpr const char* kValues = "image/vnd.postchain";

// Images as values: magic, width, height, channels, then planes.
std::vector<int> size_of(const Picture& picture) {
    EXPECT_EQ(picture.type, kValues);
    EXPECT_EQ(picture.bytes.substr(0, 4), "PPIC");
    std::vector<int> numbers;
    for (size_t at = 4; at < 16; at += 4) numbers.push_back(uint8_t(picture.bytes[at]));
    return numbers;
}

// Two strips; rows of the image cover 43.
TEST_F(Results, ALargeImageIsReadInStrips) {
    fs::create_directories(root("wide"));
    test::write_sequence(root("wide"), {1}, 16384, 300);
    const auto image = [&](uint64_t max_memory, uint64_t& need, int side = 400) {
        sequence::SourceSettings source;
        source.max_memory = max_memory;
        const auto made =
            image_of(root("wide/in.0001.exr"), 1, source, {.type = kValues, .side = side},
                     [&](uint64_t bytes) { need = bytes; });
        EXPECT_TRUE(made.ok()) << made.status().message();
        return made.ok() ? *made : "";
    };
    uint64_t whole = 0, strip = 0;
    EXPECT_EQ(image(uint64_t(1) << 30, whole), image(uint64_t(200) << 20, strip));
    EXPECT_LT(strip, whole);
    // A pixel of the reply: 16 bytes of color, 6 of halves, and these packed in both processes.
    uint64_t large = 0;
    image(uint64_t(1) << 30, large, 4096);
    EXPECT_EQ(large - whole, 34u * (4096 * 75 - 400 * 7));
}

TEST_F(Results, FilesHaveTheTypeOfTheirName) {
    const Roots roots = test::must(Roots::of({root("")}));
    std::vector<JobFrame> frames;
    for (const char* name : {"a.0003.exr", "a.0004.png", "a.0005.dpx", "a.0006.EXR"}) {
        std::ofstream(root(name)) << "picture " << name;
        frames.push_back(
            {.frame = int(frames.size()) + 3, .state = FrameState::written, .output = root(name)});
    }
    frames[3].state = FrameState::quarantined;
    std::string text;
    for (size_t i = 0; i < 3; ++i) {
        const ResultFile file = got(output_of(frames[i], roots));
        text += concat(file.name, " ", file.type, " ", file.bytes, "\n");
    }
    EXPECT_EQ(text,
              "a.0003.exr image/x-exr 18\na.0004.png image/png 18\n"
              "a.0005.dpx application/octet-stream 18\n");
    EXPECT_EQ(problem_of(output_of(frames[3], roots)).kind, Problem::Kind::not_found);
}

TEST_F(Results, ImagesPreviewsAndJobsShareTheMemory) {
    max_memory_ = 40'000;
    open();
    // 24 x 16 pixels: four floats as stored, and as a plane; 34 bytes of the reply.
    const auto input = [&](auto done) {
        service_->input_image(user(), "in.####.exr", 1, {}, std::move(done));
    };
    const Problem large = no_picture(input);
    EXPECT_EQ(large.kind, Problem::Kind::invalid);
    EXPECT_THAT(large.detail, HasSubstr("in.0001.exr: needs 24.8 KiB of memory; images of this "
                                        "service may need 9.8 KiB; request a smaller side"));
    const Problem preview = no_picture(previewing(
        R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr", "frame": 1})"));
    EXPECT_THAT(preview.detail, HasSubstr("9.8 KiB"));
    const Job job = ran(body());
    EXPECT_EQ(job.state, JobState::failed);
    EXPECT_THAT(frames(job.id)[0].message, HasSubstr("{max_memory} allows 19.5 KiB"_keyed));
    close();
    max_memory_ = 400'000;
    open();
    EXPECT_EQ(picture(input).type, "image/png");
}

TEST_F(Results, PreviewsAndThumbnailsWhileAJobIsUnderWay) {
    open();
    const std::string id = submit(body());
    const std::string asked =
        R"({"chain": "fast", "input": "in.####.exr", "frame": 2, "scale": 0.5,
            "set": ["camera.focal_length_mm=50", "camera.sensor_width_mm=36",
                    "camera.f_stop=2", "camera.focus_distance=3"]})";
    const Picture preview = picture(previewing(asked));
    EXPECT_EQ(preview.type, "image/png");
    EXPECT_EQ(preview.bytes.substr(1, 3), "PNG");
    EXPECT_EQ(size_of(picture(previewing(asked, {kValues}))), (std::vector{12, 8, 3}));
    // Distances in a format for other programs: one channel, Z.
    const std::string depth =
        R"({"chain": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frame": 2, "plane": "depth"})";
    EXPECT_EQ(size_of(picture(previewing(depth, {kValues}))), (std::vector{24, 16, 1}));
    EXPECT_THAT(picture(previewing(depth, {"image/x-exr"})).bytes,
                HasSubstr(std::string("Z\0\2\0\0\0", 6)));
    const auto depth_of = [&](const char* input) {
        return json{{"chain", {{"postchain", 1}, {"passes", json::array()}}},
                    {"input", input},
                    {"frame", 2},
                    {"scale", 0.5},
                    {"plane", "depth"}}
            .dump();
    };
    EXPECT_EQ(size_of(picture(previewing(depth_of("in.####.exr"), {kValues}))),
              (std::vector{12, 8, 1}));
    test::FrameFile flat;
    flat.depth = false;
    test::write_frame(root("flat.0002.exr"), test::make_planes(24, 16), flat);
    EXPECT_THAT(no_picture(previewing(depth_of("flat.####.exr"))).detail,
                HasSubstr("flat.0002.exr: the frame has no depth"));
    ended(id);
    const User& one = user();
    const ImageWanted values{kValues, 12};
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->input_image(one, "in.####.exr", 2, values, done); },
             [&](auto done) { service_->job_image(one, id, values, done); },
             [&](auto done) { service_->frame_image(one, id, 1, false, values, done); },
             [&](auto done) { service_->frame_image(one, id, 1, true, values, done); }})
        EXPECT_EQ(size_of(picture(ask)), (std::vector{12, 8, 3}));
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->input_image(one, "in.####.exr", 99, values, done); },
             [&](auto done) { service_->frame_image(one, id, 99, true, {}, done); }})
        EXPECT_EQ(no_picture(ask).kind, Problem::Kind::not_found);
    EXPECT_EQ(no_picture([&](auto done) {
                  service_->input_image(one, "color=a,color=b", 1, {}, done);
              }).kind,
              Problem::Kind::invalid);
    // Pictures, which another library reads.
    const std::string pictures = submit(
        R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr", "frames": "1",
            "output": "out/p.####.png"})");
    done(pictures);
    EXPECT_EQ(size_of(picture(
                  [&](auto done) { service_->frame_image(one, pictures, 1, true, values, done); })),
              (std::vector{12, 8, 3}));
}

TEST_F(Results, AJobThatWaitsShowsItsFirstInput) {
    hold();
    submit(held_body());
    ASSERT_TRUE(waits());
    const std::string id = submit(in_folder(body(R"(, "frames": "2")"), "next"));
    const Ask ask = [&](auto done) { service_->job_image(user(), id, {kValues, 12}, done); };
    EXPECT_EQ(size_of(picture(ask)), (std::vector{12, 8, 3}));
    fs::remove(root("in.0002.exr"));
    EXPECT_EQ(no_picture(ask).kind, Problem::Kind::not_found);
    test::HeldPass::held = false;
}

TEST_F(Results, PlansAndChains) {
    open();
    const json plan = json::parse(got(service_->plan(
        user(),
        R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr", "frames": "2-3"})")));
    ASSERT_EQ(plan["frames"].size(), 2u);
    EXPECT_EQ(plan["frames"][0]["frame"], 2);
    EXPECT_TRUE(plan["frames"][0]["plan"].contains("steps"));
    const auto checked = [&](const char* text) {
        return got(service_->check_chain(json{{"text", text}}.dump()));
    };
    const CheckedChain good = checked("# mine\npostchain: 1\npasses: [fxaa: {preset: 12}]\n");
    EXPECT_TRUE(good.diagnostics.empty());
    EXPECT_EQ(json::parse(io::json_text(good.values)),
              json::parse(R"({"postchain": 1, "passes": [{"fxaa": {"preset": 12}}]})"));
    const CheckedChain bad = checked("postchain: 1\npasses: [fxa]\n");
    ASSERT_EQ(bad.diagnostics.size(), 1u);
    EXPECT_EQ(bad.diagnostics[0].line, 2);
    EXPECT_EQ(bad.values["passes"][0], "fxa");
    EXPECT_TRUE(checked("passes: 5").values.is_null());
    for (const char* body : {"{\"text\": 5}", "{\"txt\": \"\"}", "[]", "text: a"})
        EXPECT_EQ(problem_of(service_->check_chain(body)).diagnostics.size(), 1u) << body;
    EXPECT_TRUE(json::parse(service_->passes()).is_object());
    EXPECT_TRUE(json::parse(service_->chain_schema()).is_object());
}

TEST_F(Results, ReportsAreReadAndNothingBesideThem) {
    open();
    const std::string id = submit(
        R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "output": "report", "repeats": 1, "page_frames": 1})");
    EXPECT_FALSE(done(id).verdict.empty());
    EXPECT_EQ(got(service_->report_file(user(), id, "index.html")).path,
              fs::canonical(root("report/index.html")).string());
    for (const auto& [name, type] : {std::pair{"report.csv", "text/csv; charset=utf-8"},
                                     {"report.md", "text/markdown; charset=utf-8"},
                                     {"report.json", "application/json"},
                                     {"added.png", "image/png"},
                                     {"added.yaml", "application/yaml"}}) {
        if (std::string(name).starts_with("added")) std::ofstream(root("report/") + name) << "x";
        EXPECT_EQ(got(service_->report_file(user(), id, name)).type, type);
    }
    std::ofstream(root("report/added.exe")) << "x";
    const std::string run = submit(body());
    done(run);
    EXPECT_EQ(problem_of(service_->report_file(user(), run, "report.json")).detail,
              concat("job ", run, " has no report"));
    std::ofstream(root("secret.json")) << "{}";
    std::ofstream(outside("secret.json")) << "{}";
    fs::create_symlink(outside("secret.json"), root("report/link.json"));
    for (const char* name :
         {"../secret.json", "/etc/passwd", "", ".", "none.json", ".postchain-report", "images",
          "images/../../secret.json", "link.json", "added.exe"})
        EXPECT_EQ(problem_of(service_->report_file(user(), id, name)).kind,
                  Problem::Kind::not_found)
            << name;
}

TEST_F(Results, BytesOfWhatIsWritten) {
    const auto write = [&](const std::string& name, size_t bytes) {
        std::ofstream(root(name)) << std::string(bytes, 'x');
    };
    size_t bytes = 1;
    for (const char* name : {"out/one.exr", "out/one.exr.json", "out/one.exr.png", "out/f.0001.exr",
                             "out/f.0001.exr.json", "out/f.0001.exr.png", "out/g.0001.exr"})
        write(name, std::exchange(bytes, 2 * bytes));
    // Neither what a link leads to nor a folder is of the job.
    write("large", 10'000);
    for (const char* link : {"out/f.0002.exr", "out/link"})
        fs::create_symlink(root("large"), root(link));
    fs::create_directory(root("out/f.0003.exr"));
    EXPECT_EQ(bytes_on_disk(root("out/one.exr")), 1 + 2 + 4);
    EXPECT_EQ(bytes_on_disk(root("out/f.####.exr")), 8 + 16 + 32);
    EXPECT_EQ(bytes_on_disk(root("out")), 127);
    EXPECT_EQ(bytes_on_disk(root("out/one.exr") + "\n" + root("out/g.####.exr")), 7 + 64);
    EXPECT_EQ(bytes_on_disk(root("out/none.exr")), 0);
}

TEST_F(Results, OutputsOfFrames) {
    std::ofstream(root("in.0005.exr")) << "no image";
    open();
    const std::string id = submit(body());
    EXPECT_EQ(ended(id).done, 5);
    fs::remove(root("out/o.0003.exr"));
    EXPECT_EQ(
        no_picture([&](auto done) { service_->frame_image(user(), id, 3, true, {}, done); }).kind,
        Problem::Kind::not_found);
    EXPECT_EQ(got(service_->output(user(), id, 4)).name, "o.0004.exr");
    for (const int frame : {3, 5, 7})
        EXPECT_EQ(problem_of(service_->output(user(), id, frame)).kind, Problem::Kind::not_found)
            << frame;
}

// The folders are those of the service when it was submitted, and links lead out of them since.
TEST_F(Results, FilesThatLinkOutsideAreNotShown) {
    open();
    const std::string id = submit(body());
    done(id);
    const std::string skipped = submit(body(R"(, "on_existing": "skip")"));
    done(skipped);
    EXPECT_EQ(got(service_->frame(skipped, 1)).state, FrameState::skipped);
    EXPECT_EQ(got(service_->frame(skipped, 1)).sidecar, got(service_->frame(id, 1)).sidecar);
    for (const auto& [name, target] : {std::pair{"out/o.0006.exr", "o"}, {"in.0002.exr", "in"}}) {
        fs::rename(root(name), outside(target));
        fs::create_symlink(outside(target), root(name));
    }
    const User& one = user();
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->frame_image(one, id, 6, true, {}, done); },
             [&](auto done) { service_->frame_image(one, id, 2, false, {}, done); },
             [&](auto done) { service_->job_image(one, id, {}, done); },
             [&](auto done) { service_->job_image(one, skipped, {}, done); },
             [&](auto done) { service_->input_image(one, "in.####.exr", 2, {}, done); }})
        EXPECT_EQ(no_picture(ask).kind, Problem::Kind::forbidden);
    EXPECT_EQ(problem_of(service_->output(one, id, 6)).kind, Problem::Kind::forbidden);
    EXPECT_THAT(
        problem_of(service_->plan(one, R"({"chain": "fast", "input": "in.####.exr"})")).detail,
        HasSubstr("in.0002.exr: links outside"));
}

}  // namespace
}  // namespace postchain::service
