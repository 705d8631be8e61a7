// Configurations of OpenColorIO in a long-running process: files that have changed on disk are read
// again, and every file that a configuration names is listed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;
using test::must;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

const ImageCalls& calls() {
    static const auto module = image_module(StatusCode::input);
    EXPECT_TRUE(module.ok()) << module.status().message();
    return **module;
}

class OcioConfig : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return folder_.path(name); }
    void write(const std::string& name, const std::string& text) {
        std::ofstream(at(name)) << text;
        // Two texts of equal length may be written within one tick of the clock.
        fs::last_write_time(at(name), fs::last_write_time(at(name)) + std::chrono::seconds(++age_));
    }
    // Light times `gain`, as a matrix or as a table of two entries.
    void write_config(const std::string& transform, const std::string& path = "") {
        write("c.ocio", "ocio_profile_version: 1\nsearch_path: '" + path +
                            "'\n"
                            "roles: {scene_linear: lin}\n"
                            "displays:\n  screen:\n    - !<View> {name: Film, colorspace: film}\n"
                            "colorspaces:\n  - !<ColorSpace>\n    name: lin\n"
                            "  - !<ColorSpace>\n    name: film\n    from_reference: " +
                            transform + "\n");
    }
    void write_table(const std::string& name, const std::string& gain) {
        write(name, "Version 1\nFrom 0.0 1.0\nLength 2\nComponents 1\n{\n0.0\n" + gain + "\n}\n");
    }
    float film_of(float light) const {
        ImageF pixel(1, 1, 3);
        for (float& value : pixel.data) value = light;
        const Status status = calls().to_view(pixel, {at("c.ocio"), "", "", ""});
        EXPECT_TRUE(status.ok()) << status.message();
        return pixel.data[1];
    }
    static std::string times(const std::string& gain) {
        return "!<MatrixTransform> {matrix: [" + gain + ", 0, 0, 0, 0, " + gain + ", 0, 0, 0, 0, " +
               gain + ", 0, 0, 0, 0, 1]}";
    }

    const test::TempFolder folder_;
    int age_ = 0;
};

TEST_F(OcioConfig, IsReadAgainWhenItOrATableOfItHasChanged) {
    write_config(times("0.50"));
    EXPECT_FLOAT_EQ(film_of(0.5f), 0.25f);
    write_config(times("0.25"));
    EXPECT_FLOAT_EQ(film_of(0.5f), 0.125f);
    write_config("!<FileTransform> {src: film.spi1d, interpolation: linear}");
    write_table("film.spi1d", "0.50");
    EXPECT_NEAR(film_of(0.5f), 0.25f, 1e-4);
    write_table("film.spi1d", "0.25");
    EXPECT_NEAR(film_of(0.5f), 0.125f, 1e-4);
    // A new file in a folder that is searched first.
    write_config("!<FileTransform> {src: film.spi1d, interpolation: linear}", "first:.");
    EXPECT_NEAR(film_of(0.5f), 0.125f, 1e-4);
    fs::create_directory(at("first"));
    write_table("first/film.spi1d", "1.00");
    EXPECT_NEAR(film_of(0.5f), 0.5f, 1e-4);
}

TEST_F(OcioConfig, NamesItsTablesInEveryFolderOfItsSearchPath) {
    write_config(
        "!<GroupTransform> {children: [!<FileTransform> {src: a.spi1d}, !<FileTransform> {src: "
        "/tables/b.spi1d}]}",
        "luts:/shared");
    const auto files = must(calls().ocio_sources(at("c.ocio")));
    EXPECT_THAT(files.files, UnorderedElementsAre(at("c.ocio"), at("luts/a.spi1d"),
                                                  "/shared/a.spi1d", "/tables/b.spi1d"));
    EXPECT_EQ(files.files.front(), at("c.ocio"));
    write_config("!<FileTransform> {src: ../a.spi1d}");
    EXPECT_THAT(calls().ocio_sources(at("c.ocio"))->files,
                ElementsAre(at("c.ocio"), at("../a.spi1d")));
    // Also in looks; in configurations of version 2 also in views and named transforms.
    write("c.ocio",
          "ocio_profile_version: 2\n"
          "roles: {scene_linear: lin, default: lin}\n"
          "file_rules: [!<Rule> {name: Default, colorspace: default}]\n"
          "displays: {screen: [!<View> {name: Film, view_transform: shown, "
          "display_colorspace: glass}]}\n"
          "looks: [!<Look> {name: warm, process_space: lin, transform: !<FileTransform> {src: "
          "look.spi1d}}]\n"
          "view_transforms: [!<ViewTransform> {name: shown, from_scene_reference: "
          "!<FileTransform> {src: view.spi1d}}]\n"
          "display_colorspaces: [!<ColorSpace> {name: glass, from_display_reference: "
          "!<FileTransform> {src: glass.spi1d}}]\n"
          "colorspaces: [!<ColorSpace> {name: lin}]\n"
          "named_transforms: [!<NamedTransform> {name: log, transform: !<FileTransform> {src: "
          "named.spi1d}}]\n");
    const auto all = must(calls().ocio_sources(at("c.ocio")));
    EXPECT_THAT(all.files, UnorderedElementsAre(at("c.ocio"), at("look.spi1d"), at("view.spi1d"),
                                                at("glass.spi1d"), at("named.spi1d")));
}

TEST_F(OcioConfig, ThatCannotBeUsedIsRefused) {
    EXPECT_THAT(calls().ocio_sources(at("c.ocio")).status().message(), HasSubstr("no such file"));
    write("c.ocio", "ocio_profile_version: [");
    const Status status = calls().ocio_sources(at("c.ocio")).status();
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_THAT(status.message(), HasSubstr("c.ocio: not a usable OpenColorIO configuration"));
    write_config("!<FileTransform> {src: film.spi1d}");
    fs::create_directory(at("film.spi1d"));
    EXPECT_THAT(calls().ocio_sources(at("c.ocio")).status().message(),
                HasSubstr("film.spi1d: is not a file"));
    write_config(times("2"), "${FIRST}:%SECOND%:$THIRD");
    EXPECT_EQ(must(calls().ocio_sources(at("c.ocio"))).variables.size(), 3u);
}

}  // namespace
}  // namespace postchain::io
