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

// While any frame is written, each final name holds the old image, the new one, or nothing.
TEST_F(SurvivalTest, KilledWhileItWrites) {
    const int frames = 4;
    write_sequence(at(""), {1, 2, 3, 4}, 96, 64);
    ASSERT_EQ(filter("all").code, 0);
    std::map<int, ImageF> made, old;
    for (int frame = 1; frame <= frames; ++frame) made[frame] = read_color(out(frame));
    ASSERT_EQ(filter("fxaa", {"--on-existing", "overwrite"}).code, 0);
    for (int frame = 1; frame <= frames; ++frame) old[frame] = read_color(out(frame));
    fs::remove(out(frames));
    int olds = 0;
    for (int killed = 1; killed <= frames; ++killed) {
        Process process(over_and_over());
        const std::string begin = concat(".o.000", killed, ".exr.");
        process.until([&] {
            const auto names = temporaries(at("out"));
            return std::any_of(names.begin(), names.end(),
                               [&](const auto& name) { return name.starts_with(begin); });
        });
        process.send(SIGKILL);
        process.wait();
        for (int frame = 1; frame <= frames; ++frame) {
            if (!exists(out(frame))) {
                EXPECT_EQ(frame, frames);
                continue;
            }
            const ImageF color = read_color(out(frame));
            EXPECT_TRUE(color == made[frame] || color == old[frame]) << killed << " " << frame;
            olds += color == old[frame];
        }
        // A kill leaves only a temporary file, which matches no pattern and blocks nothing.
        for (const auto& name : temporaries(at("out"))) {
            EXPECT_TRUE(name.ends_with(".tmp")) << name;
            fs::remove(at("out/" + name));
        }
    }
    EXPECT_GT(olds, 0);
    ASSERT_EQ(filter("all", {"--on-existing", "skip"}).code, 0);  // continues where it ended
    for (int frame = 1; frame <= frames; ++frame)
        EXPECT_EQ(read_color(out(frame)), made[frame]) << frame;
}

// The work that the image names as its own; empty if the image cannot be read just now.
std::string made_by(const std::string& path) {
    const auto file = io::ExrFile::open(path);
    if (!file.ok()) return "";
    const auto found = file->parts()[0].attributes.find("postchain");
    return found == file->parts()[0].attributes.end() ? "" : found->second;
}

TEST_F(SurvivalTest, TwoRunsOnOneOutputLeaveImagesWithTheirOwnSidecars) {
    write_sequence(at(""), {1, 2, 3, 4, 5, 6}, 96, 64);
    for (int round = 0; round < 2; ++round) {
        const auto command = [&](const char* chain) {
            return with_command({"run", at(chain), "-i", in(), "-o", out(), "--on-existing",
                                 "overwrite", "--png", "-q"});
        };
        Process one(command("fxaa.yaml")), other(command("motion_blur.yaml"));
        const auto first = one.wait(), second = other.wait();
        EXPECT_EQ(first.code, 0) << first.text();
        EXPECT_EQ(second.code, 0) << second.text();
        for (int frame = 1; frame <= 6; ++frame)
            EXPECT_EQ(sidecar(frame)["work"], made_by(out(frame))) << round << " " << frame;
    }
}

