#include <gtest/gtest.h>

#include "tools/sequence/files/json.h"

namespace postchain::io {
namespace {

TEST(ParameterJson, EveryTypeHasOneForm) {
    const std::vector<std::pair<ParameterValue, std::string>> forms = {
        {ParameterValue(), "null"},
        {true, "true"},
        {int64_t(-25), "-25"},
        {0.5, "0.5"},
        {std::string("fast"), "\"fast\""},
        {std::array<double, 2>{0.5, -0.25}, "[0.5,-0.25]"}};
    for (const auto& [value, text] : forms) {
        EXPECT_EQ(json_of(value).dump(), text);
        const auto read = value_of(Json::parse(text));
        ASSERT_TRUE(read.has_value()) << text;
        EXPECT_EQ(*read, value) << text;
    }
}

TEST(ParameterJson, WhatHasNoFormIsNoValue) {
    for (const char* text :
         {"{}", "[]", "[1]", "[1,2,3]", "[1,\"a\"]", "[\"a\",1]", "9223372036854775808"})
        EXPECT_FALSE(value_of(Json::parse(text)).has_value()) << text;
    EXPECT_EQ(*value_of(Json::parse("9223372036854775807")), ParameterValue(INT64_MAX));
}

// Read back it is the same text.
TEST(ParameterJson, NoTextActsOnATerminal) {
    for (const auto& [text, written] :
         std::vector<std::pair<std::string, std::string>>{{"\x1b[2J", "\\u001b[2J"},
                                                          {"\x7f", "\\u007f"},
                                                          {"\xc2\x9b", "\\u009b"},
                                                          {"\xd8\x9c", "\\u061c"},
                                                          {"\xe2\x80\xae", "\\u202e"},
                                                          {"\xe2\x81\xa9", "\\u2069"},
                                                          {"\xef\xbb\xbf", "\\ufeff"},
                                                          {"gr\xc3\xbcn", "gr\xc3\xbcn"}}) {
        EXPECT_EQ(json_text(Json("a" + text)), "\"a" + written + "\"");
        EXPECT_EQ(Json::parse(json_text(Json("a" + text))), "a" + text);
    }
}

TEST(ParameterJson, WhatTheChainWritesBecomesTheSameText) {
    const std::vector<JsonValue> values = {
        28.0,
        0.1,
        1e300,
        -0.5,
        int64_t(-7),
        true,
        "a \"word\"",
        JsonValue(),
        ParameterValue(std::array<double, 2>{0.25, 1}),
        JsonArray{1, "x", JsonArray()},
        JsonObject{{"b", 2}, {"a", JsonObject{{"c", JsonValue()}}}}};
    for (const JsonValue& value : values) EXPECT_EQ(json_from(value).dump(), json_text(value));
    // Its shortest text has no exponent, but it is no integer of 64 bits.
    EXPECT_EQ(json_from(123456789012345680000.0), Json(123456789012345680000.0));
}

}  // namespace
}  // namespace postchain::io
