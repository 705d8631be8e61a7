// Estimates, cuts, exit codes, info, man and completion. Texts and JSON: transcripts/.
#include <set>

#include "tests/command/completion.h"
#include "tests/command/fixture.h"

namespace postchain::test::describe_test {
namespace {

using DescribeTest = CommandTest;

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

// A manifest may have megabytes. The last character that is shown is whole.
TEST_F(DescribeTest, InspectShortensLongAttributes) {
    FrameFile file;
    const std::string manifest = std::string(299, 'm') + "\xc3\xa4" + std::string(1 << 20, 'n');
    file.attributes["manifest"] = manifest;
    write_frame(at("long.exr"), make_planes(48, 32), file);
    expect_prints(run({"inspect", at("long.exr")}), 0,
                  {"manifest: " + std::string(299, 'm') +
                   concat(" ... (", manifest.size(), " bytes; --json prints all)\n")});
    EXPECT_EQ(json_lines(run({"inspect", at("long.exr"), "--json"}).out)
                  .at(0)["files"]["color"]["parts"][0]["attributes"]["manifest"],
              manifest);
}

TEST_F(DescribeTest, ContradictedSignsFailUnderStrict) {
    write_sequence(at(""), {1, 2});
    write_text(at("flipped.yaml"),
               "profile: 1\nname: flipped\n"
               "color: [{channels: [['<layer>.Combined.R', '<layer>.Combined.G',"
               " '<layer>.Combined.B', '<layer>.Combined.A']]}]\n"
               "motion: [{channels: [['<layer>.Vector.Z', '<layer>.Vector.W']],"
               " scale: [1, -1]}]\n");
    const Arguments strict = {"inspect", in(), "--frames", "1", "--strict"};
    expect_ends(run(joined(strict, {"--profile", at("flipped.yaml")})), 7,
                {"contradicts the profile"});
    expect_prints(run(strict), 0, {"confirmed"});
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

TEST_F(DescribeTest, ManPageIsRoff) {
    const auto man = run({"man"});
    EXPECT_EQ(man.code, 0);
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
              (Words{"fail", "overwrite", "skip", "resume"}));
    EXPECT_EQ(offered({"postchain", "run", "paper", "--set", "motion_blur.sample"}),
              (Words{"motion_blur.sample_split=", "motion_blur.samples="}));
    EXPECT_EQ(offered({"postchain", "plan", "paper", "--profile", "c"}), Words{"cycles"});
}

}  // namespace
}  // namespace postchain::test::describe_test
