#include "config/schema.h"
#include "config/describe.h"
#include "config/scalar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "config/chain_file.h"
#include "config/embedded.h"
#include "fake_passes.h"
#include "passes/registry.h"
#include "schema_check.h"

namespace postchain {
namespace {

using test::fake_passes;
using test::tree_of;
using testing::HasSubstr;

// Whether a chain file is valid, for which schema and parser must agree.
class Judges {
  public:
    explicit Judges(const PassRegistry& passes) : passes_(passes), schema_(passes) {}
    bool accept(const std::string& text) const {
        const ChainFile file = parse_chain(text, "t", passes_);
        const std::string violation = schema_.violation(text);
        EXPECT_EQ(violation.empty(), file.status().ok())
            << text << violation << text_of(file.diagnostics);
        return file.status().ok();
    }

  private:
    const PassRegistry& passes_;
    test::ChainSchema schema_;
};

// ChainFile.PlacesEachError has what both refuse.
TEST(Schema, AgreesWithTheParser) {
    const Judges judges(fake_passes());
    for (const char* good :
         {"passes: []", "passes: [smear, tint, smear]", "passes: [smear: ]",
          "passes: [{smear: {}}]", "passes: [{smear: {amount: 10.0, mode: narrow}}]",
          "passes: [{smear: {factor: 4, dither: true}}]", "passes: [{tint: {limit: null}}]",
          "passes: [{smear: {shutter_angle_deg: 1, shutter_frames: null}}]",
          "passes: []\ncamera: {f_stop: 1.8, near_clip: 0}", "passes: []\ncamera: {f_stop: null}",
          "passes: []\ncamera: {}", "passes: []\ncamera: {aperture_image: a.png}",
          "passes: []\ncamera: {aperture_image: null}",
          "passes: []\ncamera: {aperture_image: a.png, aperture_blades: null}"})
        EXPECT_TRUE(judges.accept(concat("postchain: 1\n", good, "\n"))) << good;
    for (const auto& file : embedded_config())
        if (file.path.starts_with("chains/")) {
            EXPECT_TRUE(Judges(builtin_passes()).accept(std::string(file.text))) << file.path;
        }
}

// Every row at the ends of its range and just outside.
TEST(Schema, AgreesWithTheParserAtTheEndsOfEveryRange) {
    size_t checked = 0;
    for (const PassRegistry* passes : {&builtin_passes(), &fake_passes()}) {
        const Judges judges(*passes);
        for (const auto& type : passes->types()) {
            for (const auto& row : type.parameters->rows()) {
                std::vector<std::string> values = {
                    "true", "word",       "1",      "0",          "2",     "-1",        "0.5",
                    "null", "1000000000", "[0, 1]", "[0.5, 1.5]", "[0.5]", "[0, 0, 0]", "[a, 1]"};
                for (double end : {row.min, row.max})
                    if (std::isfinite(end))
                        for (double step : {-1.0, 0.0, 1.0})
                            values.push_back(text_of(ParameterValue(end + step)));
                for (const auto& word : row.choices) values.push_back(word);
                for (int64_t number : row.allowed) values.push_back(std::to_string(number));
                for (const auto& value : values)
                    judges.accept(concat("postchain: 1\npasses:\n  - ", type.name, ": {", row.key,
                                         ": ", value, "}\n"));
                checked += values.size();
            }
        }
    }
    EXPECT_GT(checked, 300u);
}

// Whether one row of a pair names the other, or both do.
TEST(Schema, RefusesPairsThatExcludeEachOther) {
    const test::ChainSchema schema(builtin_passes());
    const auto accepts = [&](const std::string& values) {
        const std::string pass = "postchain: 1\npasses: [{motion_blur: {" + values + "}}]\n";
        const std::string camera =
            "postchain: 1\ncamera: {" + values + "}\npasses: [motion_blur]\n";
        const bool of_camera = values.starts_with("aperture");
        return schema.violation(of_camera ? camera : pass).empty();
    };
    for (const auto& [one, other] : {std::pair("shutter_frames: 0.5", "shutter_angle_deg: 180"),
                                     {"aperture_image: a.png", "aperture_blades: 5"}}) {
        EXPECT_TRUE(accepts(one)) << one;
        EXPECT_TRUE(accepts(other)) << other;
        EXPECT_FALSE(accepts(concat(one, ", ", other))) << one;
        EXPECT_FALSE(accepts(concat(other, ", ", one))) << other;
    }
}

TEST(Schema, SaysTypesRangesAndDefaults) {
    const TextNode schema = tree_of(chain_schema(fake_passes()));
    EXPECT_EQ(schema.find("$schema")->text, "https://json-schema.org/draft/2020-12/schema");
    const TextNode& rows = *schema.find("$defs")->find("pass.smear")->find("properties");
    const TextNode& samples = *rows.find("samples");
    EXPECT_EQ(samples.find("type")->text, "integer");
    EXPECT_EQ(samples.find("minimum")->text, "1");
    EXPECT_EQ(samples.find("maximum")->text, "255");
    EXPECT_EQ(samples.find("default")->text, "25");
    EXPECT_EQ(samples.find("not")->find("multipleOf")->text, "2");
    EXPECT_THAT(rows.find("shutter_frames")->find("description")->text, HasSubstr("frames"));
    EXPECT_EQ(rows.find("mode")->find("enum")->items[1].text, "narrow");
    EXPECT_EQ(rows.find("mode")->find("default")->text, "wide");
    // JSON Schema has no empty allOf.
    EXPECT_TRUE(schema.find("$defs")->find("pass.smear")->find("allOf"));
    EXPECT_FALSE(schema.find("$defs")->find("pass.tint")->find("allOf"));
}

TEST(Schema, LetsAnOptionalChoiceBeNull) {
    Parameter row;
    row.key = "shape";
    row.type = ParameterType::choice;
    row.choices = {"disc", "hexagon"};
    row.optional = true;
    const ParameterTable table({row});
    const PassRegistry registry({{"lens", "Lens", "Lens.", &table, {}}});
    const test::ChainSchema schema(registry);
    for (const auto& [value, good] : {std::pair("disc", true), {"null", true}, {"square", false}})
        EXPECT_EQ(schema.violation(
                      concat("postchain: 1\npasses: [{lens: {shape: ", value, "}}]\n")) == "",
                  good)
            << value;
}

TEST(Describe, NamesEveryParameterAndRule) {
    const std::string text = passes_as_text(builtin_passes());
    const std::string markdown = passes_as_markdown(builtin_passes());
    const std::string line = passes_as_json(builtin_passes());
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const TextNode json = tree_of(line);
    ASSERT_EQ(json.find("passes")->items.size(), builtin_passes().types().size());
    for (size_t p = 0; p < builtin_passes().types().size(); ++p) {
        const PassType& type = builtin_passes().types()[p];
        const TextNode& pass = json.find("passes")->items[p];
        EXPECT_EQ(pass.find("name")->text, type.name);
        EXPECT_EQ(pass.find("rules")->items.size(), type.rules.size());
        for (size_t i = 0; i < type.parameters->rows().size(); ++i) {
            const Parameter& row = type.parameters->rows()[i];
            EXPECT_THAT(text, HasSubstr("  " + row.key + " "));
            EXPECT_THAT(markdown, HasSubstr("| `" + row.key + "` | "));
            const TextNode& entry = pass.find("parameters")->items[i];
            EXPECT_EQ(entry.find("key")->text, row.key);
            EXPECT_EQ(entry.find("unit")->text, row.unit);
            EXPECT_EQ(entry.find("type")->text, name_of(row.type));
            for (const auto& [key, value] :
                 {std::pair("excludes", row.excludes), {"unset_means", row.unset_means}})
                EXPECT_EQ(entry.find(key) ? entry.find(key)->text : "", value);
            EXPECT_EQ(*value_of(*entry.find("default")),
                      *value_of(tree_of("a: " + yaml_text_of(row.default_value)).entries[0].value));
        }
    }
    EXPECT_EQ(json.find("camera")->items.size(), camera_parameters().rows().size());
    EXPECT_EQ(text.find("not together with \n"), std::string::npos);
    std::set<std::string> names;
    for (const auto& rule : elision_rules(builtin_passes())) {
        EXPECT_TRUE(names.insert(rule.name).second) << rule.name << " is declared twice";
        EXPECT_FALSE(rule.help.empty()) << rule.name;
        EXPECT_THAT(text, HasSubstr("  " + rule.name + " ("));
        EXPECT_THAT(markdown, HasSubstr("| `" + rule.name + "` | "));
    }
}

TEST(Describe, WritesOneRowAsTextAndMarkdown) {
    const std::string text = passes_as_text(fake_passes());
    EXPECT_THAT(text, HasSubstr("  samples            an odd integer in 1..255; default 25\n"));
    EXPECT_THAT(text, HasSubstr("  shutter_frames     a number in 0..4 (frames); default unset\n"));
    const std::string markdown = passes_as_markdown(fake_passes());
    for (const char* line : {"| `amount` | 0..10 | 1.5 | how much \\| at most |\n",
                             "| `samples` | odd integer in 1..255 | 25 |",
                             "| `shutter_frames` | 0..4 frames | unset |"})
        EXPECT_THAT(markdown, HasSubstr(line));
}

}  // namespace
}  // namespace postchain
