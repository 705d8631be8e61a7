// Paths that try to leave the roots. Files that clients name: no pipe is waited for, no link leads
// out, neither what is read nor what is written.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "chain/base/readable_file.h"
#include "config/text_tree.h"
#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/planes/complete_file.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/service/http/message.h"
#include "tools/service/http/report_parts.h"
#include "tools/service/work/roots.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class RootsTest : public testing::Test {
  protected:
    void SetUp() override {
        // Real paths, because the temporary folder may be a link.
        base_ = fs::canonical(folder_.path()).string();
        fs::create_directories(base_ + "/root/shots");
        fs::create_directories(base_ + "/rootless");
        fs::create_directories(base_ + "/second");
        std::ofstream(base_ + "/secret") << "x";
        std::ofstream(base_ + "/root/shots/a.exr") << "x";
        roots_ = *Roots::of({base_ + "/root", base_ + "/second"});
    }
    // "" if it is outside; below BASE.
    std::string resolved(const std::string& path) const {
        const auto found = roots_.resolve(path);
        if (found.ok()) return found->substr(base_.size());
        EXPECT_EQ(found.status().code(), StatusCode::input) << path;
        return "";
    }
    std::string root(const std::string& name) const { return base_ + "/root" + name; }
    using Table = std::vector<std::pair<std::string, std::string>>;
    test::TempFolder folder_;
    std::string base_;
    Roots roots_;
};

TEST_F(RootsTest, PathsInsideAndOutside) {
    for (const auto& [path, expected] : Table{{"shots/a.exr", "/root/shots/a.exr"},
                                              {"./shots/../shots//a.exr", "/root/shots/a.exr"},
                                              {root("/shots/a.exr"), "/root/shots/a.exr"},
                                              {"not/there/yet.exr", "/root/not/there/yet.exr"},
                                              {".", "/root"},
                                              {base_ + "/second/b", "/second/b"},
                                              {"../second/b", "/second/b"},
                                              {"...", "/root/..."}})
        EXPECT_EQ(resolved(path), expected) << path;
    for (const std::string path :
         {"../secret", "shots/../../secret", "/etc/passwd", "/", "..", "nothere/../../secret",
          "../root/../secret", "shots/a.exr/../../../secret"})
        EXPECT_EQ(resolved(path), "") << path;
    for (const char* path : {"", "/secret", "/rootless", "/root/../rootless/x"})
        EXPECT_EQ(resolved(base_ + path), "") << path;
}

TEST_F(RootsTest, LinksAreFollowed) {
    for (const auto& [link, target] : Table{{"/inside", "shots"},
                                            {"/out", base_ + "/rootless"},
                                            {"/file", "../secret"},
                                            {"/dangling", "../nothere"},
                                            {"/loop", "loop"},
                                            {"/shots/top", "/"}})
        fs::create_symlink(target, root(link));
    fs::create_symlink(base_ + "/root", base_ + "/rootless/back");
    for (const std::string& path :
         {std::string("inside/a.exr"), std::string("out/../root/shots/a.exr"),
          base_ + "/rootless/back/shots/a.exr"})
        EXPECT_EQ(resolved(path), "/root/shots/a.exr") << path;
    for (const char* path :
         {"out", "out/new.exr", "file", "dangling", "dangling/x", "loop", "shots/top/etc/passwd"})
        EXPECT_EQ(resolved(path), "") << path;
}

TEST_F(RootsTest, NamesThatAreNone) {
    EXPECT_NE(resolved(std::string(255, 'a')), "");
    std::string deep = "a";
    while (deep.size() < 5000) deep += "/a";
    for (const std::string& path :
         {std::string(), std::string("shots/a.exr\0.png", 16), std::string(256, 'a'), deep,
          deep.substr(0, 4095)})  // the last one is too long with its root
        EXPECT_EQ(roots_.resolve(path).status().code(), StatusCode::usage) << path;
    for (const auto& [roots, words] : std::vector<std::pair<std::vector<std::string>, std::string>>{
             {{}, "missing"},
             {{base_ + "/nowhere"}, "does not exist"},
             {{base_ + "/secret"}, "is a file"}}) {
        const Status status = Roots::of(roots).status();
        EXPECT_EQ(status.code(), StatusCode::usage);
        EXPECT_THAT(status.message(), HasSubstr(words));
    }
}

