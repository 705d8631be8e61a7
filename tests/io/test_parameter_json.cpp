#include <gtest/gtest.h>

#include "tools/sequence/files/parameter_json.h"

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
    for (const char* text : {"{}", "[]", "[1]", "[1,2,3]", "[1,\"a\"]", "9223372036854775808"})
        EXPECT_FALSE(value_of(Json::parse(text)).has_value()) << text;
    EXPECT_EQ(*value_of(Json::parse("9223372036854775807")), ParameterValue(INT64_MAX));
}

}  // namespace
}  // namespace postchain::io
