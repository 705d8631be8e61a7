// Results of the service: previews, plans, reports.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/command/frames.h"
#include "tests/service/support.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using Results = test::ServiceTest;

TEST_F(Results, PreviewsAndThumbnailsWhileAJobIsUnderWay) {
    open();
    const std::string id = submit(body());
    const std::string asked =
        R"({"chain": "fast", "input": "in.####.exr", "frame": 2, "scale": 0.5,
            "set": ["camera.focal_length_mm=50", "camera.sensor_width_mm=36",
                    "camera.f_stop=2", "camera.focus_distance=3"]})";
    const Picture preview =
        picture([&](auto done) { service_->preview(user(), asked, {}, std::move(done)); });
    EXPECT_EQ(preview.type, "image/png");
    ASSERT_GT(preview.bytes.size(), 30u);
    EXPECT_EQ(preview.bytes.substr(1, 3), "PNG");
    EXPECT_EQ(int(uint8_t(preview.bytes[19])), 12) << "half of 24 pixels";
    EXPECT_EQ(int(uint8_t(preview.bytes[23])), 8);
    const Picture exr = picture(
        [&](auto done) { service_->preview(user(), asked, {"image/x-exr"}, std::move(done)); });
    EXPECT_EQ(exr.type, "image/x-exr");
    std::ofstream(root("preview.exr"), std::ios::binary) << exr.bytes;
    const ImageF color = test::read_color(root("preview.exr"));
    EXPECT_EQ(color.width, 12);
    EXPECT_EQ(color.height, 8);
    ended(id);
    for (const bool after : {false, true}) {
        const Picture small = picture(
            [&](auto done) { service_->frame_image(user(), id, 1, after, {}, std::move(done)); });
        EXPECT_EQ(small.bytes.substr(1, 3), "PNG");
    }
    EXPECT_EQ(
        no_picture([&](auto done) { service_->frame_image(user(), id, 99, true, {}, done); }).kind,
        Problem::Kind::not_found);
}

// Values for a page: magic, width, height, channels, then planes.
TEST_F(Results, PicturesAsValues) {
    open();
    const auto size = [](const Picture& picture) {
        EXPECT_EQ(picture.type, "image/vnd.postchain");
        EXPECT_EQ(picture.bytes.substr(0, 4), "PPIC");
        std::vector<int> numbers;
        for (size_t at = 4; at < 16; at += 4) numbers.push_back(uint8_t(picture.bytes[at]));
        return numbers;
    };
    const ImageWanted values{"image/vnd.postchain", 12};
    EXPECT_EQ(size(picture([&](auto done) {
                  service_->input_image(user(), "in.####.exr", 2, values, std::move(done));
              })),
              (std::vector{12, 8, 3}));
    const std::string depth =
        R"({"chain": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frame": 2, "plane": "depth"})";
    EXPECT_EQ(size(picture([&](auto done) {
                  service_->preview(user(), depth, {"image/vnd.postchain"}, std::move(done));
              })),
              (std::vector{24, 16, 1}));
    // Distances in a format for other programs: one channel, Z.
    const Picture exr = picture(
        [&](auto done) { service_->preview(user(), depth, {"image/x-exr"}, std::move(done)); });
    EXPECT_EQ(exr.bytes.substr(0, 4), "v/1\1");
    EXPECT_NE(exr.bytes.find(std::string("Z\0\2\0\0\0", 6)), std::string::npos);
    const std::string id = submit(body());
    ended(id);
    EXPECT_EQ(
        size(picture([&](auto done) { service_->job_image(user(), id, values, std::move(done)); })),
        (std::vector{12, 8, 3}));
    EXPECT_EQ(no_picture([&](auto done) {
                  service_->input_image(user(), "in.####.exr", 99, values, done);
              }).kind,
              Problem::Kind::not_found);
}

