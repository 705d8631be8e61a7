// Foreign input: names with control characters, parts and attributes that this program never
// writes, unreadable folders, empty option values from a shell.
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/command/fixture.h"

namespace postchain::test::foreign_test {
namespace {

namespace fs = std::filesystem;

class ForeignTest : public CommandTest {
  protected:
    // No byte that acts on a terminal, and only the command's own lines.
    static void expect_harmless(const Outcome& outcome) {
        expect_harmless(outcome.out + "\n" + outcome.err);
    }
    static void expect_harmless(const std::string& text) {
        for (const char c : text)
            ASSERT_TRUE(uint8_t(c) >= 0x20 || c == '\n' || c == '\t') << int(c) << " in " << text;
        EXPECT_FALSE(contains(text, "\x7f")) << text;
        EXPECT_FALSE(contains(text, "\xc2\x9b")) << text;      // CSI in one character
        EXPECT_FALSE(contains(text, "\xe2\x80\xae")) << text;  // right to left
        EXPECT_FALSE(contains(text, "\xff")) << text;
        EXPECT_FALSE(contains(text, "\nforged")) << text;
    }
};

TEST_F(ForeignTest, EmptyWordsAreRefused) {
    write_sequence(at(""), {1, 2});
    for (const Arguments& words :
         {Arguments{"run", at("all.yaml"), "-i", in(), "-o", out(), "--view"},
          {"run", at("all.yaml"), "-i", in(), "-o", out(), "--frames"},
          {"run", at("all.yaml"), "-i", in(), "-o", out(), "--set"},
          {"run", "-i", in(), "-o", out()},
          {"plan", at("all.yaml"), "-i", in(), "--view-layer"},
          {"inspect", in(), "--profile"},
          {"inspect"},
          {"diff", in(), in(), "--frames"},
          {"diff", in(), in(), "--map"},
          {"diff", in()},
          {"ab", at("all.yaml"), at("fxaa.yaml"), "-i", in(), "-o", at("ab"), "--view"},
          {"bench", at("fxaa.yaml"), "-i", in(), "-o", at("b"), "--sweep", "fxaa.preset=12",
           "--profile"},
          {"scene", "wheels", "-o"},
          {"info", "--device"},
          {"stress", "--only"}})
        EXPECT_EQ(run(joined(words, {""})).code, 2) << words[0] << " " << words.back();
    EXPECT_EQ(outputs(), std::vector<std::string>());
}

TEST_F(ForeignTest, AnAttributeThatHasThePlaceOfOurs) {
    FrameFile file;
    file.attributes["postchain"] = 5;
    write_frame(in(1), make_planes(48, 32), file);
    expect_ends(filter("all"), 4, {in(1), "attribute postchain is int", "rename it"});
    // A string attribute of this name is treated as that of an earlier run.
    file.attributes["postchain"] = std::string("older");
    write_frame(in(1), make_planes(48, 32), file);
    EXPECT_EQ(filter("all").code, 0);
}

TEST_F(ForeignTest, NothingOfAFileActsOnTheTerminal) {
    const std::string evil =
        "\x1b]0;owned\x07\x1b[31m\x7f\xc2\x9b"
        "1m\xe2\x80\xae\xff\r\nforged: line";
    ImageF image(8, 8, 4, 0.5f);
    io::PlanesFile file;
    for (int c = 0; c < 4; ++c)
        file.channels.push_back({std::string(1, "RGBA"[c]), io::PixelType::float32, &image, c});
    file.channels.push_back({"evil" + evil, io::PixelType::float32, &image, 0});
    file.attributes["note" + evil] = "first\npostchain: error: forged" + evil;
    std::string large;
    while (large.size() < 1 << 20) large += evil + "<script>| `";
    file.attributes["large"] = file.attributes["worldToCamera"] = large;
    const std::string path = at("a" + evil + "b.0001.exr");
    ASSERT_TRUE(io::write_planes_exr(path, file).ok());
    expect_prints(run({"inspect", path}), 0,
                  {"\\x1b]0;owned\\x07", "first\\npostchain: error: forged", "\\u{202e}\\xff"});
    for (const Arguments& arguments :
         {Arguments{"inspect", path},
          {"plan", at("motion_blur.yaml"), "-i", path},
          {"run", at("motion_blur.yaml"), "-i", path, "-o", out(1)},
          {"run", at("fxaa.yaml"), "-i", path, "-o", at("out/" + evil + ".exr")},
          {"diff", path, path},
          {"diff", path, at(evil)},
          {"inspect", at("none" + evil)},
          {"run", at("fxaa.yaml"), "-i", path, "-o", out(1), "--" + evil},
          {evil},
          {"run", at(evil), "-i", path, "-o", out(1)},
          {"inspect", path, "--profile", evil},
          {"sheet", path, "-o", at("sheet" + evil + ".png")},
          {"ab", at("fxaa.yaml"), at("motion_blur.yaml"), "-i", path, "-o", at("ab"), "--repeats",
           "1", "--set", "fxaa.preset=12"},
          {"inspect", path, "--view-layer", evil}})
        expect_harmless(run(arguments));
    for (const char* name : {"ab/report.md", "ab/report.csv", "ab/report.json", "ab/index.html"})
        expect_harmless(read_text(at(name)));
    // As JSON the names are preserved (except invalid UTF-8).
    const auto json = run({"inspect", path, "--json", "--log-format", "json"});
    expect_harmless(json);
    std::string replaced = evil;
    replaced.replace(replaced.find('\xff'), 1, "\xef\xbf\xbd");
    EXPECT_EQ(json_lines(json.out).at(0)["files"]["color"]["parts"][0]["channels"].back()["name"],
              "evil" + replaced);
    // An unreadable neighbor is named in the plan and in the sidecar.
    const std::string frames = at("b" + evil + ".####.exr");
    write_frame(at("b" + evil + ".0001.exr"), make_planes(48, 32));
    write_text(at("b" + evil + ".0002.exr"), "no EXR");
    write_text(at("warp.yaml"), "postchain: 1\npasses: [motion_blur: {mode: inverse_warp}]\n");
    const auto plan = run({"plan", at("warp.yaml"), "-i", frames, "--frames", "1", "--json"});
    expect_harmless(plan);
    EXPECT_EQ(json_lines(plan.out).at(0).count("steps"), 1u);
    expect_ends(
        run({"run", at("warp.yaml"), "-i", frames, "--frames", "1", "-o", at("n.####.exr")}), 0);
    const std::string sidecar = read_text(at("n.0001.exr.json"));
    EXPECT_TRUE(contains(sidecar, "\\u202e")) << sidecar;
    expect_harmless(sidecar);
    // Text without control characters is unchanged.
    const std::string name = at("grün 日本.0001.exr");
    ASSERT_TRUE(io::write_planes_exr(name, file).ok());
    EXPECT_TRUE(contains(run({"inspect", name}).out, "grün 日本.0001.exr"));
}

TEST_F(ForeignTest, WhatCannotBeReachedIsNotMissing) {
    write_text(at("file"), "");
    fs::create_symlink("loop2", at("loop1"));
    fs::create_symlink("loop1", at("loop2"));
    fs::create_symlink("nowhere", at("dangling.0001.exr"));
    const std::string longest(300, 'a');
    for (const auto& [input, words] :
         {std::pair<std::string, const char*>{"file/in.0001.exr", "Not a directory"},
          {"file/in.####.exr", "cannot be read: Not a directory"},
          {"loop1/in.0001.exr", "symbolic links"},
          {"loop1/in.####.exr", "symbolic links"},
          {longest + ".exr", "too long"},
          {longest + "/in.####.exr", "too long"},
          {"no/in.####.exr", "no does not exist"},
          {"no/in.0001.exr", "no such file"},
          {"dangling.0001.exr", "link to a file that does not exist"},
          {"in.####.exr", "no file matches"}})
        expect_ends(run({"inspect", at(input)}), 4, {words});
    // Also with --frames, and for chain, camera and profile.
    write_frame(in(1), make_planes(8, 8));
    for (const Arguments& words : {Arguments{"inspect", at("loop1/in.####.exr"), "--frames", "1"},
                                   {"diff", at("loop1/in.####.exr"), in()},
                                   {"inspect", in(1), "--camera", at("loop1")},
                                   {"inspect", in(1), "--profile", at("loop1")},
                                   {"plan", at("loop1"), "-i", in(1)}}) {
        const auto outcome = run(words);
        EXPECT_TRUE(contains(outcome.err, "symbolic links")) << words[0] << outcome.text();
    }
}

// Permissions do not restrict root: runs as another user, with an accessible copy of the command.
TEST_F(ForeignTest, AFolderThatMayNotBeRead) {
    const bool is_root = geteuid() == 0;
    fs::create_directory(at("closed"));
    fs::permissions(at("closed"), is_root ? fs::perms::owner_all : fs::perms::none);
    fs::permissions(at(""), fs::perms::all);
    fs::copy_file(POSTCHAIN_COMMAND, at("command"));
    const auto inspected = [&](const std::string& input) {
        Arguments command;
        if (is_root)
            command = {"/usr/bin/setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"};
        command.insert(command.end(), {at("command"), "inspect", input});
        return run_program(command);
    };
    EXPECT_TRUE(contains(inspected(at("none.exr")).err, "no such file"));
    for (const char* input : {"closed/in.####.exr", "closed/in.0001.exr"}) {
        const auto outcome = inspected(at(input));
        EXPECT_EQ(outcome.code, 4) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "Permission denied")) << outcome.err;
    }
}

}  // namespace
}  // namespace postchain::test::foreign_test