// Killed between the image and its sidecar, a run leaves no sidecar of another image.
TEST_F(SurvivalTest, AKilledRunLeavesNoSidecarOfAnotherImage) {
    write_sequence(at(""), {1}, 96, 64);
    int between = 0;
    for (int round = 0; round < 3; ++round) {
        ASSERT_EQ(filter("fxaa", {"--on-existing", "overwrite"}).code, 0);
        const std::string old = made_by(out(1));
        Process process(over_and_over());
        process.until([&] { return made_by(out(1)) != old; });
        process.send(SIGKILL);
        process.wait();
        EXPECT_NE(made_by(out(1)), old);
        if (exists(out(1) + ".json"))
            EXPECT_EQ(sidecar(1)["work"], made_by(out(1)));
        else
            ++between;
        for (const auto& name : temporaries(at("out"))) fs::remove(at("out/" + name));
    }
    RecordProperty("between", between);
    // Without a sidecar of its own, none of an earlier image stays either.
    ASSERT_EQ(filter("fxaa", {"--on-existing", "overwrite"}).code, 0);
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
    const struct {
        int signal;
        int code;
    } cases[] = {{SIGINT, 130}, {SIGTERM, 143}, {SIGHUP, 129}};
    for (const auto& expected : cases) {
        Arguments said = over_and_over();
        said.pop_back();  // -q
        Process process(said);
        process.until([&] { return outputs().size() >= 3; });
        process.send(expected.signal);
        const auto outcome = process.wait();
        EXPECT_EQ(outcome.code, expected.code) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "the same command with --on-existing skip goes on"))
            << outcome.err;
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

TEST_F(SurvivalTest, SignalToAScene) {
    Process process(with_command({"scene", "wheels", "-o", at("w"), "--size", "320x180", "--frames",
                                  "1-200", "--truth-samples", "64"}));
    process.until([&] { return exists(at("w")); });
    process.send(SIGTERM);
    EXPECT_EQ(process.wait().code, 143);
    EXPECT_EQ(temporaries(at("w")), std::vector<std::string>());
}

