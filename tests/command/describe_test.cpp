// The outputs of plan, inspect, info, schema, passes, man and completion are usable.
#include <algorithm>
#include <limits>
#include <set>

#include "tests/command/completion.h"
#include "tests/command/fixture.h"

namespace postchain::test::describe_test {
namespace {

using DescribeTest = CommandTest;

TEST_F(DescribeTest, PlanAsTextJsonAndDot) {
    write_sequence(at(""), {1, 2, 3, 4});
    const auto plan = [&](const Arguments& more, const std::string& chain = "all") {
        const auto outcome = run(joined({"plan", at(chain + ".yaml"), "-i", in()}, more));
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return outcome.out;
    };
    const auto lines_of = [](const std::string& text) {
        return std::count(text.begin(), text.end(), '\n');
    };
    // Fits on a screen: the chain file's values of a pass, no defaults, and what is left out.
    const std::string one = plan({"--frames", "2"}), all = plan({"--frames", "2", "-v"});
    EXPECT_LE(lines_of(one), 24) << one;
    for (const char* words :
         {"frame 2  48x32  fp32", "0 motion_blur: mode=guertin samples=9 (",
          "left out tile_variance: sample_split is even [unused_step]", "memory: "})
        EXPECT_TRUE(contains(one, words)) << words << one;
    EXPECT_FALSE(contains(one, "subpix")) << one;
    EXPECT_GT(lines_of(all), 40);
    EXPECT_TRUE(contains(all, "step gather")) << all;
    // Frames with the same plan are printed once.
    const std::string same = plan({}, "fxaa");
    EXPECT_TRUE(contains(same, "\nframe 4: as frame 1\n")) << same;

    const auto plans = json_lines(plan({"--json"}));
    ASSERT_EQ(plans.size(), 4u);
    EXPECT_EQ(plans[1]["frame"], 2);
    EXPECT_EQ(plans[0]["passes"][1]["pass"], "fxaa");

    const std::string dot = plan({"--frames", "1", "--dot"});
    EXPECT_TRUE(dot.starts_with("digraph")) << dot.substr(0, 80);
    EXPECT_EQ(std::count(dot.begin(), dot.end(), '{'), std::count(dot.begin(), dot.end(), '}'));
    EXPECT_EQ(run({"plan", at("all.yaml"), "-i", in(1), "--dot", "--json"}).code, 2);
    // A plane that every frame lacks is reported once.
    write_text(at("lens.yaml"), "postchain: 1\npasses: [depth_of_field]\n");  // no camera
    const auto lacking = run({"plan", at("lens.yaml"), "-i", in()});
    EXPECT_EQ(lacking.code, 3) << lacking.text();
    EXPECT_EQ(lines_of(lacking.err), 1) << lacking.err;
}

TEST_F(DescribeTest, AnEstimateIsForTheScheduler) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6});
    const auto plan = [&](const Arguments& more) {
        const auto outcome =
            run(joined({"plan", at("motion_blur.yaml"), "-i", in(), "--json"}, more));
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return json_lines(outcome.out)[0];
    };
    const Json one = plan({"--frames", "1"}), six = plan({});
    const Json memory = one["estimate"]["memory_bytes"];
    // Color, depth and motion as stored and as float, and twice the result: more than the planes.
    EXPECT_GT(memory["frame"], 48 * 32 * 4 * (4 + 1 + 2));
    EXPECT_GE(memory["textures"], one["peak_bytes"]);
    // At most four frames are in memory.
    EXPECT_EQ(int64_t(six["estimate"]["memory_bytes"]["process"]) - int64_t(memory["process"]),
              3 * int64_t(memory["frame"]));
    EXPECT_FALSE(one["estimate"].contains("seconds"));

    ASSERT_EQ(filter("motion_blur", {"--frames", "1"}).code, 0);
    Json times = sidecar(1)["times_ms"];
    const Json timed =
        plan({"--frames", "2", "--calibration", out(1) + ".json"})["estimate"]["seconds"];
    // A frame of the same size and plan takes the calibration's time.
    EXPECT_NEAR(double(timed["filter"]), double(times["passes"][0]["ms"]) / 1000, 1e-9);
    EXPECT_NEAR(double(timed["all"]),
                double(timed["read"]) + double(timed["filter"]) + double(timed["write"]), 1e-9);
    // Twice the samples are nearly twice the fetches of the gather.
    const Json longer = plan({"--frames", "2", "--calibration", out(1) + ".json", "--set",
                              "motion_blur.samples=51"})["estimate"]["seconds"];
    EXPECT_GT(double(longer["filter"]), 1.3 * double(timed["filter"]));

    // A calibration without the pass gives no estimate, and a file that is not a sidecar is
    // refused.
    const auto other =
        run({"plan", at("fxaa.yaml"), "-i", in(1), "--json", "--calibration", out(1) + ".json"});
    expect_ends(other, 0, {"a pass that the calibration did not"});
    EXPECT_FALSE(json_lines(other.out)[0]["estimate"].contains("seconds"));
    for (const auto& path : {in(1), at("none.json")})
        expect_ends(run({"plan", at("fxaa.yaml"), "-i", in(1), "--calibration", path}), 4, {path});
}

