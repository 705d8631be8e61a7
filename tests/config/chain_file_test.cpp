#include "config/chain_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/chain_find.h"
#include "fake_passes.h"
#include "passes/registry.h"
#include "schema_check.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain::chain_file_test {
namespace {

using test::fake_passes;
using test::must;
using test::places;
using test::smear;
using test::texts;
using test::tint;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

ChainFile parse(const std::string& text) {
    return parse_chain(text, "c.yaml", fake_passes());
}
std::vector<std::string> errors_of(const std::string& text) {
    return texts(parse(text).diagnostics);
}
// A chain of one pass given by `entry`.
std::string chain_of(const std::string& entry) {
    return "postchain: 1\npasses:\n  - " + entry + "\n";
}

constexpr const char* kYaml = R"(postchain: 1
camera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.8, focus_distance: 4.2}
passes:                       # comment
  - smear: {mode: narrow, samples: 51, amount: 2, dither: false}
  - tint
  - smear:
      factor: 2
      shutter_angle_deg: 90
)";

TEST(ChainFile, ReadsPassesInOrder) {
    const ChainFile file = parse(kYaml);
    ASSERT_THAT(texts(file.diagnostics), IsEmpty());
    ASSERT_EQ(file.chain.links.size(), 3u);
    const test::Smear first = smear(*file.chain.links[0].pass),
                      last = smear(*file.chain.links[2].pass);
    EXPECT_EQ(first.mode, test::SmearMode::narrow);
    EXPECT_EQ(first.samples, 51);
    EXPECT_EQ(file.chain.origins.at("passes[0].samples").where, "c.yaml:4");
    EXPECT_EQ(first.amount, 2.0);
    EXPECT_FALSE(first.dither);
    EXPECT_EQ(tint(*file.chain.links[1].pass).gain, 1.0);
    EXPECT_EQ(last.factor, 2);
    EXPECT_EQ(last.samples, 25);
    EXPECT_EQ(last.shutter_angle_deg, 90.0);
    EXPECT_EQ(file.chain.camera.f_stop, 1.8);
    EXPECT_EQ(file.chain.camera.near_clip, std::nullopt);
    const ChainFile json = parse(R"({"postchain": 1,
        "camera": {"focal_length_mm": 50, "sensor_width_mm": 36.0, "f_stop": 1.8,
                   "focus_distance": 4.2},
        "passes": [{"smear": {"mode": "narrow", "samples": 51, "amount": 2.0, "dither": false}},
                   "tint", {"smear": {"factor": 2, "shutter_angle_deg": 90}}]})");
    ASSERT_THAT(texts(json.diagnostics), IsEmpty());
    EXPECT_EQ(json.chain.text(), file.chain.text());
    EXPECT_EQ(json.chain.hash(), file.chain.hash());
}

TEST(ChainFile, HasAtMost64Passes) {
    std::string text = "postchain: 1\npasses:\n";
    for (int i = 0; i < 64; ++i) text += "  - tint\n";
    EXPECT_THAT(errors_of(text), IsEmpty());
    EXPECT_THAT(
        errors_of(text + "  - tint\n"),
        ElementsAre(HasSubstr("c.yaml:67:5: error: passes: 65 passes; a chain has at most")));
}

TEST(ChainFile, AParameterThatTheModeDoesNotReadIsAnError) {
    EXPECT_THAT(errors_of(chain_of("smear: {mode: narrow, factor: 2}")),
                ElementsAre("c.yaml:3:27: error: passes[0].factor: has no effect with mode: "
                            "narrow; remove it, or set mode: wide"));
    // By the mode, wherever it stands; a value of null is none.
    EXPECT_THAT(errors_of(chain_of("smear: {factor: 2, mode: narrow}")),
                testing::Contains(HasSubstr("has no effect with mode: narrow")));
    EXPECT_THAT(errors_of(chain_of("smear: {mode: wide, factor: 2}")), IsEmpty());
    const ChainFile paper =
        parse_chain(chain_of("depth_of_field: {method: gilham, samples: 8, aperture_blades: null}"),
                    "c.yaml", builtin_passes());
    EXPECT_THAT(texts(paper.diagnostics),
                ElementsAre(HasSubstr("passes[0].samples: has no effect with method: gilham")));
}

// Not of its text and hash, which identify what made a frame, and not of the written file.
TEST(ChainFile, AnUnreadValueIsNotPartOfTheChain) {
    const std::string text = chain_of("smear: {mode: narrow}");
    const ChainFile one = parse(text),
                    other = parse_chain(text, "c.yaml", fake_passes(), {"smear.factor=2"});
    EXPECT_EQ(smear(*other.chain.links[0].pass).factor, 2);
    EXPECT_EQ(one.chain.hash(), other.chain.hash());
    EXPECT_EQ(one.chain.text().find("factor"), std::string::npos);
    EXPECT_EQ(write_chain(other.chain), write_chain(one.chain));
}

// A chain file and the place of its only error.
struct Refused {
    std::string text;
    std::string place;
};

