#include "chain/base/json.h"

#include <gtest/gtest.h>

#include <limits>

namespace postchain {
namespace {

TEST(Json, WritesEachKindOnOneLine) {
    JsonObject json = {{"text", "a \"quoted\" \\ word"},
                       {"integer", 12},
                       {"large", ~uint64_t(0) >> 1},
                       {"yes", true},
                       {"number", 0.1},
                       {"infinite", std::numeric_limits<double>::infinity()},
                       {"unset", ParameterValue()},
                       {"point", ParameterValue(std::array<double, 2>{0.5, 1})},
                       {"list", std::vector<std::string>{"a", "b"}},
                       {"empty", JsonArray()}};
    json.push_back({"inner", JsonObject{{"value", -3}}});
    EXPECT_EQ(json_text(json),
              R"({"text":"a \"quoted\" \\ word","integer":12,"large":9223372036854775807,)"
              R"("yes":true,"number":0.1,"infinite":null,"unset":null,"point":[0.5,1],)"
              R"("list":["a","b"],"empty":[],"inner":{"value":-3}})");
}

TEST(Json, Indents) {
    EXPECT_EQ(json_text(JsonObject{{"a", 1}, {"b", JsonArray{"x"}}, {"c", JsonObject()}}, true),
              "{\n  \"a\": 1,\n  \"b\": [\n    \"x\"\n  ],\n  \"c\": {}\n}");
}

}  // namespace
}  // namespace postchain
