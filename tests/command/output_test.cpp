// Unwritable places: exit code 5 with the reason, and no partial files.
#include "tests/command/fixture.h"

namespace postchain::test::output_test {
namespace {

namespace fs = std::filesystem;

using OutputTest = CommandTest;

TEST_F(OutputTest, FilesAndFoldersInEachOthersPlace) {
    write_sequence(at(""), {1});
    write_text(at("file"), "kept");
    expect_ends(run({"run", at("fxaa.yaml"), "-i", in(), "-o", at("file/o.####.exr")}), 5,
                {at("file")});
    expect_ends(filter("fxaa", {"--dump-stages", at("file")}), 5, {at("file")});
    EXPECT_EQ(read_text(at("file")), "kept");
    EXPECT_TRUE(outputs().empty());
    fs::create_directory(out(1));
    for (const char* policy : {"fail", "skip", "overwrite"})
        expect_ends(filter("fxaa", {"--on-existing", policy}), 5, {out(1)});
}

// The size limit moves through header, pixels and sidecar. tests/robustness fails each call.
TEST_F(OutputTest, DiskFullByAFileSizeLimit) {
    write_sequence(at(""), {1});
    ASSERT_EQ(filter("fxaa").code, 0);
    const long whole = long(fs::file_size(out(1)));
    write_text(out(1), "old");
    for (const long bytes : {10L, whole / 2, whole - 1}) {
        SCOPED_TRACE(bytes);
        // Captured stderr is a file too; the shader cache must not matter either.
        const bool is_blind = bytes < 1000;
        const auto outcome =
            filter("fxaa", {"--on-existing", "overwrite"},
                   {.file_bytes = bytes, .stdout_path = "/dev/null", .close_stderr = is_blind});
        expect_ends(outcome, 5);
        if (!is_blind) expect_ends(outcome, 5, {"file-size limit", out(1)});
        EXPECT_TRUE(read_text(out(1)) == "old") << "the old file is lost";
    }
}

TEST_F(OutputTest, StdoutThatIsFullOrClosed) {
    write_sequence(at(""), {1});
    const Launch full{.stdout_path = "/dev/full"}, closed{.close_stdout = true};
    for (const Launch& launch : {full, closed}) {
        for (const Arguments& arguments : {Arguments{"passes"},
                                           {"--help"},
                                           {"info"},
                                           {"inspect", in(1)},
                                           {"plan", at("fxaa.yaml"), "-i", in(1)}})
            expect_ends(run(arguments, launch), 5, {"stdout"});
        expect_ends(filter("fxaa", {"--json", "--on-existing", "overwrite"}, launch), 5);
        EXPECT_FALSE(read_color(out(1)).empty());
    }
    // Without --json nothing is printed on stdout, so closing it does not matter.
    expect_ends(filter("fxaa", {"--on-existing", "overwrite"}, closed), 0);
    // No message may end up in an image.
    Launch blind = closed;
    blind.close_stderr = true;
    EXPECT_EQ(filter("fxaa", {"--on-existing", "overwrite"}, blind).code, 0);
    EXPECT_FALSE(read_color(out(1)).empty());
}

TEST_F(OutputTest, ReaderOfThePipeGoesAway) {
    write_sequence(at(""), {1, 2, 3});
    // A pipe whose reader has closed it.
    const std::string pipe = "mkfifo " + at("pipe") + "; exec 3<>" + at("pipe") + " 4>" +
                             at("pipe") + " 3<&-; exec " + POSTCHAIN_COMMAND + " ";
    for (const std::string& words :
         {std::string("passes"), std::string("schema"), std::string("--help"),
          "run " + at("fxaa.yaml") + " -q -i '" + in() + "' -o '" + out() + "' --json"}) {
        const auto outcome = run_program({"bash", "-c", pipe + words + " >&4"});
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        EXPECT_EQ(outcome.err, "") << words;
        std::filesystem::remove(at("pipe"));
    }
    EXPECT_EQ(outputs().size(), 3u);
}

}  // namespace
}  // namespace postchain::test::output_test
