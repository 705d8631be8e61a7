// The page of the matrix: its failures and limits, and its images, decoded again.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/filled_json.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/measure/stress/page.h"
#include "tools/sequence/image/png.h"

namespace postchain::stress {
namespace {

CheckImages images_of(int width, int height) {
    CheckImages images;
    images.check = "mirror";
    images.input = ImageF(width, height, 4, 2);
    images.result = images.compared = ImageF(width, height, 4, 1);
    images.error = ImageF(width, height, 1);
    images.compared_is = "another";
    images.error_is = "relative error";
    return images;
}

// RFC 4648, section 10.
TEST(Png, Base64OfTheTestVectors) {
    for (const auto& [bytes, text] :
         {std::pair{"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foobar", "Zm9vYmFy"}})
        EXPECT_EQ(io::base64_of(bytes), text);
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
    CheckImages images = images_of(80, 40);
    images.error.at(3, 4) = 0.25f;
    const auto all = test::must(imaged(images));
    ASSERT_EQ(all.pictures.size(), 4u);
    EXPECT_EQ(all.place, "");
    const std::pair<const char*, const char*> expected[] = {{"input", "black is 0, white 2"},
                                                            {"result", "black is 0, white 1"},
                                                            {"another", "black is 0, white 1"},
                                                            {"relative error", "magma, 0 to 0.25"}};
    for (size_t i = 0; i < 4; ++i) {
        const Picture& picture = all.pictures[i];
        EXPECT_EQ(picture.title, expected[i].first);
        EXPECT_EQ(picture.scale, expected[i].second);
        ASSERT_GT(picture.png.size(), 33u);
        EXPECT_EQ(picture.png.substr(0, 8), "\x89PNG\r\n\x1a\n");
        EXPECT_EQ(picture.png.substr(16, 8), std::string("\0\0\0\x50\0\0\0\x28", 8));
    }
}

TEST(Pictures, LargeFramesAreCutAroundTheWorst) {
    CheckImages images = images_of(400, 300);
    for (const float worst : {3.0f, INFINITY}) {  // infinity is larger than any other
        images.error.at(399, 150) = worst;
        images.error.at(0, 0) = 2;
        const auto all = test::must(imaged(images));
        EXPECT_EQ(all.place, "160 x 120 pixels from 240,90 of 400 x 300");
        EXPECT_EQ(all.pictures[3].scale, worst > 3 ? "magma, 0 to 2" : "magma, 0 to 3");
    }
}

const KnownLimit& known_limit() {
    static const KnownLimit limit{"mirror", "", "", 10, "of a known reason"};
    return limit;
}

// One cell within a known limit, and one that failed.
Matrix sample() {
    Matrix made;
    made.cells.resize(2);
    for (size_t i = 0; i < 2; ++i) {
        CellResult& cell = made.cells[i];
        cell.subject = "a<b";
        cell.row = "speed";
        cell.cell = std::string(1, char('x' + i));
    }
    made.cells[0].measured = {{"mirror", Verdict::limit, 2.5, 1, "at 3,4"},
                              {"reference", Verdict::ok, 0.125, 0.25, ""}};
    made.cells[0].measured[0].limit = &known_limit();
    made.cells[1].measured = {{"range", Verdict::failed, 3.5, 1.5, "at 5,6"}};
    made.cells[1].precision = Precision::fp16;
    return made;
}

// The data inside the page.
nlohmann::json data_of(const std::string& page) {
    const std::string start = "<script type=\"application/json\" id=\"data\">";
    const size_t from = page.find(start) + start.size();
    return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST(Page, HoldsFailuresAndLimitsWithTheirPictures) {
    const Matrix matrix = sample();
    std::vector<ImagedCheck> checks_with_images;
    for (const CellResult& cell : matrix.cells) {
        ImagedCheck one = test::must(imaged(images_of(8, 4)));
        one.cell = &cell;
        one.measured = &cell.measured[0];
        checks_with_images.push_back(std::move(one));
    }
    const std::string page = matrix_as_page(
        matrix, checks_with_images, {"1.2", "some device", "postchain stress --only '<x>'"});
    // No name becomes a part of the HTML.
    EXPECT_EQ(page.find("a<b"), std::string::npos);
    EXPECT_EQ(page.find("<x>"), std::string::npos);
    auto data = data_of(page);
    for (const char* list : {"failures", "limits"})
        for (auto& picture : data[list][0]["pictures"])
            picture["png"] = std::string(picture["png"]).substr(0, 11);  // \x89PNG...
    test::expect_text_of(POSTCHAIN_SOURCE_DIR "/tests/measure/stress/expected.page",
                         test::filled_json(data) + "\n" + matrix_as_text(matrix));
}

}  // namespace
}  // namespace postchain::stress
