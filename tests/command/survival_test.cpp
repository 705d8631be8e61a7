// Kills, signals, and unusual environments: foreign locale, no home, no display, no GL.
#include <csignal>

#include "tests/command/fixture.h"

namespace postchain::test::survival_test {
namespace {

namespace fs = std::filesystem;

class SurvivalTest : public CommandTest {
  protected:
    Arguments over_and_over() const {
        return with_command(
            {"run", at("all.yaml"), "-i", in(), "-o", out(), "--on-existing", "overwrite", "-q"});
    }
};

// The work that the image names as its own; empty if the image cannot be read just now.
std::string made_by(const std::string& path) {
    const auto file = io::ExrFile::open(path);
    if (!file.ok()) return "";
    const auto found = file->parts()[0].attributes.find("postchain");
    return found == file->parts()[0].attributes.end() ? "" : found->second;
}

TEST_F(SurvivalTest, TwoRunsOnOneOutputLeaveImagesWithTheirOwnSidecars) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6}, 96, 64);
    const auto command = [&](const char* chain) {
        return with_command({"run", at(chain), "-i", in(), "-o", out(), "--on-existing",
                             "overwrite", "--png", "-q"});
    };
    for (int round = 0; round < 2; ++round) {
        Process one(command("fxaa.yaml")), other(command("motion_blur.yaml"));
        expect_ends(one.wait(), 0);
        expect_ends(other.wait(), 0);
        for (int frame = 1; frame <= 6; ++frame)
            EXPECT_EQ(sidecar(frame)["work"], made_by(out(frame))) << round << " " << frame;
    }
}

// tests/robustness kills a run between the image and its sidecar.
TEST_F(SurvivalTest, WithoutASidecarNoneOfAnEarlierImageStays) {
    write_sequence(at(""), {1});
    ASSERT_EQ(filter("fxaa").code, 0);
    ASSERT_EQ(filter("all", {"--on-existing", "overwrite", "--no-sidecar"}).code, 0);
    EXPECT_FALSE(exists(out(1) + ".json"));
    // A file of that name that is no sidecar stays.
    write_text(out(1) + ".json", "{\"work\": \"mine\"}");
    ASSERT_EQ(filter("fxaa", {"--on-existing", "overwrite", "--no-sidecar"}).code, 0);
    EXPECT_TRUE(exists(out(1) + ".json"));
}

TEST_F(SurvivalTest, SignalsEndARunWithoutTemporaries) {
    write_frame(in(1), make_planes(96, 64));
    for (int frame = 2; frame <= 300; ++frame) fs::copy_file(in(1), in(frame));
    Arguments said = over_and_over();
    said.pop_back();  // -q
    for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}}) {
        Process process(said);
        process.until([&] { return outputs().size() >= 3; });
        process.send(signal);
        expect_ends(process.wait(), code, {"the same command with --on-existing skip goes on"});
        EXPECT_EQ(temporaries(at("out")), std::vector<std::string>());
        const auto names = outputs();
        EXPECT_GE(names.size(), 3u);
        EXPECT_LT(names.size(), 300u);
        for (const auto& name : names) {
            EXPECT_FALSE(read_color(at("out/" + name)).empty());
            EXPECT_TRUE(exists(at("out/" + name + ".json"))) << name;
            fs::remove(at("out/" + name));
        }
    }
    Process scene(with_command({"scene", "wheels", "-o", at("w"), "--size", "320x180", "--frames",
                                "1-200", "--truth-samples", "64"}));
    scene.until([&] { return exists(at("w")); });
    scene.send(SIGTERM);
    EXPECT_EQ(scene.wait().code, 143);
    EXPECT_EQ(temporaries(at("w")), std::vector<std::string>());
}

TEST_F(SurvivalTest, ASecondSignalEndsItAtOnce) {
    write_frame(in(1), make_planes(640, 360));
    for (int frame = 2; frame <= 40; ++frame) fs::copy_file(in(1), in(frame));
    Process process(over_and_over());
    process.until([&] { return !outputs().empty(); });
    process.send(SIGINT);
    process.send(SIGTERM);
    const auto outcome = process.wait();
    EXPECT_TRUE(outcome.code == 130 || outcome.code == 143) << outcome.text();
    EXPECT_EQ(temporaries(at("out")), std::vector<std::string>());
}

// Without a home, a display or a path; tests/run has a foreign locale.
TEST_F(SurvivalTest, SurroundingsDoNotMatter) {
    write_sequence(at(""), {1});
    const Arguments arguments = {"--on-existing", "overwrite", "--set",
                                 "motion_blur.shutter_frames=0.75"};
    expect_ends(filter("all", arguments), 0);
    const ImageF first = read_color(out(1));
    fs::create_directory(at("bare"));
    const std::map<std::string, std::optional<std::string>> surroundings[] = {
        {{"LC_ALL", "de_DE.UTF-8"},
         {"HOME", std::nullopt},
         {"XDG_CACHE_HOME", std::nullopt},
         {"DISPLAY", std::nullopt},
         {"WAYLAND_DISPLAY", std::nullopt},
         {"XDG_RUNTIME_DIR", std::nullopt},
         {"PATH", std::nullopt},
         {"TERM", std::nullopt}},
        {{"LC_ALL", "no_SUCH"},
         {"HOME", "/nonexistent"},
         {"TMPDIR", "/nonexistent"},
         {"DISPLAY", ":77"},
         {"WAYLAND_DISPLAY", "wayland-77"}},
    };
    for (const auto& environment : surroundings) {
        SCOPED_TRACE(environment.begin()->second.value_or(""));
        expect_ends(filter("all", arguments, {.environment = environment, .folder = at("bare")}),
                    0);
        EXPECT_EQ(read_color(out(1)), first);
    }
}

