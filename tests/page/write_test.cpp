// The file that write_page writes, as text: what is embedded, what a bad report does.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/page/fixture.h"
#include "tools/measure/report/page/page.h"
#include "tools/measure/report/report_json.h"

namespace postchain::report {
namespace {

namespace fs = std::filesystem;

struct WritePage : ::testing::Test {
    fs::path folder = fs::path(POSTCHAIN_BINARY_DIR) / "page_test_out" /
                      ::testing::UnitTest::GetInstance()->current_test_info()->name();
    Report report;

    void SetUp() override {
        fs::remove_all(folder);
        fs::create_directories(folder);
        report = testing::make_report(folder.string());
    }
    void TearDown() override { fs::remove_all(folder); }

    std::string path(const char* name) const { return (folder / name).string(); }
    static std::string text_of(const fs::path& file) {
        std::ifstream in(file, std::ios::binary);
        std::ostringstream text;
        text << in.rdbuf();
        return text.str();
    }
    // Text of <script ... id="ID">.
    static std::string element(const std::string& page, const std::string& id) {
        const size_t tag = page.find("id=\"" + id + "\">");
        if (tag == std::string::npos) return "";
        const size_t from = page.find('>', tag) + 1;
        return page.substr(from, page.find("</script>", from) - from);
    }
};

TEST_F(WritePage, HoldsTheReportAndEveryPicture) {
    ASSERT_TRUE(write_page(report, path("index.html")).ok());
    const std::string page = text_of(path("index.html"));
    EXPECT_EQ(page.find("<!--DATA-->"), std::string::npos);
    // The page contains report.json, though a chain in it holds "</script>".
    EXPECT_EQ(nlohmann::json::parse(element(page, "report")),
              nlohmann::json::parse(report_as_json(report)));
    const auto manifest = nlohmann::json::parse(element(page, "manifest"));
    ASSERT_EQ(manifest["images"].size(), report.images.size());
    for (const auto& image : manifest["images"])
        EXPECT_GT(element(page, image["id"]).size(), 50u) << image;
}

// Two variants that were measured against one converged picture carry it once a frame.
TEST_F(WritePage, HoldsASharedPictureOnce) {
    report = testing::make_blind_report(folder.string());
    ASSERT_TRUE(write_page(report, path("blind.html"), {path("beside")}).ok());
    ASSERT_TRUE(write_page(report, path("index.html")).ok());
    const std::string page = text_of(path("index.html"));
    const auto manifest = nlohmann::json::parse(element(page, "manifest"));
    ASSERT_EQ(manifest["images"].size(), report.images.size());
    std::map<std::string, std::set<int>> variants;  // by id
    for (const auto& image : manifest["images"])
        if (image["kind"] == "converged") variants[image["id"]].insert(int(image["variant"]));
    ASSERT_EQ(variants.size(), 4u);  // two pictures for each of two frames
    for (const auto& [id, who] : variants) {
        EXPECT_EQ(who, who.count(2) ? (std::set<int>{2}) : (std::set<int>{0, 1}));
        EXPECT_GT(element(page, id).size(), 50u);
        EXPECT_TRUE(fs::exists(folder / "beside" / (id + ".js")));
    }
    const auto files = fs::directory_iterator(folder / "beside");
    EXPECT_EQ(size_t(std::distance(begin(files), end(files))), report.images.size() - 2);
}

TEST_F(WritePage, PutsPicturesBesideIt) {
    ASSERT_TRUE(write_page(report, path("light.html"), {path("a b#")}).ok());
    const std::string page = text_of(path("light.html"));
    EXPECT_EQ(element(page, "image-0"), "");
    const auto manifest = nlohmann::json::parse(element(page, "manifest"));
    EXPECT_EQ(manifest["images"][0]["asset"], "a%20b%23/image-0.js");
    for (size_t i = 0; i < report.images.size(); ++i) {
        const std::string script = text_of(folder / "a b#" / concat("image-", i, ".js"));
        EXPECT_EQ(script.rfind(concat("postchain_asset(\"image-", i, "\",\""), 0), 0u);
    }
}

TEST_F(WritePage, NamesThePictureThatIsGone) {
    const std::string gone = report.images[3].path;
    fs::remove(folder / gone);
    const auto status = write_page(report, path("index.html"));
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_NE(status.message().find(gone), std::string::npos) << status.message();
    EXPECT_FALSE(fs::exists(path("index.html")));
}

TEST_F(WritePage, RefusesAPictureOfAnotherSize) {
    report.images[0].width += 1;
    const auto status = write_page(report, path("index.html"));
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_NE(status.message().find("listed as 97x64"), std::string::npos) << status.message();
}

TEST_F(WritePage, SaysWhatCannotBeWritten) {
    EXPECT_EQ(write_page(report, path("no/such/index.html")).code(), StatusCode::output);
    std::ofstream(path("file")) << "x";
    EXPECT_EQ(write_page(report, path("index.html"), {path("file")}).code(), StatusCode::output);
    EXPECT_FALSE(fs::exists(path("index.html")));
}

}  // namespace
}  // namespace postchain::report
