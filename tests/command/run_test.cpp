// postchain run: its outputs and messages.
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/command/fixture.h"

namespace postchain::test::run_test {
namespace {

namespace fs = std::filesystem;
using RunTest = CommandTest;

TEST_F(RunTest, ThreadsDoNotChangePixels) {
    write_sequence(at(""), {1, 2}, 96, 64);
    ImageF first;
    for (const char* threads : {"1", "2"}) {
        ASSERT_EQ(filter("all", {"--threads", threads, "--on-existing", "overwrite"}).code, 0);
        const ImageF color = read_color(out(2));
        if (first.empty()) first = color;
        EXPECT_EQ(color.data, first.data) << threads << " threads";
    }
    EXPECT_EQ(other_channels(out(1)), other_channels(in(1)));
    EXPECT_GE(other_channels(out(1)).size(), 5u);  // depth and four vector channels
}

// Every key of a sidecar, parents first: "times_ms", "times_ms.read", ... List elements are written
// as [].
void collect_keys(const Json& json, const std::string& prefix, std::set<std::string>& keys) {
    if (json.is_array()) {
        for (const auto& value : json) collect_keys(value, prefix + "[]", keys);
    } else if (json.is_object()) {
        for (const auto& [key, value] : json.items()) {
            // Inputs are named after planes; the plan, except elision, has its own test.
            const std::string path = prefix.empty() ? key : prefix + "." + key;
            keys.insert(path);
            if (path == "plan")
                collect_keys(value["left_out"], "plan.left_out", keys);
            else if (path != "inputs" && path != "resolved")
                collect_keys(value, path, keys);
        }
    }
}

TEST_F(RunTest, SidecarHasTheKeysOfItsDocument) {
    FrameFile half_depth;
    half_depth.depth_type = io::PixelType::half;
    Planes planes = make_planes(48, 32);
    planes.color.at(7, 5, 1) = INFINITY;
    planes.color.at(3, 2, 0) = NAN;
    write_frame(in(1), planes, half_depth);
    const auto outcome = filter("all", {"--frames", "1-2", "--missing", "hold"});
    EXPECT_EQ(outcome.code, 1) << outcome.text();  // frame 2 is held, so not 0
    std::set<std::string> keys;
    collect_keys(sidecar(1), "", keys);
    collect_keys(sidecar(2), "", keys);
    std::string document = read_text(std::string(POSTCHAIN_SOURCE_DIR) + "/docs/sidecar.md");
    document.resize(document.find("\n## The record in the picture"));
    // Every documented key occurs, except those marked as rare and keys inside them. The keys of
    // `resolved` are value names. In a row with several keys, the later begin like the first. A key
    // documents those around it.
    std::vector<std::string> rare = {"resolved."};
    std::set<std::string> documented;
    for (const auto& line : matches(document, "\n\\| (`[^\n]*)")) {
        const auto names = matches(line.substr(0, line.find(" |")), "`([^`]+)`");
        const std::string outer = names[0].substr(0, names[0].rfind('.') + 1);
        const bool is_rare = contains(line, "only when") || contains(line, "Only when");
        for (const auto& name : names) {
            const std::string key = name == names[0] ? name : outer + name;
            const bool within = std::any_of(rare.begin(), rare.end(), [&](const auto& begin) {
                return key.starts_with(begin);
            });
            for (size_t end = 0; end != std::string::npos;)
                documented.insert(key.substr(0, end = key.find_first_of(".[", end + 1)));
            EXPECT_TRUE(keys.count(key) || is_rare || within) << key;
            if (is_rare) rare.insert(rare.end(), {key + ".", key + "["});
        }
    }
    for (const auto& key : keys)
        EXPECT_TRUE(documented.count(key)) << key << " is not in docs/sidecar.md";
    const Json json = sidecar(1);
    EXPECT_EQ(json["frame"], 1);
    EXPECT_EQ(json["outcome"], "written");
    EXPECT_EQ(json["inputs"]["color"], in(1));
    EXPECT_EQ(json["output"], out(1));
    EXPECT_EQ(json["health"]["input_first_nonfinite"], Json::array({3, 2}));
    EXPECT_NEAR(json["bounds"]["max_speed_px"].get<double>(), std::sqrt(45.0), 1e-4);
    // Dispatches and textures, which only `plan --json` prints, were three quarters of it.
    EXPECT_FALSE(json["plan"].contains("steps") || json["plan"].contains("textures"));
    EXPECT_LT(read_text(out(1) + ".json").size(), 10000u);
    EXPECT_EQ(sidecar(2)["outcome"], "held");
    EXPECT_EQ(sidecar(2)["held_from"], 1);
}

TEST_F(RunTest, JsonLines) {
    write_sequence(at(""), {1, 2});
    const auto outcome =
        filter("fxaa", {"--json", "--log-format", "json", "--frames", "1-3", "--missing", "skip"});
    EXPECT_EQ(outcome.code, 1) << outcome.text();
    std::vector<Json> lines;
    std::vector<int> begun;
    for (const Json& line : json_lines(outcome.out)) {
        if (line.contains("begins"))
            begun.push_back(line["frame"]);
        else
            lines.push_back(line);
        EXPECT_TRUE(std::ranges::count(begun, line["frame"].get<int>())) << line;
    }
    EXPECT_EQ(begun, (std::vector<int>{1, 2, 3}));
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[0]["bytes"], fs::file_size(out(1)) + fs::file_size(out(1) + ".json"));
    EXPECT_EQ(lines[2]["bytes"], 0);
    for (size_t i = 0; i < 3; ++i) {
        for (const char* number : {"frame", "done"}) EXPECT_EQ(lines[i][number], i + 1);
        EXPECT_EQ(lines[i]["outcome"], i < 2 ? "written" : "missing");
        EXPECT_EQ(lines[i]["total"], 3);
    }
    EXPECT_EQ(lines[2]["error_code"], "input");
    EXPECT_TRUE(contains(lines[2]["error"].get<std::string>(), in(3)));
    std::set<std::string> levels;
    for (const auto& line : json_lines(outcome.err)) {
        levels.insert(line["level"].get<std::string>());
        EXPECT_TRUE(line["message"].is_string());
    }
    EXPECT_TRUE(levels.count("info") && levels.count("error"));
}

TEST_F(RunTest, QuietAndVerbose) {
    FrameFile half_depth;  // a warning
    half_depth.depth_type = io::PixelType::half;
    write_frame(in(1), make_planes(48, 32), half_depth);
    const auto quiet = filter("all", {"-q"});
    EXPECT_EQ(quiet.code, 0);
    EXPECT_EQ(quiet.out + quiet.err, "");
    expect_ends(filter("fxaa", {"-q"}), 5, {out(1)});
    const auto verbose = filter("fxaa", {"-v", "--on-existing", "overwrite"});
    expect_ends(verbose, 0, {"renderer: ", "frame 1 written: " + out(1)});
    EXPECT_EQ(verbose.out, "");
}

TEST_F(RunTest, PreviewsStagesAndNoSidecar) {
    write_sequence(at(""), {1});
    const auto outcome =
        filter("all", {"--png", "--no-sidecar", "--dump-stages", at("stages/deeper"), "--json"});
    expect_ends(outcome, 0);
    EXPECT_FALSE(exists(out(1) + ".json"));
    EXPECT_EQ(read_text(at("out/o.0001.png")).substr(1, 3), "PNG");
    // One EXR for each texture that the plan's steps write.
    const auto plan = json_lines(run({"plan", at("all.yaml"), "-i", in(1), "--json"}).out);
    ASSERT_EQ(plan.size(), 1u);
    size_t stages = 0;
    for (const auto& texture : plan[0]["textures"]) {
        if (texture["imported"] == true || texture["format"] == "work_list") continue;
        ++stages;
        const std::string name = texture["name"].get<std::string>();
        const auto file = io::ExrFile::open(at("stages/deeper/" + name + ".0001.exr"));
        ASSERT_TRUE(file.ok()) << name;
        EXPECT_EQ(file->parts()[0].data_window.width(), texture["width"]) << name;
    }
    EXPECT_GE(stages, 8u);
    uintmax_t bytes = fs::file_size(at("out/o.0001.png"));
    for (const char* folder : {"out", "stages/deeper"})
        for (const auto& file : fs::directory_iterator(at(folder)))
            bytes += file.path().extension() == ".exr" ? file.file_size() : 0;
    EXPECT_EQ(json_lines(outcome.out).back()["bytes"], bytes);
    // A preview is not replaced by default either.
    std::filesystem::remove(out(1));
    expect_ends(filter("all", {"--png"}), 5, {at("out/o.0001.png")});
}

// A context variable chooses the table of a view: another file of the same size and time.
TEST_F(RunTest, AContextVariableOfOpenColorIoIsPartOfTheWork) {
    write_sequence(at(""), {1});
    write_text(
        at("config.ocio"),
        "ocio_profile_version: 1\nsearch_path: ''\nroles: {scene_linear: lin, default: lin}\n"
        "displays:\n  screen:\n    - !<View> {name: Graded, colorspace: graded}\n"
        "colorspaces:\n  - !<ColorSpace>\n    name: lin\n  - !<ColorSpace>\n"
        "    name: graded\n    from_reference: !<FileTransform> {src: $SHOT.spi1d}\n");
    for (const auto& [shot, last] : {std::pair{"one", "0.50"}, {"two", "0.25"}})
        write_text(at(concat(shot, ".spi1d")),
                   concat("Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n", last, "\n}\n"));
    fs::last_write_time(at("two.spi1d"), fs::last_write_time(at("one.spi1d")));
    const auto again = [&](const char* shot) {
        const auto outcome = filter("fxaa",
                                    {"--on-existing", "skip", "--png", "--ocio", at("config.ocio"),
                                     "--ocio-view", "Graded"},
                                    {.environment = {{"SHOT", shot}}});
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return contains(outcome.err, "1 written");
    };
    EXPECT_TRUE(again("one"));
    EXPECT_FALSE(again("one"));
    EXPECT_TRUE(again("two"));
}

TEST_F(RunTest, PeakMemoryOfALongRun) {
    write_frame(in(1), make_planes(320, 180));
    for (int frame = 2; frame <= 60; ++frame) std::filesystem::copy_file(in(1), in(frame));
    const auto with = [&](const char* frames) {
        // Under the address sanitizer: freed memory must not be kept for checks.
        return filter(
            "motion_blur",
            {"--threads", "1", "--on-existing", "overwrite", "-q", "--frames", frames},
            {.environment = {
                 {"ASAN_OPTIONS", "quarantine_size_mb=0:thread_local_quarantine_size_kb=0"}}});
    };
    const auto few = with("1-6"), many = with("1-60");
    ASSERT_EQ(few.code, 0) << few.text();
    ASSERT_EQ(many.code, 0) << many.text();
    EXPECT_EQ(outputs().size(), 60u);
    EXPECT_LT(double(many.peak_kib) / double(few.peak_kib), 1.1)
        << few.peak_kib << " KiB for 6 frames, " << many.peak_kib << " KiB for 60";
}

}  // namespace
}  // namespace postchain::test::run_test
