#include "chain/json_writer.h"

#include "chain/text.h"

namespace postchain {

JsonWriter& JsonWriter::key(const std::string& name) {
    separate();
    text_ += quoted(name) + (indented_ ? ": " : ":");
    after_key_ = true;
    return *this;
}

JsonWriter& JsonWriter::value(const ParameterValue& value) {
    if (const auto* word = std::get_if<std::string>(&value)) return plain(quoted(*word));
    return plain(std::holds_alternative<std::monostate>(value) ? "null" : text_of(value));
}

JsonWriter& JsonWriter::value(const std::string& text) {
    return plain(quoted(text));
}

JsonWriter& JsonWriter::value(const std::vector<std::string>& texts) {
    begin_array();
    for (const auto& text : texts) value(text);
    end_array();
    return *this;
}

JsonWriter& JsonWriter::plain(const std::string& text) {
    separate();
    text_ += text;
    return *this;
}

void JsonWriter::open(char bracket) {
    separate();
    text_ += bracket;
    filled_.push_back(false);
}

void JsonWriter::close(char bracket) {
    const bool filled = filled_.back();
    filled_.pop_back();
    if (filled) new_line();
    text_ += bracket;
}

void JsonWriter::separate() {
    if (after_key_ || filled_.empty()) {
        after_key_ = false;
        return;
    }
    if (filled_.back()) text_ += ',';
    filled_.back() = true;
    new_line();
}

void JsonWriter::new_line() {
    if (indented_) text_ += '\n' + std::string(2 * filled_.size(), ' ');
}

}  // namespace postchain
