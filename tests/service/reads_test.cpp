// Files that clients name: pipes are not waited for, and no link leads out of the roots.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "chain/base/readable_file.h"
#include "config/text_tree.h"
#include "tests/io/exr_files.h"
#include "tools/sequence/frame/complete_file.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/service/http/file_streams.h"
#include "tools/service/http/report_parts.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Reads : public testing::Test {
  protected:
    void SetUp() override {
        base_ = fs::canonical(folder_.path()).string();
        fs::create_directories(base_ + "/root/shots");
        fs::create_directories(base_ + "/secret");
        write("root/shots/a.txt", "inside");
        write("secret/a.txt", "outside");
        confine_reads({base_ + "/root"});
    }
    void TearDown() override { confine_reads({}); }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(base_ + "/" + name) << text;
    }
    std::string root(const std::string& name) const { return base_ + "/root/" + name; }
    std::string pipe() const {
        const std::string path = root("pipe.exr");
        EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
        return path;
    }

    test::TempFolder folder_;
    std::string base_;
};

TEST_F(Reads, DoNotWaitForAPipe) {
    const std::string path = pipe();
    EXPECT_EQ(ReadableFile(path).fault(), "is not a file");
    EXPECT_EQ(ReadableFile("/dev/zero").fault(), "is not a file");
    EXPECT_EQ(ReadableFile(root("shots")).fault(), "is not a file");
    EXPECT_THAT(read_text_file(path, StatusCode::input).status().message(),
                HasSubstr("is not a file"));
    EXPECT_THAT(io::check_complete(path).message(), HasSubstr("is not a file"));
    EXPECT_FALSE(sequence::is_sidecar(path));
    EXPECT_FALSE(page_without_pictures(path).ok());
    const Reply reply = file_reply({path, "pipe.exr", "image/x-exr", 4});
    EXPECT_FALSE(reply.source->next().ok());
}

TEST_F(Reads, CommandsReadTextsFromPipes) {
    confine_reads({});
    const std::string path = pipe();
    // Open for both, so that neither waits.
    const int both = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_EQ(::write(both, "text", 4), 4);
    ReadableFile file(path, Pipes::read_by_commands);
    ASSERT_TRUE(file.ok());
    char text[4] = {};
    EXPECT_EQ(::read(file.fd(), text, 4), 4);
    EXPECT_EQ(std::string(text, 4), "text");
    ::close(both);
    EXPECT_FALSE(ReadableFile(path).ok());
}

TEST_F(Reads, NoLinkLeadsOutOfTheFolders) {
    EXPECT_EQ(text_of_file(root("shots/a.txt")), "inside");
    EXPECT_EQ(text_of_file(root("shots/../shots/./a.txt")), "inside");
    fs::create_symlink("shots/a.txt", root("relative"));
    fs::create_symlink(root("shots"), root("absolute"));
    EXPECT_EQ(text_of_file(root("relative")), "inside");
    EXPECT_EQ(text_of_file(root("absolute/a.txt")), "inside");
    fs::create_symlink(base_ + "/secret", root("way_out"));
    fs::create_symlink("../secret/a.txt", root("file_out"));
    for (const char* name : {"way_out/a.txt", "file_out", "../secret/a.txt"})
        EXPECT_FALSE(ReadableFile(root(name)).ok()) << name;
    EXPECT_THAT(ReadableFile(root("file_out")).fault(), HasSubstr("outside the folders"));
    EXPECT_EQ(text_of_file(root("way_out/a.txt")), "");
    // A command follows every link.
    confine_reads({});
    EXPECT_EQ(text_of_file(root("way_out/a.txt")), "outside");
}

}  // namespace
}  // namespace postchain::service