std::vector<Refused> refused_files() {
    std::vector<Refused> all = {
        {"passes: []\n", "1:1 error postchain"},
        {"postchain: 1\npasses: smear\n", "2:9 error passes"},
        {"postchain: 1\npasses: {smear: {}}\n", "2:9 error passes"},
        {"postchain: 1\npasses:\n", "2:8 error passes"},
        {"postchain: 1\ncamera: [50]\npasses: []\n", "2:9 error camera"},
        {"postchain: 1\ncamera: {f_stop: 0}\npasses: []\n", "2:18 error camera.f_stop"},
        {"postchain: 1\npasses: []\ncamera: {fstop: 2}\n", "3:10 error camera.fstop"},
        {"postchain: 1\npasses: []\ncamera: {f_stop: '2'}\n", "3:18 error camera.f_stop"},
        {"postchain: 1\npasses: []\ncamera: {aperture_image: 3}\n",
         "3:26 error camera.aperture_image"},
        {"postchain: 1\npasses: []\ncamera: {aperture_image: a.png, aperture_blades: 5}\n",
         "3:9 error camera"},
        {"postchain: 1\npasses: []\nextra: 1\n", "3:1 error extra"},
        {chain_of("smear: {mode: narrow, factor: 2}"), "3:27 error passes[0].factor"},
        {"- smear\n", "1:1 error "},
        {"just words\n", "1:1 error "},
        {chain_of("smeer"), "3:5 error passes[0]"},
        {chain_of("smear: {}\n    tint: {}"), "4:5 error passes[0]"},
        // The most common mistake of indentation.
        {chain_of("smear:\n    samples: 25"), "4:5 error passes[0]"},
        {chain_of("smear: 3"), "3:12 error passes[0]"},
        {chain_of("smear: [1]"), "3:12 error passes[0]"},
        {chain_of("null"), "3:5 error passes[0]"},
        {chain_of("[smear]"), "3:5 error passes[0]"},
        {chain_of("{}"), "3:5 error passes[0]"},
        {chain_of(""), "3:4 error passes[0]"},
        {chain_of("tint: {gain: 0}"), "3:18 error passes[0].gain"},
        {chain_of("smear: {sampels: 25}"), "3:13 error passes[0].sampels"},
        {chain_of("smear: {shutter_frames: 0.5, shutter_angle_deg: 180}"), "3:12 error passes[0]"}};
    for (const char* version : {"2", "0", "'1'", "one", "true", "[1]", ""})
        all.push_back({concat("postchain: ", version, "\npasses: []\n"), "error postchain"});
    for (const auto& [key, values] : std::map<std::string, std::vector<const char*>>{
             {"samples", {"many", "24", "257", "0", "'25'", "true", "[25]", "{a: 1}", ""}},
             {"dither", {"yes", "1"}},
             {"amount",
              {"much", "-0.5", ".inf", "-.inf", ".nan", "1e999", "0x5", "0o5", "05", "1_0"}},
             {"factor", {"3"}},
             {"middle", {"0.5", "[0.5]", "[0.5, [1]]", "[0.5, 1.5]"}},
             {"mode", {"3", "narow"}}})
        for (const char* value : values)
            all.push_back(
                {chain_of("smear: {" + key + ": " + value + "}"), "error passes[0]." + key});
    return all;
}

TEST(ChainFile, PlacesEachError) {
    const test::ChainSchema schema(fake_passes());
    for (const Refused& refused : refused_files()) {
        const ChainFile file = parse(refused.text);
        EXPECT_THAT(places(file.diagnostics), ElementsAre(testing::EndsWith(refused.place)))
            << refused.text << text_of(file.diagnostics);
        EXPECT_EQ(file.status().code(), StatusCode::chain) << refused.text;
        EXPECT_NE(schema.violation(refused.text), "") << refused.text;
    }
    // JSON Schema takes 1.0 for a whole number.
    for (const std::string& text :
         {std::string("postchain: 1.0\npasses: []\n"), chain_of("smear: {samples: 25.0}")})
        EXPECT_EQ(parse(text).status().code(), StatusCode::chain) << text;
}

TEST(ChainFile, SaysWhatIsWrongAndTheNearestWord) {
    const std::pair<std::string, const char*> cases[] = {
        {"samples: 24", "24 is even; samples is an odd integer in 1..255"},
        {"samples: '25'", "samples is an odd integer in 1..255"},
        {"amount: -0.5", "-0.5 is out of range; amount is a number in 0..10"},
        {"factor: 3", "3 is not among them; factor is one of 1, 2, 4"},
        {"middle: 0.5", "middle is two numbers [x, y], each in 0..1"},
        {"middle: [0.5, [0.5, 1]]", "is not a number"},
        {"middle: [0.5, 0.5, 0.5]", "a list is two numbers, [x, y]"},
        {"sampels: 25", "unknown key 'sampels' (did you mean 'samples'?)"},
        {"zzzzzz: 1", "known are mode, samples, amount"},
        {"mode: narow", "did you mean 'narrow'?"},
        {"samples: 51, samples: 25", "duplicate key 'samples'"},
        {"shutter_frames: 1, shutter_angle_deg: 90", "are both given; give one of them"},
        {"tap: 51", "unknown key"}};
    for (const auto& [text, why] : cases)
        EXPECT_THAT(errors_of(chain_of("smear: {" + text + "}")),
                    testing::Contains(HasSubstr(why)));
    EXPECT_THAT(errors_of(chain_of("smeer")),
                ElementsAre(HasSubstr("unknown pass 'smeer' (did you mean 'smear'?)")));
    EXPECT_THAT(errors_of("postchain: 1\npases: []\n"),
                ElementsAre(HasSubstr("passes: missing"), HasSubstr("did you mean 'passes'?")));
}