TEST_F(DescribeTest, PlanSaysWhatIsLeftOutAndRunsTheSame) {
    write_sequence(at(""), {1});
    const Arguments still = {"--set", "motion_blur.shutter_frames=0"};
    // The word after --no-elide is not its value.
    const auto whole =
        run(joined({"plan", "--no-elide", at("motion_blur.yaml"), "-i", in(1), "--json"}, still));
    EXPECT_GT(json_lines(whole.out).at(0)["steps"].size(), 3u) << whole.text();
    expect_prints(run(joined({"plan", at("motion_blur.yaml"), "-i", in(1)}, still)), 0,
                  {"(does not run)", "left out whole: shutter_frames is 0 [off_by_configuration]"});
    expect_ends(filter("motion_blur", still), 0, {"left out motion_blur: shutter_frames is 0"});
    EXPECT_EQ(read_color(out(1)).data, read_color(in(1)).data);
}

TEST_F(DescribeTest, CutsAndMissingPlanesByRule) {
    write_sequence(at(""), {1, 2});
    // A shot of its own: its color is returned unchanged, and no other frame's.
    expect_ends(filter("motion_blur", {"--cuts", "1,2"}), 0);
    EXPECT_EQ(read_color(out(2)).data, read_color(in(2)).data);
    EXPECT_NE(read_color(out(1)).data, read_color(in(1)).data);
    const Json cut = sidecar(2), whole = sidecar(1);
    EXPECT_EQ(cut["plan"]["left_out"][0]["rule"], "camera_cut");
    EXPECT_FALSE(cut.contains("blocks"));
    // Every block is in one of the motion blur's lists.
    size_t blocks = 0;
    for (const auto& list : whole["blocks"]) {
        blocks += list["blocks"].get<size_t>();
        EXPECT_EQ(list["of"], 6) << list["list"];  // 48 x 32
    }
    EXPECT_EQ(blocks, 6u);
    // A cut outside of the frames that are run is no mistake, one outside of the sequence is.
    const Arguments one = {"--on-existing", "overwrite", "--frames", "1"};
    expect_ends(filter("motion_blur", joined(one, {"--cuts", "2,7"})), 0,
                {"--cuts: frames not in the sequence: 7\n"});
    FrameFile bare;
    bare.motion = false;
    write_frame(in(1), make_planes(48, 32), bare);
    expect_ends(filter("motion_blur", joined(one, {"--elide", "missing_plane"})), 0,
                {"left out motion_blur: needs motion"});
    EXPECT_EQ(read_color(out(1)).data, read_color(in(1)).data);
}

TEST_F(DescribeTest, SomeFramesThatFailAreExitCodeOne) {
    write_sequence(at(""), {1, 2});
    for (const Arguments& command :
         {Arguments{"plan", at("fxaa.yaml"), "-i"}, Arguments{"inspect", "-i"}})
        for (const auto& [frames, code] :
             {std::pair{"1-2", 0}, std::pair{"2-3", 1}, std::pair{"3-4", 4}})
            expect_ends(run(joined(command, {in(), "--frames", frames})), code);
}

