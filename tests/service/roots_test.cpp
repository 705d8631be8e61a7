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
        auto made = Roots::of({base_ + "/root", base_ + "/second"});
        ASSERT_TRUE(made.ok()) << made.status().message();
        roots_ = *made;
    }
    // "" if it is refused.
    std::string resolved(const std::string& path) const {
        const auto found = roots_.resolve(path);
        if (found.ok()) return *found;
        EXPECT_EQ(found.status().code(), StatusCode::usage);
        return "";
    }
    test::TempFolder folder_;
    std::string base_;
    Roots roots_;
};

TEST_F(RootsTest, WhatLiesInside) {
    const std::string root = base_ + "/root";
    EXPECT_EQ(resolved("shots/a.exr"), root + "/shots/a.exr");
    EXPECT_EQ(resolved("./shots/../shots//a.exr"), root + "/shots/a.exr");
    EXPECT_EQ(resolved(root + "/shots/a.exr"), root + "/shots/a.exr");
    EXPECT_EQ(resolved("not/there/yet.exr"), root + "/not/there/yet.exr");
    EXPECT_EQ(resolved("."), root);
    EXPECT_EQ(resolved(base_ + "/second/b"), base_ + "/second/b");
    EXPECT_EQ(resolved("../second/b"), base_ + "/second/b");
    EXPECT_EQ(resolved("..."), root + "/...");
}

TEST_F(RootsTest, WhatLiesOutside) {
    for (const std::string& path :
         {std::string("../secret"), std::string("shots/../../secret"), std::string("/etc/passwd"),
          base_ + "/secret", base_ + "/rootless", base_ + "/root/../rootless/x", std::string("/"),
          std::string(".."), base_, std::string("nothere/../../secret"),
          std::string("../root/../secret"), std::string("shots/a.exr/../../../secret")})
        EXPECT_EQ(resolved(path), "") << path;
}

TEST_F(RootsTest, LinksAreFollowed) {
    const std::string root = base_ + "/root";
    fs::create_directory_symlink("shots", root + "/inside");
    EXPECT_EQ(resolved("inside/a.exr"), root + "/shots/a.exr");
    fs::create_directory_symlink(base_ + "/rootless", root + "/out");
    EXPECT_EQ(resolved("out"), "");
    EXPECT_EQ(resolved("out/new.exr"), "");
    EXPECT_EQ(resolved("out/../root/shots/a.exr"), root + "/shots/a.exr");
    fs::create_symlink("../secret", root + "/file");
    EXPECT_EQ(resolved("file"), "");
    fs::create_symlink("../nothere", root + "/dangling");
    EXPECT_EQ(resolved("dangling"), "") << "a link that leads nowhere yet";
    EXPECT_EQ(resolved("dangling/x"), "");
    fs::create_symlink("loop", root + "/loop");
    EXPECT_EQ(resolved("loop"), "");
    fs::create_symlink("/", root + "/shots/top");
    EXPECT_EQ(resolved("shots/top/etc/passwd"), "");
    // A link from outside into the root resolves to a path inside.
    fs::create_directory_symlink(root, base_ + "/rootless/back");
    EXPECT_EQ(resolved(base_ + "/rootless/back/shots/a.exr"), root + "/shots/a.exr");
}

TEST_F(RootsTest, NamesThatAreNone) {
    EXPECT_EQ(resolved(""), "");
    EXPECT_EQ(resolved(std::string("shots/a.exr\0.png", 16)), "");
    EXPECT_EQ(resolved(std::string(256, 'a')), "");
    EXPECT_NE(resolved(std::string(255, 'a')), "");
    std::string deep = "a";
    while (deep.size() < 5000) deep += "/a";
    EXPECT_EQ(resolved(deep), "");
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
    EXPECT_EQ(roots_.shown_in("cannot read " + base_ + "/root/a: no (" + base_ + "/root/b)"),
              "cannot read a: no (b)");
    // The root itself, and paths that only begin or end like it.
    const std::string root = base_ + "/root";
    EXPECT_EQ(roots_.shown_in(root + ": is the folder of '" + root + "', in " + root),
              ".: is the folder of '.', in .");
    EXPECT_EQ(roots_.shown_in(root + "/: no (" + root + "/)"), ".: no (.)");
    EXPECT_EQ(roots_.shown_in(root + "/(a)/b, " + root + "/.b.tmp"), "(a)/b, .b.tmp");
    for (const std::string& other : {root + "2: no", root + "-b/a", "/mnt" + root + "/a"})
        EXPECT_EQ(roots_.shown_in(other), other);
}

TEST_F(RootsTest, FoldersThatAreNone) {
    EXPECT_FALSE(Roots::of({}).ok());
    EXPECT_FALSE(Roots::of({base_ + "/nowhere"}).ok());
    EXPECT_FALSE(Roots::of({base_ + "/secret"}).ok());
}

}  // namespace
}  // namespace postchain::service
