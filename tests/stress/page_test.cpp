// The page of the matrix: its failures and limits, and its images, decoded again.
#include <gtest/gtest.h>

#include <cmath>

#include "tools/measure/stress/page.h"
#include "tools/sequence/io/png.h"

namespace postchain::stress {
namespace {

Exhibit exhibit_of(int width, int height) {
    Exhibit exhibit;
    exhibit.check = "mirror";
    exhibit.input = ImageF(width, height, 4, 2);
    exhibit.result = exhibit.compared = ImageF(width, height, 4, 1);
    exhibit.error = ImageF(width, height, 1);
    exhibit.compared_is = "another";
    exhibit.error_is = "relative error";
    return exhibit;
}

// RFC 4648, section 10.
TEST(Png, Base64OfTheTestVectors) {
    const std::pair<const char*, const char*> rows[] = {{"", ""},
                                                        {"f", "Zg=="},
                                                        {"fo", "Zm8="},
                                                        {"foo", "Zm9v"},
                                                        {"foob", "Zm9vYg=="},
                                                        {"fooba", "Zm9vYmE="},
                                                        {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : rows) EXPECT_EQ(io::base64_of(bytes), text);
    EXPECT_EQ(io::base64_of(std::string_view("\xfb\xff\0", 3)), "+/8A");
}

// The ends and the middle of the published map: (0.001462, 0.000466, 0.013866), (0.716387,
// 0.214982, 0.475290), (0.987053, 0.991438, 0.749504).
TEST(Png, MagmaIsThePublishedMap) {
    ImageF values(5, 1, 1);
    values.data = {0, 0.5f, 1, 7, NAN};
    const auto colors = io::magma_of(values);
    ASSERT_TRUE(colors.ok());
    const int expected[5][3] = {
        {0, 0, 4}, {183, 55, 121}, {252, 253, 191}, {252, 253, 191}, {0, 0, 4}};
    for (int i = 0; i < 5; ++i)
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(colors->at(i, 0, c), expected[i][c], 1) << i << " " << c;
}

// Signature, and width and height of the header chunk.
TEST(Pictures, FourOfThemWithTheirScales) {
    Exhibit exhibit = exhibit_of(80, 40);
    exhibit.error.at(3, 4) = 0.25f;
    const auto all = pictured(exhibit);
    ASSERT_TRUE(all.ok()) << all.status().message();
    ASSERT_EQ(all->pictures.size(), 4u);
    EXPECT_EQ(all->place, "");
    const std::pair<const char*, const char*> expected[] = {{"input", "black is 0, white 2"},
                                                            {"result", "black is 0, white 1"},
                                                            {"another", "black is 0, white 1"},
                                                            {"relative error", "magma, 0 to 0.25"}};
    for (size_t i = 0; i < 4; ++i) {
        const Picture& picture = all->pictures[i];
        EXPECT_EQ(picture.title, expected[i].first);
        EXPECT_EQ(picture.scale, expected[i].second);
        ASSERT_GT(picture.png.size(), 33u);
        EXPECT_EQ(picture.png.substr(0, 8), "\x89PNG\r\n\x1a\n");
        EXPECT_EQ(picture.png.substr(16, 8), std::string("\0\0\0\x50\0\0\0\x28", 8));
    }
}

TEST(Pictures, LargeFramesAreCutAroundTheWorst) {
    Exhibit exhibit = exhibit_of(400, 300);
    exhibit.error.at(399, 150) = 1;
    auto all = pictured(exhibit);
    ASSERT_TRUE(all.ok());
    EXPECT_EQ(all->place, "160 x 120 pixels from 240,90 of 400 x 300");
    exhibit.error.at(399, 150) = INFINITY;  // larger than any other
    exhibit.error.at(0, 0) = 2;
    all = pictured(exhibit);
    ASSERT_TRUE(all.ok());
    EXPECT_EQ(all->place, "160 x 120 pixels from 240,90 of 400 x 300");
    EXPECT_EQ(all->pictures[3].scale, "magma, 0 to 2");
}

const KnownLimit& known_limit() {
    static const KnownLimit limit{"mirror", "", "", 10, "of a known reason"};
    return limit;
}

struct Sample {
    Matrix matrix;
    std::vector<PicturedCheck> pictures;
};

Sample sample() {
    Sample made;
    made.matrix.cells.resize(2);
    for (size_t i = 0; i < 2; ++i) {
        CellResult& cell = made.matrix.cells[i];
        cell.subject = "a<b";
        cell.row = "speed";
        cell.cell = std::string(1, char('x' + i));
        Measured one;
        one.check = i == 0 ? "mirror" : "range";
        one.verdict = i == 0 ? Verdict::limit : Verdict::failed;
        one.value = 2.5;
        one.bound = 1;
        one.note = "at 3,4";
        if (i == 0) one.limit = &known_limit();
        cell.measured = {one};
    }
    for (const CellResult& cell : made.matrix.cells) {
        auto pictures = pictured(exhibit_of(8, 4));
        EXPECT_TRUE(pictures.ok());
        pictures->cell = &cell;
        pictures->measured = &cell.measured[0];
        made.pictures.push_back(std::move(*pictures));
    }
    return made;
}

size_t count(const std::string& text, const std::string& part) {
    size_t found = 0;
    for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++found;
    return found;
}

TEST(Page, ShowsFailuresAndLimitsWithPicturesAndNothingFromElsewhere) {
    const Sample made = sample();
    const std::string page = matrix_as_page(
        made.matrix, made.pictures, {"1.2", "some device", "postchain stress --only '<x>'"});
    EXPECT_EQ(count(page, "<!--"), 0u);
    EXPECT_EQ(count(page, "<script"), 0u);
    EXPECT_EQ(count(page, "http"), 0u);
    EXPECT_EQ(count(page, "a<b"), 0u);
    EXPECT_NE(page.find("<html lang=\"en\">"), std::string::npos);
    EXPECT_NE(page.find("<h1>Stability of postchain 1.2</h1>"), std::string::npos);
    EXPECT_NE(page.find("postchain stress --only '&lt;x&gt;'"), std::string::npos);
    EXPECT_NE(page.find("<strong>1 failed</strong>"), std::string::npos);
    EXPECT_NE(page.find("<a href=\"#fail-1\">FAIL 2.5</a>"), std::string::npos);
    EXPECT_NE(page.find("<a href=\"#limit-1\">limit 2.5</a>"), std::string::npos);
    for (const char* id : {"fail-1", "limit-1", "check-mirror", "table", "main"})
        EXPECT_EQ(count(page, concat("id=\"", id, "\"")), 1u) << id;
    // Each image has its own text and is embedded, enlarged 40 times.

    EXPECT_EQ(count(page, "<img "), 8u);
    EXPECT_EQ(count(page, "alt=\""), 8u);
    EXPECT_EQ(count(page, "src=\"data:image/png;base64,"), 8u);
    EXPECT_EQ(count(page, "width=\"320\" height=\"160\""), 8u);
    EXPECT_NE(page.find("alt=\"relative error of a&lt;b/speed/y/fp32, range; magma, 0 to 0\""),
              std::string::npos);
    EXPECT_NE(page.find("image-rendering: pixelated"), std::string::npos);
    EXPECT_NE(page.find("prefers-color-scheme: dark"), std::string::npos);
}

TEST(Page, SaysWhenNothingFailed) {
    Sample made = sample();
    made.matrix.cells.pop_back();
    made.matrix.cells[0].measured[0].verdict = Verdict::ok;
    made.matrix.cells[0].measured[0].limit = nullptr;
    const std::string page = matrix_as_page(made.matrix, {}, {});
    EXPECT_NE(page.find("<h2 id=\"failures\">Failures (0)</h2>\n<p>None.</p>"), std::string::npos);
    EXPECT_NE(page.find("<p>None was met.</p>"), std::string::npos);
}

}  // namespace
}  // namespace postchain::stress