TEST_F(RootsTest, MessagesHoldWhatWasGivenAlone) {
    const std::string message = roots_.resolve("../secret").status().message();
    EXPECT_THAT(message, HasSubstr("'../secret'"));
    EXPECT_THAT(message, Not(HasSubstr(base_)));
    const std::string zero = roots_.resolve(std::string("a\0b", 3)).status().message();
    EXPECT_EQ(zero.find('\0'), std::string::npos);
    EXPECT_LT(roots_.resolve(std::string(100000, 'x')).status().message().size(), 400u);
}

TEST_F(RootsTest, FoldersOfAUser) {
    const Roots shots = *roots_.within({"shots"});
    EXPECT_TRUE(shots.resolve("shots/a.exr").ok());
    EXPECT_THAT(test::error_of(shots.resolve("b.exr")), HasSubstr("folders of this user"));
    for (const char* folder : {"shots/a.exr", "none", "../secret", "../rootless"})
        EXPECT_FALSE(roots_.within({folder}).ok()) << folder;
}

TEST_F(RootsTest, TheRootOfTheFileSystem) {
    const Roots all = *Roots::of({"/"});
    const std::string path = root("/shots/a.exr");
    EXPECT_EQ(test::must(all.resolve(path)), path);
    EXPECT_EQ(test::must(all.resolve(path.substr(1))), path);
    EXPECT_EQ(all.shown(path), path);
    EXPECT_EQ(all.shown("/"), ".");
    EXPECT_EQ(all.shown_in("/a: no"), "/a: no");
    EXPECT_EQ(test::must(resolve_pattern(*io::PathPattern::parse("/a.####.exr"), all)).text(),
              "/a.####.exr");
}

TEST_F(RootsTest, ShownFromTheFirstRoot) {
    EXPECT_EQ(roots_.shown(base_ + "/root/shots/a.exr"), "shots/a.exr");
    EXPECT_EQ(roots_.shown(base_ + "/second/b"), base_ + "/second/b");
    for (const char* path : {"./a=b.####.exr", "./a=b/c.exr", "a.b=c.exr", "a/b=c.exr"}) {
        EXPECT_EQ(roots_.shown(base_ + "/root/" + path), path);
        EXPECT_EQ(roots_.shown(*roots_.resolve(path)), path);
        EXPECT_TRUE(io::InputSpec::parse(path).ok()) << path;
    }
    // The root itself, and paths that only begin or end like it.
    const std::string top = root("");
    for (const auto& [text, expected] : Table{
             {"cannot read " + top + "/a: no (" + top + "/b)", "cannot read a: no (b)"},
             {top + ": is the folder of '" + top + "', in " + top, ".: is the folder of '.', in ."},
             {top + "/: no (" + top + "/)", ".: no (.)"},
             {top + "/(a)/b, " + top + "/.b.tmp", "(a)/b, .b.tmp"},
             {top + ".b, " + top + ". No", top + ".b, . No"},
             {top + "2: no", top + "2: no"},
             {top + "-b/a", top + "-b/a"},
             {"/mnt" + top + "/a", "/mnt" + top + "/a"}})
        EXPECT_EQ(roots_.shown_in(text), expected);
}