TEST_F(DescribeTest, InspectNamesWhatItFound) {
    FrameFile file;
    file.object_ids = true;
    file.origin_x = -3;
    file.attributes["comment"] = std::string("a shot");
    write_frame(in(1), make_planes(48, 32), file);
    const auto text = run({"inspect", in(1)});
    expect_prints(text, 0,
                  {"ViewLayer.Combined.R (float)", "id (uint)", "(-3, 0)-(44, 31)",
                   "profile cycles", "comment: a shot", "max_speed_px: 6.7"});
    // A manifest may have megabytes. The last character that is shown is whole.
    const std::string manifest = std::string(299, 'm') + "\xc3\xa4" + std::string(1 << 20, 'n');
    file.attributes["manifest"] = manifest;
    write_frame(at("long.exr"), make_planes(48, 32), file);
    const auto shortened = run({"inspect", at("long.exr")});
    expect_prints(shortened, 0,
                  {"manifest: " + std::string(299, 'm') +
                   concat(" ... (", manifest.size(), " bytes; --json prints all)\n")});
    EXPECT_EQ(json_lines(run({"inspect", at("long.exr"), "--json"}).out)
                  .at(0)["files"]["color"]["parts"][0]["attributes"]["manifest"],
              manifest);
    // A file of three planes is described once.
    EXPECT_EQ(run({"inspect", "-i", "color=" + in(1) + ",depth=" + in(1)}).out, text.out);
    const auto lines = json_lines(run({"inspect", in(1), "--json"}).out);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0]["match"]["profile"], "cycles");
    EXPECT_EQ(lines[0]["match"]["detected"], true);
    EXPECT_EQ(lines[0]["frame"]["width"], 48);
    EXPECT_EQ(lines[0]["files"]["color"]["parts"][0]["attributes"]["comment"], "a shot");
    EXPECT_EQ(lines[0]["frame"]["distance"]["nearest"],
              1 / double(lines[0]["bounds"]["max_inverse_depth"]));
    write_sequence(at(""), {3, 4, 6});
    expect_prints(run({"inspect", at("")}), 0, {"in.####.exr: ", "missing: 2, 5"});
    const auto listed = json_lines(run({"inspect", at(""), "--json"}).out).at(0);
    EXPECT_EQ(listed["sequences"][0]["last"], 6);
    std::filesystem::copy(in(6), at("in.20261130.exr"));
    expect_prints(run({"inspect", at("")}), 0, {"; at least 1000000 frames missing, from 2 on"});
    expect_ends(run({"inspect", at("."), "--frames", "1"}), 2, {"--frames: has no effect"});
    EXPECT_EQ(run({"inspect"}).code, 2);
    EXPECT_EQ(run({"inspect", at("none.exr")}).code, 4);
}

TEST_F(DescribeTest, InspectOfAPatternLooksAtEveryFrame) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6, 7, 8, 10});
    const auto plain = run({"inspect", in()});
    expect_prints(plain, 0,
                  {"9 frames examined, 1 to 10: 48x32, color, inverse_depth, motion, motion_back",
                   "largest speed 2.236 to 6.708 (frame 1) px a frame",
                   "farthest distance 6 scene units", "no unusual frames"});
    expect_ends(plain, 0, {"1 frame missing: 9"});
    // One frame of each unusual kind.
    write_frame(in(2), make_planes(40, 32, 2));
    FrameFile bare;
    bare.depth = false;
    write_frame(in(3), make_planes(48, 32, 3), bare);
    Planes planes = make_planes(48, 32, 4);
    planes.color.data[4 * 7] = std::numeric_limits<float>::quiet_NaN();
    write_frame(in(4), planes);
    planes = make_planes(48, 32, 5);
    planes.motion = planes.back = ImageF(48, 32, 2);
    write_frame(in(5), planes);
    for (int frame : {8, 10}) {
        planes = make_planes(48, 32, frame);
        for (float& value : planes.color.data) value = value * 4 + 1;
        write_frame(in(frame), planes);
    }
    write_text(in(6), "broken");
    expect_prints(run({"inspect", in()}), 1,
                  {"frame 2: is 40x32; most are 48x32", "frame 3: has no inverse_depth",
                   "frame 4: 1 pixel with NaN or Inf", "frame 5: every motion vector is zero",
                   "frame 6: cannot be read", "a cut? (--cuts 7)"});
    const auto lines = json_lines(run({"inspect", in(), "--json"}).out);
    ASSERT_EQ(lines.size(), 2u);
    const Json& sequence = lines[1]["sequence"];
    EXPECT_EQ(sequence["readable"], 8);
    EXPECT_EQ(sequence["findings"].size(), 6u) << sequence["findings"];
    EXPECT_EQ(sequence["findings"][5]["frame"], 7);
    // Only the requested frames.
    expect_prints(run({"inspect", in(), "--frames", "7-8"}), 0, {"2 frames examined, 7 to 8"});
    EXPECT_FALSE(contains(run({"inspect", in(1)}).out, "examined"));
}

