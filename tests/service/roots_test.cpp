// Paths that try to leave the roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/io/exr_files.h"
#include "tools/sequence/files/sequence.h"
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
    // "" if it is refused; below BASE.
    std::string resolved(const std::string& path) const {
        const auto found = roots_.resolve(path);
        if (found.ok()) return found->substr(base_.size());
        EXPECT_EQ(found.status().code(), StatusCode::usage);
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
    const std::vector<std::string> outside = {"../secret",
                                              "shots/../../secret",
                                              "/etc/passwd",
                                              base_ + "/secret",
                                              base_ + "/rootless",
                                              root("/../rootless/x"),
                                              "/",
                                              "..",
                                              base_,
                                              "nothere/../../secret",
                                              "../root/../secret",
                                              "shots/a.exr/../../../secret"};
    for (const std::string& path : outside) EXPECT_EQ(resolved(path), "") << path;
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
    EXPECT_EQ(resolved(""), "");
    EXPECT_EQ(resolved(std::string("shots/a.exr\0.png", 16)), "");
    EXPECT_EQ(resolved(std::string(256, 'a')), "");
    EXPECT_NE(resolved(std::string(255, 'a')), "");
    std::string deep = "a";
    while (deep.size() < 5000) deep += "/a";
    EXPECT_EQ(resolved(deep), "");
    for (const std::vector<std::string>& roots :
         {std::vector<std::string>(), {base_ + "/nowhere"}, {base_ + "/secret"}})
        EXPECT_FALSE(Roots::of(roots).ok());
}

TEST_F(RootsTest, MessagesHoldWhatWasGivenAlone) {
    const std::string message = roots_.resolve("../secret").status().message();
    EXPECT_THAT(message, HasSubstr("'../secret'"));
    EXPECT_THAT(message, Not(HasSubstr(base_)));
    const std::string zero = roots_.resolve(std::string("a\0b", 3)).status().message();
    EXPECT_EQ(zero.find('\0'), std::string::npos);
    EXPECT_LT(roots_.resolve(std::string(100000, 'x')).status().message().size(), 400u);
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
             {top + "2: no", top + "2: no"},
             {top + "-b/a", top + "-b/a"},
             {"/mnt" + top + "/a", "/mnt" + top + "/a"}})
        EXPECT_EQ(roots_.shown_in(text), expected);
}

}  // namespace
}  // namespace postchain::service
