// --confine-to: what a run opens itself and what its libraries open stays in the folders.
#include "tests/command/fixture.h"

namespace postchain::test::confine_test {
namespace {

namespace fs = std::filesystem;

// FOLDER/shot has everything that a run may open, FOLDER/other the same.
class ConfineTest : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        for (const char* folder : {"shot", "other"}) {
            fs::create_directories(at(concat(folder, "/out")));
            write_sequence(at(folder), {1, 2});
            write_text(at(concat(folder, "/fxaa.yaml")), kFxaa);
        }
    }
    Outcome confined(const Arguments& more, const Launch& launch = {}) const {
        return run(joined({"run", at("shot/fxaa.yaml"), "--device", "software", "--confine-to",
                           at("shot")},
                          more),
                   launch);
    }
    Arguments frames(const std::string& folder = "shot") const {
        return {"-i", at(folder + "/in.####.exr")};
    }
    Arguments to(const std::string& path) const { return {"-o", at(path)}; }
};

TEST_F(ConfineTest, WorksAsWithoutInTheFolders) {
    expect_ends(confined(joined(frames(), to("shot/out/a.####.exr"))), 0);
    ASSERT_EQ(
        run(joined(joined({"run", at("shot/fxaa.yaml")}, frames()), to("shot/out/b.####.exr")))
            .code,
        0);
    EXPECT_EQ(read_color(at("shot/out/a.0001.exr")).data,
              read_color(at("shot/out/b.0001.exr")).data);
    // OpenImageIO, relative paths, a folder that is made, a preview.
    Launch launch;
    launch.folder = at("shot");
    expect_ends(confined({"-i", "in.####.exr", "-o", "new/a.####.tif", "--mkdir", "--png"}, launch),
                0);
    EXPECT_TRUE(exists(at("shot/new/a.0002.png")));
    expect_ends(confined({"-i", "new/a.####.tif", "-o", "new/b.####.png"}, launch), 0);
    for (const char* subcommand : {"plan", "inspect"})
        expect_ends(run(joined({subcommand, "--confine-to", at("shot")},
                               *subcommand == 'p' ? joined({at("shot/fxaa.yaml")}, frames())
                                                  : Arguments{at("shot/in.####.exr")})),
                    0);
}

TEST_F(ConfineTest, RefusesWhatIsOutside) {
    const std::string outside = "outside the folders that this process may use";
    expect_ends(confined(joined(frames("other"), to("shot/out/a.####.exr"))), 4);
    expect_ends(confined(joined(frames(), to("other/out/a.####.exr"))), 5, {outside});
    EXPECT_TRUE(fs::is_empty(at("other/out")));
    expect_ends(
        run(joined(joined({"run", at("other/fxaa.yaml"), "--confine-to", at("shot")}, frames()),
                   to("shot/out/a.####.exr"))),
        3, {outside});
    expect_ends(run(joined(joined({"run", at("other/fxaa.yaml"), "--confine-to", at("shot"),
                                   "--also-read", at("other/fxaa.yaml"), "--device", "software"},
                                  frames()),
                           to("shot/out/a.####.exr"))),
                0);
    expect_ends(
        confined(joined(joined(frames(), to("shot/out/c.####.exr")), {"--confine-to", at("none")})),
        2, {"--confine-to", at("none")});
}

TEST_F(ConfineTest, NoLinkLeadsOut) {
    fs::remove(at("shot/in.0002.exr"));
    fs::create_symlink(at("other/in.0002.exr"), at("shot/in.0002.exr"));
    const Outcome outcome =
        confined(joined(joined(frames(), to("shot/out/a.####.exr")), {"--frames", "2"}));
    expect_ends(outcome, 4, {at("shot/in.0002.exr"), "outside the folders"});
    fs::create_symlink(at("other/out"), at("shot/way_out"));
    expect_ends(
        confined(joined(joined(frames(), to("shot/way_out/a.####.exr")), {"--frames", "1"})), 5,
        {"outside the folders"});
    EXPECT_TRUE(fs::is_empty(at("other/out")));
}

// Landlock refuses what libraries open by path: the tables of an OpenColorIO configuration.
TEST_F(ConfineTest, LibrariesReadNothingElse) {
    write_text(at("shot/config.ocio"),
               "ocio_profile_version: 2\nsearch_path: " + at("other") +
                   "\nroles: {default: raw, scene_linear: raw}\n"
                   "displays: {d: [!<View> {name: v, colorspace: table}]}\n"
                   "colorspaces:\n  - !<ColorSpace> {name: raw}\n"
                   "  - !<ColorSpace> {name: table, from_scene_reference: !<FileTransform> "
                   "{src: t.spi1d}}\n");
    write_text(at("other/t.spi1d"),
               "Version 1\nFrom 0.0 1.0\nLength 2\nComponents 1\n{\n0.0\n1.0\n}\n");
    const Arguments shown = {"--png", "--ocio", at("shot/config.ocio"), "--frames", "1"};
    const auto filtered = [&](const Arguments& more) {
        return confined(joined(joined(joined(frames(), to("shot/out/a.####.exr")), shown), more));
    };
    EXPECT_NE(filtered({}).code, 0);
    expect_ends(filtered({"--also-read", at("other/t.spi1d"), "--on-existing", "overwrite"}), 0);
}

}  // namespace
}  // namespace postchain::test::confine_test