// de_DE writes 0,5 and 1.000: neither may reach a file, a name or a parsed number. If the system
// lacks the locale, the run is an ordinary one; tests/run has a hand-made locale.
TEST_F(SurvivalTest, SurroundingsDoNotMatter) {
    write_sequence(at(""), {1, 1001});
    write_text(at("camera.json"), "{\"f_stop\": 1.5, \"frames\": {\"1001\": {\"f_stop\": 2.5}}}");
    const Arguments arguments = {"--on-existing",   "overwrite", "--camera",
                                 at("camera.json"), "--set",     "motion_blur.shutter_frames=0.75",
                                 "--json"};
    expect_ends(filter("all", arguments), 0);
    const ImageF first = read_color(out(1)), last = read_color(out(1001));
    const std::string work = sidecar(1001)["work"];
    const std::string bare = at("bare");
    fs::create_directory(bare);
    const std::map<std::string, std::optional<std::string>> surroundings[] = {
        {{"LC_ALL", "de_DE.UTF-8"},
         {"LANG", "de_DE.UTF-8"},
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
        Launch launch;
        launch.environment = environment;
        launch.folder = bare;
        const auto outcome = filter("all", arguments, launch);
        const std::string what = environment.begin()->first;
        EXPECT_EQ(outcome.code, 0) << what << outcome.text();
        EXPECT_EQ(read_color(out(1)), first) << what;
        EXPECT_EQ(read_color(out(1001)), last) << what;
        EXPECT_EQ(sidecar(1001)["work"], work) << what;
        EXPECT_EQ(json_lines(outcome.out).size(), 2u) << what;
    }
}

// The first stage marks that the input has been read; the process is paused while it changes.
TEST_F(SurvivalTest, AnInputThatChangesMeanwhile) {
    const auto change_once = [&](const std::string& how) {
        write_sequence(at(""), {1}, 192, 128);
        fs::remove_all(at("stages"));
        Process process(with_command({"run", at("all.yaml"), "-i", in(), "-o", out(), "--png",
                                      "--dump-stages", at("stages")}));
        const auto begun = [&] {
            std::error_code error;
            for (const auto& entry : fs::directory_iterator(at("stages"), error))
                if (entry.path().filename().string()[0] != '.') return true;
            return false;
        };
        process.until(begun);
        process.send(SIGSTOP);
        if (fs::exists(out(1))) {  // a fast machine was done already
            process.send(SIGKILL);
            process.wait();
            fs::remove_all(at("out"));
            fs::create_directory(at("out"));
            return std::optional<Outcome>();
        }
        if (how == "rewritten") write_frame(in(1), make_planes(192, 128, 2));
        if (how == "touched") fs::last_write_time(in(1), fs::file_time_type::clock::now());
        if (how == "removed") fs::remove(in(1));
        process.send(SIGCONT);
        return std::optional(process.wait());
    };
    const auto change = [&](const std::string& how) {
        for (int i = 0; i < 20; ++i)
            if (auto outcome = change_once(how)) return *outcome;
        ADD_FAILURE() << "the process was never stopped in time";
        return Outcome();
    };
    for (const char* how : {"rewritten", "touched", "removed"}) {
        expect_ends(change(how), 4, {in(1), "while"});
        EXPECT_EQ(fs::directory_iterator(at("out")), fs::directory_iterator()) << how;
    }
    EXPECT_EQ(change("left alone").code, 0);
}

#if !POSTCHAIN_SANITIZED  // the address sanitizer reserves terabytes
// The command starts in little memory, and every failure without GL gives a message
// (docs/command.md, "Limits of address space").
TEST_F(SurvivalTest, LittleAddressSpace) {
    write_sequence(at(""), {1}, 640, 360);
    for (const long mebibytes : {24L, 40L, 96L}) {
        Launch launch;
        launch.memory_bytes = mebibytes << 20;
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
    Launch launch;
    launch.environment = {{"__EGL_VENDOR_LIBRARY_FILENAMES", at("vendor.json")}};
    expect_ends(filter("fxaa", {}, launch), 6, {"OpenGL 4.5", "install a driver"});
    EXPECT_TRUE(outputs().empty());
    const auto info = run({"info"}, launch);
    EXPECT_EQ(info.code, 6);
    EXPECT_TRUE(contains(info.out, "OpenEXR ")) << info.out;  // prints what is available
    EXPECT_EQ(run({"scene", "still", "-o", at("s"), "--frames", "1"}, launch).code, 6);
    // Everything that needs no GL works.
    EXPECT_EQ(run({"plan", at("fxaa.yaml"), "-i", in(1)}, launch).code, 0);
    EXPECT_EQ(run({"inspect", in(1)}, launch).code, 0);
    EXPECT_EQ(run({"passes"}, launch).code, 0);
    // A device that does not exist.
    const auto device = filter("fxaa", {"--device", "99"});
    EXPECT_EQ(device.code, 6) << device.text();
    EXPECT_TRUE(contains(device.err, "postchain info")) << device.err;
    EXPECT_EQ(filter("fxaa", {"--device", "software"}).code, 0);
}

TEST_F(SurvivalTest, TheCpuIsNotTakenForAGpu) {
    const Json found = json_lines(run({"info", "--json"}).out).at(0);
    if (!found["gl"]["software"].get<bool>()) GTEST_SKIP() << "there is a GPU";
    const std::string renderer = found["gl"]["renderer"];
    const auto said = [](const std::string& text) {
        size_t count = 0;
        for (size_t at = 0; (at = text.find("no GPU with OpenGL 4.5", at)) != text.npos; ++at)
            ++count;
        return count;
    };
    write_sequence(at(""), {1});
    const auto overwrite = [&](Arguments more) {
        more.insert(more.end(), {"--on-existing", "overwrite"});
        return filter("fxaa", more);
    };

    expect_ends(filter("fxaa", {"--device", "gpu"}), 6, {renderer, "--device auto or software"});
    EXPECT_TRUE(outputs().empty());

    const auto automatic = overwrite({});
    EXPECT_EQ(automatic.code, 0) << automatic.text();
    EXPECT_EQ(said(automatic.err), 1u) << automatic.err;
    EXPECT_TRUE(contains(automatic.err, renderer)) << automatic.err;
    EXPECT_TRUE(contains(automatic.err, "--device software")) << automatic.err;
    // Chosen, or not to be heard.
    for (const Arguments& chosen : {Arguments{"--device", "software"}, {"-q"}}) {
        const auto silent = overwrite(chosen);
        EXPECT_EQ(silent.code, 0) << silent.text();
        EXPECT_EQ(said(silent.err), 0u) << silent.err;
    }
}

}  // namespace
}  // namespace postchain::test::survival_test
