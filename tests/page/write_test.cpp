// The file that write_page writes, as text: what is embedded, what a bad report does.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/page/fixture.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/measure/report/page/page.h"
#include "tools/measure/report/report_json.h"

namespace postchain::report {
namespace {

namespace fs = std::filesystem;

struct WritePage : ::testing::Test {
    test::TempFolder folder;
    Report report = testing::make_report(folder.path());

    std::string path(const std::string& name) const { return folder.path(name); }
    // Text of <script ... id="ID">.
    static std::string element(const std::string& page, const std::string& id) {
        const size_t tag = page.find("id=\"" + id + "\">");
        if (tag == std::string::npos) return "";
        const size_t from = page.find('>', tag) + 1;
        return page.substr(from, page.find("</script>", from) - from);
    }
    static nlohmann::json images_of(const std::string& page) {
        return nlohmann::json::parse(element(page, "manifest"))["images"];
    }
};

TEST_F(WritePage, HoldsTheReportAndEveryPicture) {
    ASSERT_TRUE(write_page(report, path("index.html")).ok());
    const std::string page = test::read_text(path("index.html"));
    EXPECT_EQ(page.find("<!--DATA-->"), std::string::npos);
    // The page contains report.json, though a chain in it holds "</script>".
    EXPECT_EQ(nlohmann::json::parse(element(page, "report")), nlohmann::json(report_json(report)));
    const auto images = images_of(page);
    ASSERT_GT(images.size(), report.images.size());
    for (const auto& image : images) EXPECT_GT(element(page, image["id"]).size(), 30u) << image;
}

// Error maps that follow from the pixels: of every result and of the input, against the truth or
// the result's own converged filter, which is not in the page itself. The first of two chains is
// compared with itself, the input with it too.
TEST_F(WritePage, ListsItsPictures) {
    Report ab = testing::make_blind_report(folder.path());
    ab.reference = "a";
    std::string text;
    const Report reports[] = {report, testing::make_blind_report(folder.path()), ab};
    for (const Report& written : reports) {
        EXPECT_TRUE(write_page(written, path("index.html")).ok());
        auto manifest = io::Json::parse(element(test::read_text(path("index.html")), "manifest"));
        text += "reference " + written.reference + "\n";
        for (const auto& image : manifest["images"])
            if (&written == &reports[0] || image["frame"] == testing::kFrames[0])
                text += image.dump() + "\n";
        manifest.erase("images");
        text += manifest.dump() + "\n";
    }
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/page/expected.manifests", text);
}

TEST_F(WritePage, PutsPicturesBesideIt) {
    ASSERT_TRUE(write_page(report, path("light.html"), {path("a b#")}).ok());
    const std::string page = test::read_text(path("light.html"));
    EXPECT_EQ(element(page, "image-0"), "");
    const auto images = images_of(page);
    ASSERT_GT(images.size(), report.images.size());
    for (size_t i = 0; i < images.size(); ++i) {
        EXPECT_EQ(images[i]["asset"], concat("a%20b%23/image-", i, ".js"));
        const std::string script = test::read_text(path(concat("a b#/image-", i, ".js")));
        EXPECT_EQ(script.rfind(concat("postchain_asset(\"image-", i, "\",\""), 0), 0u);
    }
}

TEST_F(WritePage, RefusesPicturesThatAreGoneOrOfAnotherSize) {
    const auto refusal = [&](const Report& bad) {
        const auto status = write_page(bad, path("index.html"));
        EXPECT_EQ(status.code(), StatusCode::input);
        EXPECT_FALSE(fs::exists(path("index.html")));
        return status.message();
    };
    Report larger = report;
    larger.images[0].width += 1;
    EXPECT_NE(refusal(larger).find("listed as 97x64"), std::string::npos);
    const std::string gone = report.images[3].path;
    fs::remove(path(gone));
    EXPECT_NE(refusal(report).find(gone), std::string::npos);
}

TEST_F(WritePage, SaysWhatCannotBeWritten) {
    EXPECT_EQ(write_page(report, path("no/such/index.html")).code(), StatusCode::output);
    test::write_text(path("file"), "x");
    EXPECT_EQ(write_page(report, path("index.html"), {path("file")}).code(), StatusCode::output);
    EXPECT_FALSE(fs::exists(path("index.html")));
}

}  // namespace
}  // namespace postchain::report
