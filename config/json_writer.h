// JsonWriter: JSON text, on one line or indented, in the order of the calls.
#pragma once

#include <string>
#include <vector>

#include "chain/parameter.h"
#include "chain/text.h"

namespace postchain {

class JsonWriter {
  public:
    explicit JsonWriter(bool indented) : indented_(indented) {}

    void begin_object() { open('{'); }
    void begin_array() { open('['); }
    void end_object() { close('}'); }
    void end_array() { close(']'); }
    JsonWriter& key(const std::string& name) {
        separate();
        text_ += quoted(name) + (indented_ ? ": " : ":");
        after_key_ = true;
        return *this;
    }
    void value(const ParameterValue& value) {
        separate();
        if (const auto* word = std::get_if<std::string>(&value))
            text_ += quoted(*word);
        else if (std::holds_alternative<std::monostate>(value))
            text_ += "null";
        else
            text_ += text_of(value);
    }
    void value(const char* word) { value(ParameterValue(std::string(word))); }
    void value(const std::vector<std::string>& words) {
        begin_array();
        for (const auto& word : words) value(ParameterValue(word));
        end_array();
    }
    const std::string& text() const { return text_; }

  private:
    void open(char bracket) {
        separate();
        text_ += bracket;
        filled_.push_back(false);
    }
    void close(char bracket) {
        const bool filled = filled_.back();
        filled_.pop_back();
        if (filled) new_line();
        text_ += bracket;
    }
    // Comma and line before the next key or value.
    void separate() {
        if (after_key_ || filled_.empty()) {
            after_key_ = false;
            return;
        }
        if (filled_.back()) text_ += ',';
        filled_.back() = true;
        new_line();
    }
    void new_line() {
        if (indented_) text_ += '\n' + std::string(2 * filled_.size(), ' ');
    }

    bool indented_;
    bool after_key_ = false;
    std::string text_;
    std::vector<bool> filled_;  // of each open bracket: has it an entry?
};

}  // namespace postchain