TEST_F(Results, PlansAndChains) {
    open();
    const auto planned = service_->plan(
        user(),
        R"({"chain": {"postchain": 1, "passes": ["fxaa"]}, "input": "in.####.exr", "frames": "2-3"})");
    ASSERT_TRUE(std::holds_alternative<std::string>(planned));
    const json plan = json::parse(std::get<std::string>(planned));
    ASSERT_EQ(plan["frames"].size(), 2u);
    EXPECT_EQ(plan["frames"][0]["frame"], 2);
    EXPECT_TRUE(plan["frames"][0]["plan"].contains("steps"));
    const auto checked = [&](const char* text) {
        return service_->check_chain(json{{"text", text}}.dump());
    };
    EXPECT_TRUE(std::get<Diagnostics>(checked("postchain: 1\npasses: [fxaa]\n")).empty());
    const auto faults = std::get<Diagnostics>(checked("postchain: 1\npasses: [fxa]\n"));
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].line, 2);
    for (const char* body : {"{\"text\": 5}", "{\"txt\": \"\"}", "[]", "text: a"}) {
        const auto refused = service_->check_chain(body);
        ASSERT_TRUE(std::holds_alternative<Problem>(refused)) << body;
        EXPECT_EQ(std::get<Problem>(refused).diagnostics.size(), 1u) << body;
    }
    EXPECT_TRUE(json::parse(service_->passes()).is_object());
    EXPECT_TRUE(json::parse(service_->chain_schema()).is_object());
    EXPECT_TRUE(service_->job_schema().is_object());
}

TEST_F(Results, ReportsAreReadAndNothingBesideThem) {
    open();
    const std::string id = submit(
        R"({"kind": "ab", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "chain_b": {"postchain": 1, "passes": []}, "input": "in.####.exr", "frames": "1-2",
            "output": "report", "repeats": 1, "page_frames": 1})");
    const Job job = ended(id);
    ASSERT_EQ(job.state, JobState::done) << job.message;
    EXPECT_FALSE(job.verdict.empty());
    const auto page = service_->report_file(user(), id, "index.html");
    ASSERT_TRUE(std::holds_alternative<ResultFile>(page));
    EXPECT_EQ(std::get<ResultFile>(page).path, fs::canonical(root("report/index.html")).string());
    std::ofstream(root("secret.json")) << "{}";
    std::ofstream(outside("secret.json")) << "{}";
    fs::create_symlink(outside("secret.json"), root("report/link.json"));
    for (const char* name :
         {"../secret.json", "/etc/passwd", "", ".", "none.json", ".postchain-report", "images",
          "images/../../secret.json", "link.json"}) {
        const auto answer = service_->report_file(user(), id, name);
        ASSERT_TRUE(std::holds_alternative<Problem>(answer)) << name;
        EXPECT_EQ(std::get<Problem>(answer).kind, Problem::Kind::not_found) << name;
    }
}

// The folders are those of the service when it was submitted, and links lead out of them since.
TEST_F(Results, FilesThatLinkOutsideAreNotShown) {
    open();
    const std::string id = submit(body());
    ASSERT_EQ(ended(id).state, JobState::done);
    const auto replace = [&](const std::string& name, const std::string& target) {
        fs::rename(root(name), outside(target));
        fs::create_symlink(outside(target), root(name));
    };
    replace("out/o.0001.exr.json", "sidecar.json");
    EXPECT_EQ(std::get<JobFrame>(service_->frame(id, 1)).sidecar, "");
    EXPECT_NE(std::get<JobFrame>(service_->frame(id, 2)).sidecar, "");
    replace("out/o.0006.exr", "o.exr");
    replace("in.0002.exr", "in.exr");
    const User& one = user();
    for (const auto& ask : std::vector<Ask>{
             [&](auto done) { service_->frame_image(one, id, 6, true, {}, done); },
             [&](auto done) { service_->frame_image(one, id, 2, false, {}, done); },
             [&](auto done) { service_->job_image(one, id, {}, done); },
             [&](auto done) { service_->input_image(one, "in.####.exr", 2, {}, done); }})
        EXPECT_EQ(no_picture(ask).kind, Problem::Kind::forbidden);
    EXPECT_EQ(std::get<Problem>(service_->outputs(one, id, 6, 6)).kind, Problem::Kind::forbidden);
}

TEST_F(Results, ABenchIsDoneAndTakenUpAgain) {
    open();
    const std::string body =
        R"({"kind": "bench", "chain": {"postchain": 1, "passes": ["fxaa"]},
            "input": "in.####.exr", "frames": "1-2", "output": "bench", "repeats": 1,
            "split_frames": 0, "sweep": ["fxaa.preset=12,39"]})";
    const Job job = ended(submit(body));
    ASSERT_EQ(job.state, JobState::done) << job.message;
    EXPECT_THAT(job.verdict, HasSubstr("2 variants"));
    EXPECT_EQ(ended(submit(body)).state, JobState::done);
}

}  // namespace
}  // namespace postchain::service