// tests/chain has the check itself.
TEST_F(DescribeTest, SignSelfCheck) {
    write_sequence(at(""), {1, 2});
    // A profile whose y sign is wrong, and that names no motion_back.
    write_text(at("flipped.yaml"),
               "profile: 1\nname: flipped\n"
               "color: [{channels: [['<layer>.Combined.R', '<layer>.Combined.G',"
               " '<layer>.Combined.B', '<layer>.Combined.A']]}]\n"
               "motion: [{channels: [['<layer>.Vector.Z', '<layer>.Vector.W']],"
               " scale: [1, -1]}]\n");
    const char* remedy = "use a profile whose `motion` has its `scale` multiplied by (-1, -1)";
    const Arguments flipped = {"inspect", in(), "--frames", "1", "--profile", at("flipped.yaml")};
    const Json wrong = json_lines(run(joined(flipped, {"--json"})).out).at(0)["sign_check"];
    EXPECT_EQ(wrong["verdict"], "contradicted");
    EXPECT_EQ(wrong["candidates"].size(), 4u);
    EXPECT_EQ(wrong["remedy"], remedy);
    expect_prints(run(flipped), 0, {"contradicted: another combination has", remedy});
    expect_ends(run(joined(flipped, {"--strict"})), 7, {"contradicts the profile", remedy});
    expect_prints(run({"inspect", in(), "--frames", "1", "--strict"}), 0, {"confirmed"});
    write_text(in(2), "broken");
    expect_ends(run({"inspect", in()}), 1, {"no sign self-check", in(2)});
}

// Vectors that are made from the camera are right by construction: only stored ones vote.
TEST_F(DescribeTest, OnlyStoredVectorsVoteForTheirSigns) {
    for (const int frame : {1, 2}) {
        Planes planes = make_planes(48, 32, frame);
        for (float& value : planes.motion.data) value *= 0.002f;  // as fractions
        std::fill_n(planes.depth.data.begin(), 48 * 16, 1e10f);   // sky
        std::fill_n(planes.motion.data.begin(), 2 * 48 * 16, 0.0f);
        write_frame(in(frame), planes);
    }
    // Turns by 0.05 in each frame.
    const auto matrix = [](double angle) {
        const double c = std::cos(angle), s = std::sin(angle);
        return concat("[[", c, ", 0, ", s, ", 0], [0, 1, 0, 0], [", -s, ", 0, ", c,
                      ", 0], [0, 0, 0, 1]]");
    };
    write_text(at("turns.json"), concat("{\"focal_length_mm\": 50, \"sensor_width_mm\": 36, "
                                        "\"camera_matrix_world\": {\"1\": ",
                                        matrix(0), ", \"2\": ", matrix(0.05), "}}"));
    const auto outcome =
        run({"inspect", in(), "--frames", "1", "--camera", at("turns.json"), "--json"});
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    const Json json = json_lines(outcome.out).at(0);
    EXPECT_GT(json["health"]["sky_motion_from_camera"], 700);
    EXPECT_TRUE(json["sign_check"]["candidates"].empty()) << json["sign_check"];
    EXPECT_NE(json["sign_check"]["why_not"], "");
    // All of them are made.
    const auto all = run(
        {"inspect", in(), "--frames", "1", "--camera", at("turns.json"), "--camera-motion", "all"});
    expect_prints(all, 0, {"sign self-check: not possible (the motion vectors are made from the"});
}

TEST_F(DescribeTest, Info) {
    const auto text = run({"info"});
    expect_prints(text, 0, {"postchain ", "OpenEXR ", "OpenImageIO ", "GL in use: "});
    const Json info = json_lines(run({"info", "--json"}).out).at(0);
    // At least GL 4.5's minimum; for textures, llvmpipe's limit.
    const Json& limits = info["gl"]["limits"];
    for (const auto& [limit, least] : {std::pair{"texture_px", 16384},
                                       {"storage_block_bytes", 1 << 27},
                                       {"shared_memory_bytes", 32768},
                                       {"group_invocations", 1024},
                                       {"groups", 65535},
                                       {"texture_units", 16},
                                       {"image_units", 8}})
        EXPECT_GE(limits[limit], least) << limit;
    EXPECT_TRUE(contains(text.out, "limit texture_px " + limits["texture_px"].dump()));
    EXPECT_TRUE(info["devices"].is_array());
}