#if !POSTCHAIN_SANITIZED  // the address sanitizer reserves terabytes
// The command starts in little memory, and every failure without GL gives a message
// (docs/command.md, `ulimit -v`).
TEST_F(SurvivalTest, LittleAddressSpace) {
    write_sequence(at(""), {1}, 640, 360);
    for (const long mebibytes : {25L, 40L, 96L}) {
        const Launch launch{.memory_bytes = mebibytes << 20};
        EXPECT_EQ(run({"--version"}, launch).code, 0) << mebibytes;
        for (const Arguments& command :
             {Arguments{"plan", at("all.yaml"), "-i", in(1)}, {"inspect", in(1)}}) {
            const auto outcome = run(command, launch);
            EXPECT_EQ(outcome.signal, 0) << mebibytes << command[0] << outcome.text();
            if (outcome.code == 0) continue;
            EXPECT_TRUE(contains(outcome.err, "memory")) << mebibytes << outcome.text();
        }
    }
}
#endif

TEST_F(SurvivalTest, NoUsableGl) {
    write_sequence(at(""), {1});
    write_text(at("vendor.json"), "");
    const Launch launch{.environment = {{"__EGL_VENDOR_LIBRARY_FILENAMES", at("vendor.json")}}};
    expect_ends(filter("fxaa", {}, launch), 6, {"OpenGL 4.5", "install a driver"});
    EXPECT_TRUE(outputs().empty());
    const auto info = run({"info"}, launch);
    EXPECT_EQ(info.code, 6);
    EXPECT_TRUE(contains(info.out, "OpenEXR ")) << info.out;  // prints what is available
    EXPECT_EQ(run({"scene", "still", "-o", at("s"), "--frames", "1"}, launch).code, 6);
    // Everything that needs no GL works.
    for (const Arguments& words :
         {Arguments{"plan", at("fxaa.yaml"), "-i", in(1)}, {"inspect", in(1)}, {"passes"}})
        expect_ends(run(words, launch), 0);
    // A device that does not exist.
    expect_ends(filter("fxaa", {"--device", "99"}), 6, {"postchain info"});
    EXPECT_EQ(filter("fxaa", {"--device", "software"}).code, 0);
}

// A file that is no library stands in its way.
TEST_F(SurvivalTest, NoLibraryOfGl) {
    write_sequence(at(""), {1});
    for (const auto& [folder, missing] :
         {std::pair("egl", std::vector{"libEGL.so.1"}),
          std::pair("gl", std::vector{"libOpenGL.so.0", "libGL.so.1"})}) {
        std::filesystem::create_directory(at(folder));
        for (const char* library : missing) write_text(at(concat(folder, "/", library)), "");
        const Launch launch{.environment = {{"LD_LIBRARY_PATH", at(folder)}}};
        expect_ends(filter("fxaa", {}, launch), 6,
                    {concat(missing[0], " cannot be loaded"), "install libglvnd"});
        EXPECT_TRUE(outputs().empty());
        EXPECT_EQ(run({"info"}, launch).code, 6);
    }
}

TEST_F(SurvivalTest, TheCpuIsNotTakenForAGpu) {
    const Json found = json_lines(run({"info", "--json"}).out).at(0);
    if (!found["gl"]["software"].get<bool>()) GTEST_SKIP() << "skipped: there is a GPU";
    const std::string renderer = found["gl"]["renderer"];
    const std::string warning = "no GPU with OpenGL 4.5";
    write_sequence(at(""), {1});
    const auto overwrite = [&](const Arguments& more) {
        return filter("fxaa", joined(more, {"--on-existing", "overwrite"}),
                      {.environment = {{"XDG_STATE_HOME", at("state")}}});
    };
    expect_ends(filter("fxaa", {"--device", "gpu"}), 6, {renderer, "--device auto or software"});
    EXPECT_TRUE(outputs().empty());
    const auto automatic = overwrite({});
    expect_ends(automatic, 0, {warning, renderer, "--device software"});
    EXPECT_EQ(automatic.err.find(warning), automatic.err.rfind(warning)) << "said twice";
    // Said today already.
    EXPECT_FALSE(contains(overwrite({}).err, warning));
    EXPECT_TRUE(contains(overwrite({"-v"}).err, warning));
    const std::string stamp = at("state/postchain/computing_on_the_cpu");
    for (const auto& [hours, said] : {std::pair{-23, false}, {-25, true}, {1, true}}) {
        fs::last_write_time(stamp, fs::file_time_type::clock::now() + std::chrono::hours(hours));
        EXPECT_EQ(contains(overwrite({}).err, warning), said) << hours;
    }
    // Chosen, or not to be heard.
    fs::remove(stamp);
    for (const Arguments& chosen : {Arguments{"--device", "software"}, {"-q"}}) {
        const auto silent = overwrite(chosen);
        EXPECT_EQ(silent.code, 0) << silent.text();
        EXPECT_FALSE(contains(silent.err, warning)) << silent.err;
    }
}

}  // namespace
}  // namespace postchain::test::survival_test
