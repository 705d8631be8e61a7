// JSON values that chain/ and config/ write. Nothing here reads JSON. tools/ turns them into
// objects of its own library (tools/sequence/files/json.h).
//
//   JsonObject json = {{"frame", 12}, {"name", "tile_max"}, {"groups", JsonArray{4, 4, 1}}};
//   json.push_back({"work_list", 2});
//   json_text(json)   // {"frame":12,"name":"tile_max","groups":[4,4,1],"work_list":2}
#pragma once

#include <concepts>
#include <string>
#include <variant>
#include <vector>

#include "chain/base/parameter.h"

namespace postchain {

class JsonValue;
struct JsonMember;
using JsonArray = std::vector<JsonValue>;
using JsonObject = std::vector<JsonMember>;  // in the order of the text

class JsonValue {
  public:
    JsonValue();  // null
    JsonValue(bool flag);
    template <std::integral T>
    requires(!std::same_as<T, bool>) JsonValue(T integer);
    JsonValue(double number);  // JSON has no infinity and no NaN: null
    JsonValue(const char* text);
    JsonValue(const std::string& text);
    JsonValue(const std::vector<std::string>& texts);
    JsonValue(const ParameterValue& scalar);  // unset: null
    JsonValue(JsonArray array);
    JsonValue(JsonObject object);

    std::variant<ParameterValue, JsonArray, JsonObject> value;
};

struct JsonMember {
    std::string key;
    JsonValue value;
};

// Here, since clang needs the whole JsonMember for it.
template <std::integral T>
requires(!std::same_as<T, bool>) JsonValue::JsonValue(T integer)
    : value(ParameterValue(int64_t(integer))) {}

// On one line, or indented by two spaces for each level. Settings in texts as_keys().
std::string json_text(const JsonValue& value, bool indented = false);

}  // namespace postchain