// tests/config has what they say.
TEST_F(DescribeTest, SchemaAndPasses) {
    const auto schema = run({"schema"});
    EXPECT_EQ(schema.code, 0);
    EXPECT_EQ(Json::parse(schema.out, nullptr, false)["$schema"],
              "https://json-schema.org/draft/2020-12/schema");
    const auto passes = Json::parse(run({"passes", "--json"}).out, nullptr, false)["passes"];
    const auto text = run({"passes"});
    for (const auto& pass : passes) expect_prints(text, 0, {pass["name"].get<std::string>()});
    EXPECT_GE(passes.size(), 3u);
    const auto one = run({"passes", "motion_blur"});
    EXPECT_TRUE(one.out.starts_with("motion_blur: ")) << one.text();
    EXPECT_TRUE(contains(text.out, one.out + "\n"));
    for (const char* other : {"depth_of_field: ", "focal_length_mm"})
        EXPECT_FALSE(contains(one.out, other)) << other;
    const auto fxaa = Json::parse(run({"passes", "fxaa", "--json"}).out, nullptr, false);
    EXPECT_EQ(fxaa["name"], "fxaa");
    EXPECT_NE(std::find(passes.begin(), passes.end(), fxaa), passes.end());
    const std::string page = run({"passes", "--markdown"}).out;
    EXPECT_TRUE(contains(page, run({"passes", "fxaa", "--markdown"}).out));
    // A row that an earlier pass has in the same words is shown once.
    EXPECT_EQ(matches(page, "\n(\\| `coc` \\|)").size(), 1u);
    EXPECT_TRUE(contains(page, "\nAs in `depth_of_field`: `coc`, `focal_length_mm`, "));
    EXPECT_TRUE(contains(run({"passes", "joint_blur", "--markdown"}).out, "\n| `coc` |"));
    expect_ends(run({"passes", "motion_blurr"}), 2,
                {"unknown pass 'motion_blurr' (did you mean 'motion_blur'?)"});
}

// Documents.EveryVerbAndOptionIsInCommandMd has the list of subcommands.
TEST_F(DescribeTest, HelpIsCompletePerVerb) {
    for (const char* subcommand :
         {"run", "plan", "inspect", "info", "schema", "passes", "man", "completion"}) {
        const auto help = run({subcommand, "--help"});
        expect_prints(help, 0, {concat("Usage: postchain ", subcommand), "Exit codes"});
        EXPECT_EQ(help.err, "") << subcommand;
    }
    EXPECT_TRUE(run({"--version"}).out.starts_with("postchain 0."));
}

TEST_F(DescribeTest, ManPageIsRoff) {
    const auto man = run({"man"});
    EXPECT_EQ(man.code, 0);
    EXPECT_TRUE(man.out.starts_with(".TH POSTCHAIN 1 ")) << man.out.substr(0, 80);
    for (const char* word : {".SH NAME\n", ".SH SYNOPSIS\n", ".SH run\n", ".SH PARAMETERS\n",
                             ".SH EXIT STATUS\n", "\\-\\-on\\-existing", "motion_blur.samples"})
        EXPECT_TRUE(contains(man.out, word)) << word;
    // groff, if installed, reports no problems.
    write_text(at("postchain.1"), man.out);
    const auto groff = run_program({"bash", "-c",
                                    "command -v groff >/dev/null || exit 0; "
                                    "groff -man -Tascii -ww " +
                                        at("postchain.1")});
    EXPECT_EQ(groff.code, 0);
    EXPECT_EQ(groff.err, "");
    // Every request exists in man(7), and no text line starts with a control character.
    const std::set<std::string> known = {".TH", ".SH", ".TP", ".B", ".br", ".PP", ".BR"};
    std::istringstream lines(man.out);
    for (std::string line; std::getline(lines, line);)
        EXPECT_TRUE(line.starts_with(".") ? known.count(line.substr(0, line.find(' '))) == 1
                                          : !line.starts_with("'"))
            << line;
}

TEST_F(Completion, IsBashAndOffersWhatFits) {
    using Words = std::set<std::string>;
    EXPECT_EQ(offered({"postchain", "s"}),
              (Words{"scene", "schema", "selftest", "serve", "sheet", "stress", "study"}));
    EXPECT_EQ(offered({"postchain", "run", "pap"}), Words{"paper"});
    EXPECT_EQ(offered({"postchain", "run", "rever"}), Words{"reversed.yaml"});
    EXPECT_EQ(offered({"postchain", "run", "paper", "--on-e"}),
              (Words{"--on-error", "--on-existing"}));
    EXPECT_EQ(offered({"postchain", "run", "paper", "--on-existing", ""}),
              (Words{"fail", "skip", "overwrite"}));
    EXPECT_EQ(offered({"postchain", "run", "paper", "--set", "motion_blur.sample"}),
              (Words{"motion_blur.sample_split=", "motion_blur.samples="}));
    EXPECT_EQ(offered({"postchain", "plan", "paper", "--profile", "c"}), Words{"cycles"});
}

}  // namespace
}  // namespace postchain::test::describe_test
