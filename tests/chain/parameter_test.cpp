#include "chain/base/parameter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

#include "chain/base/printable.h"
#include "chain/base/text.h"
#include "chain/frame/frame.h"

namespace postchain {
namespace {

enum class Mode { slow, fast };

struct Parameters {
    int samples = 25;
    double softness = 1;
    bool tiles = true;
    Mode mode = Mode::fast;
    std::optional<double> shutter;
    std::optional<double> angle;
    int preset = 12;
};

const ParameterTable& table() {
    static const ParameterTable made =
        ParameterTableBuilder<Parameters>()
            .integer("samples", &Parameters::samples,
                     {.min = 1, .max = 255, .odd = true, .unit = "taps", .help = "taps"})
            .number("softness", &Parameters::softness, {.min = 0, .min_excluded = true})
            .boolean("tiles", &Parameters::tiles, {})
            .choice("mode", &Parameters::mode, {"slow", "fast"}, {})
            .number("shutter", &Parameters::shutter, {.min = 0, .max = 4, .excludes = "angle"})
            .number("angle", &Parameters::angle, {.min = 0, .max = 1440})
            .integer("preset", &Parameters::preset, {.allowed = {10, 12, 39}})
            .table();
    return made;
}

TEST(Parameter, BadValuesAreRefusedWithTheirDomain) {
    const std::tuple<const char*, ParameterValue, const char*> cases[] = {
        {"samples", int64_t(24), "24 is even; samples is an odd integer in 1..255 (taps)"},
        {"samples", int64_t(257), "257 is out of range"},
        {"samples", 25.0, "25 is a number"},
        {"softness", 0.0, "0 is out of range; softness is a number > 0"},
        {"softness", std::string("1"), "1 is a word"},
        {"softness", std::numeric_limits<double>::infinity(), "not finite"},
        {"softness", std::numeric_limits<double>::quiet_NaN(), "not finite"},
        {"softness", std::monostate(), "no value"},
        {"tiles", int64_t(1), "1 is an integer; tiles is true or false"},
        {"preset", int64_t(11), "11 is not among them; preset is one of 10, 12, 39"},
        {"mode", std::string("fats"),
         "'fats' is not known (did you mean 'fast'?); mode is one of slow, fast"},
        {"sampels", int64_t(9), "unknown key 'sampels' (did you mean 'samples'?)"}};
    for (const auto& [key, value, message] : cases) {
        Parameters parameters;
        EXPECT_THAT(table().set(&parameters, key, value).message(), ::testing::HasSubstr(message));
        const Parameters before;
        EXPECT_EQ(table().text(&parameters), table().text(&before)) << message << ": was stored";
    }
}

TEST(Parameter, GoodValuesAreStored) {
    Parameters p;
    const std::pair<const char*, ParameterValue> cases[] = {
        {"samples", int64_t(1)},  {"samples", int64_t(255)}, {"softness", 1e-9},
        {"softness", int64_t(2)}, {"shutter", 0.5},          {"shutter", std::monostate()}};
    for (const auto& [key, value] : cases) {
        EXPECT_TRUE(table().set(&p, key, value).ok()) << key;
        EXPECT_EQ(text_of(table().find(key)->get(&p)), text_of(value)) << key;
    }
    EXPECT_EQ(table().text(&p),
              "samples=255 softness=2 tiles=true mode=fast shutter=unset angle=unset preset=12");
}

TEST(Parameter, ExclusiveKeysAreFoundOut) {
    Parameters p;
    p.shutter = 0.5;
    EXPECT_TRUE(table().check(&p).ok());
    p.angle = 180;
    EXPECT_EQ(table().check(&p).message(), "shutter and angle are both given; give one of them");
}

TEST(Parameter, TextIsCanonical) {
    EXPECT_EQ(text_of(ParameterValue(0.1)), "0.1");
    EXPECT_EQ(text_of(ParameterValue(1e300)), "1e+300");
    EXPECT_EQ(text_of(ParameterValue(1.0 / 3)), "0.3333333333333333");
}

// Control characters of both sets, and what Unicode's bidirectional algorithm and line separators
// are steered by.
bool steers(uint32_t c) {
    constexpr std::pair<uint32_t, uint32_t> kRanges[] = {
        {0, 0x1f},        {0x7f, 0x9f},     {0x61c, 0x61c},  {0x200e, 0x200f},
        {0x2028, 0x202e}, {0x2066, 0x2069}, {0xfeff, 0xfeff}};
    return std::ranges::any_of(
        kRanges, [&](const auto& range) { return c >= range.first && c <= range.second; });
}

TEST(Text, NoPrintedCharacterActsOnATerminal) {
    for (uint32_t c = 1; c < 0x10000; ++c) {
        if (c >= 0xd800 && c < 0xe000) continue;  // surrogates are no characters
        std::string text;
        if (c < 0x80)
            text = {char(c)};
        else if (c < 0x800)
            text = {char(0xc0 | c >> 6), char(0x80 | (c & 0x3f))};
        else
            text = {char(0xe0 | c >> 12), char(0x80 | (c >> 6 & 0x3f)), char(0x80 | (c & 0x3f))};
        char escaped[16] = "";
        std::snprintf(escaped, sizeof(escaped), c < 0x80 ? "\\x%02x" : "\\u{%x}", c);
        const std::string expected = c == '\n'   ? "\\n"
                                     : c == '\t' ? "\\t"
                                     : steers(c) ? escaped
                                                 : text;
        ASSERT_EQ(printable("a" + text + "b"), "a" + expected + "b") << c;
    }
    EXPECT_EQ(printable("a\xff\xc3"), "a\\xff\\xc3") << "no UTF-8";
    EXPECT_EQ(printable("a\n\tb\x1b", Lines::keep), "a\n\tb\\x1b");
}

TEST(Text, QuotesWhatJsonDemands) {
    EXPECT_EQ(quoted("a\"b\\c\n\x01"), "\"a\\\"b\\\\c\\n\\u0001\"");
    // Also characters that act on a terminal (DEL, C1, right-to-left), and bytes that are not
    // UTF-8.
    EXPECT_EQ(quoted("\x7f\xc2\x9b\xe2\x80\xae"), "\"\\u007f\\u009b\\u202e\"");
    EXPECT_EQ(quoted("a\xff\xc3"), "\"a\\ufffd\\ufffd\"");
    // Overlong, a surrogate, above U+10FFFF; the last code point.
    for (const char* bad : {"\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"}) {
        std::string faults;
        for (const char* at = bad; *at != 0; ++at) faults += "\\ufffd";
        EXPECT_EQ(quoted(bad), '"' + faults + '"');
    }
    EXPECT_EQ(quoted("\xf4\x8f\xbf\xbf"), "\"\xf4\x8f\xbf\xbf\"");
    EXPECT_EQ(quoted("gr\xc3\xbcn"), "\"gr\xc3\xbcn\"");
    EXPECT_EQ(joined({"a", "b", "c"}), "a, b, c");
    EXPECT_EQ(joined({}, " "), "");
}

// FNV-1a test vectors of the algorithm's authors (64 bit).
TEST(Hash, IsFnv1a) {
    EXPECT_EQ(hash_text(""), 0xcbf29ce484222325ull);
    EXPECT_EQ(hash_text("a"), 0xaf63dc4c8601ec8cull);
    EXPECT_EQ(hash_text("foobar"), 0x85944171f73967e8ull);
    EXPECT_EQ(hex_of(0x85944171f73967e8ull), "85944171f73967e8");
}

TEST(Camera, OverlayTakesOnlyWhatIsSet) {
    Camera under, over;
    under.f_stop = 2;
    under.focal_length_mm = 50;
    over.f_stop = 4;
    const Camera result = under.overlaid_by(over);
    EXPECT_EQ(result.f_stop, 4);
    EXPECT_EQ(result.focal_length_mm, 50);
    EXPECT_FALSE(result.focus_distance.has_value());
    // Every row of the table must take part: a member that is forgotten is a value that is lost.
    for (const auto& row : camera_parameters().rows()) {
        Camera one;
        row.set(&one, row.type == ParameterType::text     ? ParameterValue("three")
                      : row.type == ParameterType::choice ? ParameterValue(row.choices.back())
                                                          : ParameterValue(int64_t(3)));
        EXPECT_NE(row.get(&one), ParameterValue()) << row.key;
        EXPECT_EQ(row.get(&one), row.get(&static_cast<const Camera&>(Camera().overlaid_by(one))))
            << row.key;
    }
}

// It is in meters: the unit that is stated last makes it a distance.
TEST(Camera, AnyOtherFocusReplacesThatOfTheMetadata) {
    Camera metadata, unit, own;
    metadata.focus_distance = metadata.metadata_focus_m = 2;
    unit.meters_per_unit = 0.5;
    own.focus_distance = 7;
    EXPECT_EQ(metadata.overlaid_by(unit).focus_distance, 4);
    EXPECT_EQ(metadata.overlaid_by(own).focus_distance, 7);
    EXPECT_EQ(metadata.overlaid_by(own).overlaid_by(unit).focus_distance, 7);
    EXPECT_EQ(own.overlaid_by(metadata).overlaid_by(unit).focus_distance, 4);
}

struct Words {
    std::string name;
    std::string folder = "out";
    Parameters inner;
};

TEST(Parameter, TextsAreUnsetWhenEmpty) {
    const ParameterTable words = ParameterTableBuilder<Words>()
                                     .text("name", &Words::name, {.unit = "NAME"})
                                     .text("folder", &Words::folder, {.required = true})
                                     .table();
    Words w;
    EXPECT_EQ(words.text(&w), "name=unset folder=out");
    EXPECT_TRUE(words.set(&w, "name", std::string("shot")).ok());
    EXPECT_EQ(w.name, "shot");
    EXPECT_EQ(words.set(&w, "name", std::string()).message(), "is empty; name is a text (NAME)");
    EXPECT_EQ(words.set(&w, "name", int64_t(4)).message(),
              "4 is an integer; name is a text (NAME)");
    EXPECT_TRUE(words.set(&w, "name", ParameterValue()).ok());
    EXPECT_EQ(w.name, "");
    EXPECT_EQ(words.set(&w, "folder", ParameterValue()).message(), "no value; folder is a text");
}

TEST(Parameter, SaysItsRange) {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    for (const auto& [min, max, above, said] : {std::tuple(-kNone, kNone, false, "a number"),
                                                {-kNone, 5.0, false, "a number <= 5"},
                                                {0.0, kNone, true, "a number > 0"},
                                                {0.0, 5.0, true, "a number > 0 and <= 5"},
                                                {0.0, 5.0, false, "a number in 0..5"}}) {
        Parameter row;
        row.type = ParameterType::number;
        row.min = min;
        row.max = max;
        row.min_excluded = above;
        EXPECT_EQ(row.domain(), said);
    }
}

TEST(Parameter, ATableTakesTheRowsOfAMember) {
    const ParameterTable words = ParameterTableBuilder<Words>()
                                     .text("name", &Words::name, {})
                                     .rows(&Words::inner, table())
                                     .table();
    Words w;
    EXPECT_EQ(words.rows().size(), 1 + table().rows().size());
    EXPECT_TRUE(words.set(&w, "samples", int64_t(51)).ok());
    EXPECT_EQ(w.inner.samples, 51);
    EXPECT_EQ(words.find("samples")->get(&w), ParameterValue(int64_t(51)));
    EXPECT_EQ(words.find("samples")->default_value, ParameterValue(int64_t(25)));
}

}  // namespace
}  // namespace postchain
