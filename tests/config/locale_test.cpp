// Numbers read and write the same under any locale of C and C++.
//
// No locale such as de_DE needs to be installed: the test builds the C++ locale from a facet with
// decimal comma and grouping, as in std::locale("de_DE.UTF-8").
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <locale>

#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/describe.h"
#include "config/schema.h"
#include "fake_passes.h"

namespace postchain {
namespace {

using test::fake_passes;
using test::texts;
using testing::ElementsAre;
using testing::IsEmpty;

struct GermanNumbers : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

class GermanLocale : public testing::Test {
  protected:
    void SetUp() override {
        std::locale::global(std::locale(std::locale::classic(), new GermanNumbers));
        std::setlocale(LC_ALL, "de_DE.UTF-8");  // if it is installed
        std::ostringstream check;
        check << 1234.5;
        ASSERT_EQ(check.str(), "1.234,5");  // the locale is active
    }
    void TearDown() override {
        std::locale::global(std::locale::classic());
        std::setlocale(LC_ALL, "C");
    }
};

TEST_F(GermanLocale, ChainFilesMeanTheSame) {
    const std::string text =
        "postchain: 1\ncamera: {focus_distance: 1234.5}\npasses:\n  - smear: {amount: 2.5}\n";
    const ChainFile file =
        parse_chain(text, "c", fake_passes(), {"tint.gain=1", "camera.f_stop=1.4"});
    EXPECT_EQ(file.chain.camera.focus_distance, 1234.5);
    EXPECT_EQ(file.chain.camera.f_stop, 1.4);
    EXPECT_EQ(test::smear(*file.chain.links[0].pass).amount, 2.5);
    const auto written = [&] {
        return concat(write_chain(file.chain), chain_schema(fake_passes()),
                      passes_as_json(fake_passes()), file.chain.hash());
    };
    const std::string in_german = written();
    TearDown();
    EXPECT_EQ(in_german, written());
}

TEST_F(GermanLocale, DiagnosticsCountWithoutGrouping) {
    std::string text = "postchain: 1\n";
    for (int i = 0; i < 1500; ++i) text += "# comment\n";
    EXPECT_THAT(texts(parse_chain(text + "passes:\n- smear:\n    amount: 1,5\n", "c", fake_passes())
                          .diagnostics),
                ElementsAre(testing::StartsWith("c:1504:13: error: ")));
    const CameraFile camera = parse_camera(
        R"({"resolution": [1920, 1080], "focus_distance": 1234.5, "f_stop": 2.8})", "c");
    EXPECT_THAT(texts(camera.diagnostics), IsEmpty());
    EXPECT_EQ(camera.camera.focus_distance, 1234.5);
    EXPECT_THAT(camera.check_resolution({2048, 858, 1})->text(),
                testing::HasSubstr("1920x1080 is not the display size 2048x858"));
}

}  // namespace
}  // namespace postchain
