#include "chain/json_writer.h"

#include <gtest/gtest.h>

namespace postchain {
namespace {

TEST(JsonWriter, WritesEachKindOnOneLine) {
    JsonWriter json(false);
    json.begin_object();
    json.field("text", "a \"quoted\" \\ word").field("integer", 12).field("large", ~uint64_t(0));
    json.field("yes", true).field("number", 0.1).field("unset", ParameterValue());
    json.field("list", std::vector<std::string>{"a", "b"});
    json.key("empty").begin_array();
    json.end_array();
    json.key("inner").begin_object();
    json.field("value", ParameterValue(int64_t(-3)));
    json.end_object();
    json.end_object();
    EXPECT_EQ(json.text(),
              R"({"text":"a \"quoted\" \\ word","integer":12,"large":18446744073709551615,)"
              R"("yes":true,"number":0.1,"unset":null,"list":["a","b"],"empty":[],)"
              R"("inner":{"value":-3}})");
}

TEST(JsonWriter, Indents) {
    JsonWriter json(true);
    json.begin_object();
    json.field("a", 1);
    json.key("b").begin_array();
    json.value("x");
    json.end_array();
    json.end_object();
    EXPECT_EQ(json.text(), "{\n  \"a\": 1,\n  \"b\": [\n    \"x\"\n  ]\n}");
}

}  // namespace
}  // namespace postchain
