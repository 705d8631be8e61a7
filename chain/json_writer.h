// JsonWriter: JSON text, on one line or indented, in the order of the calls.
//
//   JsonWriter json(false);
//   json.begin_object();
//   json.field("frame", 12).field("name", "tile_max");
//   json.key("groups").begin_array();
//   json.end_array();
//   json.end_object();                     // json.text()
#pragma once

#include <concepts>
#include <string>
#include <vector>

#include "chain/parameter.h"

namespace postchain {

class JsonWriter {
  public:
    explicit JsonWriter(bool indented) : indented_(indented) {}

    void begin_object() { open('{'); }
    void begin_array() { open('['); }
    void end_object() { close('}'); }
    void end_array() { close(']'); }
    // Of the value or bracket that comes next.
    JsonWriter& key(const std::string& name);
    JsonWriter& value(const ParameterValue& value);  // unset: null
    JsonWriter& value(const std::string& text);
    JsonWriter& value(const char* text) { return value(std::string(text)); }
    JsonWriter& value(const std::vector<std::string>& texts);
    template <std::integral T>
    JsonWriter& value(T value) {
        if constexpr (std::same_as<T, bool>) return plain(value ? "true" : "false");
        return plain(std::to_string(value));
    }
    template <class T>
    JsonWriter& field(const std::string& name, const T& what) {
        return key(name).value(what);
    }
    const std::string& text() const { return text_; }

  private:
    JsonWriter& plain(const std::string& text);
    void open(char bracket);
    void close(char bracket);
    void separate();  // comma and line before the next key or value
    void new_line();

    bool indented_;
    bool after_key_ = false;
    std::string text_;
    std::vector<bool> filled_;  // of each open bracket: has it an entry?
};

}  // namespace postchain