TEST(ChainFile, ReportsAllErrorsAtOnce) {
    const ChainFile file = parse(
        "postchain: 2\ncamera: {f_stop: -1}\npasses:\n  - smear: {samples: 24, sampels: 3}\n"
        "  - blur\n  - tint: {gain: &a 2}\nextra: 1\nextra: 2\n");
    EXPECT_THAT(places(file.diagnostics),
                ElementsAre("1:12 error postchain", "2:18 error camera.f_stop",
                            "4:22 error passes[0].samples", "4:26 error passes[0].sampels",
                            "5:5 error passes[1]", "6:18 error ", "7:1 error extra", "8:1 error "));
    EXPECT_EQ(file.status().code(), StatusCode::chain);
    EXPECT_THAT(file.status().message(), HasSubstr("passes[0].sampels"));
}

TEST(ChainFile, EmptyAndGarbageFilesAreInvalidChains) {
    for (const char* text : {"", "\xff\xfe", "[", "&a b", "\t", "{\"postchain\": 1"}) {
        const ChainFile file = parse(text);
        EXPECT_EQ(file.status().code(), StatusCode::chain) << text;
        EXPECT_THAT(file.status().message(), testing::StartsWith("c.yaml:1:"));
    }
    EXPECT_EQ(parse(std::string(size_t(1) << 20, '[')).status().code(), StatusCode::chain);
}

TEST(WriteChain, ReadsBackAsTheSameChain) {
    for (const std::string& text :
         {std::string(kYaml), std::string("postchain: 1\npasses: []\n"),
          chain_of("tint: {limit: null}"), chain_of("tint: {gain: 0.1, limit: 99.99999999999999}"),
          chain_of("smear: {amount: 1e-300, shutter_frames: 0.5}"),
          chain_of("smear: {middle: [0, 0.30000000000000004]}")}) {
        const ChainFile file = parse(text);
        ASSERT_THAT(texts(file.diagnostics), IsEmpty());
        const std::string written = write_chain(file.chain);
        const ChainFile again = parse(written);
        EXPECT_THAT(texts(again.diagnostics), IsEmpty()) << written;
        EXPECT_EQ(again.chain.text(), file.chain.text()) << written;
        EXPECT_EQ(again.chain.hash(), file.chain.hash());
    }
    EXPECT_EQ(write_chain(parse(chain_of("tint: {limit: null}")).chain),
              "postchain: 1\npasses:\n  - tint:\n      gain: 1\n      limit: null\n");
}

TEST(FindChain, PrefersShippedNamesAndReadsFiles) {
    const test::TempFolder folder;
    test::write_text(folder.path("mine.yaml"), chain_of("tint"));
    const auto found = must(find_chain(folder.path("mine.yaml")));
    EXPECT_EQ(found.text, chain_of("tint"));
    EXPECT_FALSE(found.shipped);
    EXPECT_EQ(must(load_chain(folder.path("mine.yaml"), fake_passes())).chain.links.size(), 1u);
    EXPECT_THAT(test::error_of(load_chain(folder.path("mine.yaml/a.yaml"), fake_passes())),
                HasSubstr("mine.yaml/a.yaml: cannot be opened: Not a directory"));
    EXPECT_TRUE(must(find_chain("paper")).shipped);

    const Status missing = find_chain("papr").status();
    EXPECT_EQ(missing.code(), StatusCode::chain);
    EXPECT_THAT(missing.message(), HasSubstr("balanced, best, dof_first, fast, paper"));
    EXPECT_THAT(missing.message(), HasSubstr("did you mean 'paper'?"));
    for (const std::string& name :
         {folder.path(), std::string("/nowhere/paper.yaml"), std::string()})
        EXPECT_FALSE(find_chain(name).ok()) << name;
}

TEST(ChainFile, NamesThePictureOfTheAperture) {
    const std::string text = "postchain: 1\ncamera: {aperture_image: pictures/a.png}\npasses: []\n";
    const ChainFile file = parse_chain(text, "/shot/chain.yaml", fake_passes());
    ASSERT_THAT(texts(file.diagnostics), IsEmpty());
    EXPECT_EQ(file.chain.camera.aperture_image, BokehKernel("/shot/pictures/a.png"));
    // Written to another folder it is the same chain.
    const ChainFile again = parse_chain(write_chain(file.chain), "/out/w.yaml", fake_passes());
    EXPECT_EQ(again.chain.camera, file.chain.camera);
    EXPECT_EQ(again.chain.hash(), file.chain.hash());
}

}  // namespace
}  // namespace postchain::chain_file_test