class Reads : public testing::Test {
  protected:
    void SetUp() override {
        base_ = fs::canonical(folder_.path()).string();
        fs::create_directories(base_ + "/root/shots");
        fs::create_directories(base_ + "/secret");
        write("root/shots/a.txt", "inside");
        write("secret/a.txt", "outside");
        confine_files({base_ + "/root"});
    }
    void TearDown() override { confine_files({}); }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(base_ + "/" + name) << text;
    }
    std::string root(const std::string& name) const { return base_ + "/root/" + name; }
    std::vector<std::string> names_in(const std::string& folder) const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(base_ + "/" + folder))
            names.push_back(entry.path().filename());
        std::ranges::sort(names);
        return names;
    }
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
    for (const std::string& special : {path, std::string("/dev/zero"), root("shots")})
        EXPECT_EQ(ReadableFile(special).fault(), "is not a file") << special;
    EXPECT_THAT(read_text_file(path, StatusCode::input).status().message(),
                HasSubstr("is not a file"));
    EXPECT_THAT(io::check_complete(path).message(), HasSubstr("is not a file"));
    EXPECT_FALSE(sequence::is_sidecar(path));
    EXPECT_TRUE(std::holds_alternative<Problem>(PageParts().find(path)));
    const Reply reply = file_reply({path, "pipe.exr", "image/x-exr", 4});
    EXPECT_FALSE(reply.file->next().ok());
}

TEST_F(Reads, CommandsReadTextsFromPipes) {
    confine_files({});
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
    fs::create_symlink(root("shots"), root("absolute"));
    EXPECT_EQ(text_of_file(root("absolute/a.txt")), "inside");
    fs::create_symlink(base_ + "/secret", root("way_out"));
    fs::create_symlink("../secret/a.txt", root("file_out"));
    for (const char* name : {"way_out/a.txt", "file_out", "../secret/a.txt"})
        EXPECT_FALSE(ReadableFile(root(name)).ok()) << name;
    EXPECT_THAT(ReadableFile(root("file_out")).fault(), HasSubstr("outside the folders"));
    EXPECT_EQ(text_of_file(root("way_out/a.txt")), "");
    // A command follows every link.
    confine_files({});
    EXPECT_EQ(text_of_file(root("way_out/a.txt")), "outside");
}

TEST_F(Reads, NoLinkLeadsWhatIsWrittenOut) {
    write("secret/b.0001.exr", "outside");
    fs::create_symlink(base_ + "/secret", root("way_out"));
    const std::string path = root("way_out/new.txt");
    EXPECT_THAT(io::atomic_write_text(path, "x", io::OnExisting::overwrite).status().message(),
                HasSubstr("outside the folders"));
    EXPECT_FALSE(io::ReplaceLock::take(path).ok());
    EXPECT_FALSE(io::Claim::take(path).ok());
    EXPECT_THAT(io::make_folder(root("way_out/b/c")).message(), HasSubstr("outside the folders"));
    io::remove_dead_temporaries(root("way_out"), [](const std::string&) { return true; });
    EXPECT_EQ(names_in("secret"), (std::vector<std::string>{"a.txt", "b.0001.exr"}));
    EXPECT_TRUE(io::PathPattern::parse(root("way_out/b.####.exr"))->discover().empty());
    EXPECT_FALSE(io::scan_folder(root("way_out")).ok());
    EXPECT_TRUE(io::make_folder(root("shots/b/c")).ok());
    EXPECT_TRUE(*io::atomic_write_text(root("shots/b/c/new.txt"), "x", io::OnExisting::fail));
}

// Its name leads to another folder while the file is written: the file stays in the first one.
TEST_F(Reads, ALinkInPlaceOfAnOpenFolderLeadsNowhere) {
    write("root/shots/a.txt.json", "{}");
    auto file = test::must(io::AtomicFile::create(root("shots/new.txt")));
    {
        auto lock = test::must(io::ReplaceLock::take(root("shots/a.txt")));
        fs::rename(root("shots"), root("moved"));
        fs::create_symlink(base_ + "/secret", root("shots"));
        write("secret/a.txt.json", "{}");
        EXPECT_TRUE(lock.set_aside(root("shots/a.txt.json")).ok());
        EXPECT_FALSE(fs::exists(root("moved/a.txt.json")));
    }
    ASSERT_TRUE(file.write("x", 1).ok());
    EXPECT_TRUE(*file.commit(io::OnExisting::fail));
    EXPECT_EQ(names_in("secret"), (std::vector<std::string>{"a.txt", "a.txt.json"}));
    EXPECT_EQ(names_in("root/moved"), (std::vector<std::string>{"a.txt", "a.txt.json", "new.txt"}));
}

}  // namespace
}  // namespace postchain::service
