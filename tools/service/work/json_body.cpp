#include "tools/service/work/json_body.h"

#include <set>

#include "config/text_check.h"

namespace postchain::service {
namespace {

bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

size_t after_blanks(const std::string& text, size_t at) {
    while (at < text.size() && is_blank(text[at])) ++at;
    return at;
}

// The byte after the value that begins at `at`, in a text that is JSON.
size_t end_of_value(const std::string& text, size_t at) {
    int depth = 0;
    bool quoted = false;
    for (; at < text.size(); ++at) {
        const char c = text[at];
        if (quoted) {
            if (c == '\\') ++at;
            if (c != '"') continue;
            quoted = false;
            if (depth == 0) return at + 1;
        } else if (c == '"') {
            quoted = true;
        } else if (c == '{' || c == '[') {
            ++depth;
        } else if (c == '}' || c == ']') {
            if (depth == 0) return at;
            if (--depth == 0) return at + 1;
        } else if (depth == 0 && (c == ',' || is_blank(c))) {
            return at;
        }
    }
    return at;
}

// Of an object that is JSON.
std::vector<JsonMember> members_of(const std::string& text) {
    std::vector<JsonMember> members;
    size_t at = after_blanks(text, after_blanks(text, 0) + 1);
    while (at < text.size() && text[at] == '"') {
        JsonMember member;
        member.key_at = at;
        const size_t key_end = end_of_value(text, at);
        member.key = io::Json::parse(text.substr(at, key_end - at)).get<std::string>();
        member.value_at = after_blanks(text, after_blanks(text, key_end) + 1);  // after the colon
        member.value_end = end_of_value(text, member.value_at);
        member.value =
            io::Json::parse(text.substr(member.value_at, member.value_end - member.value_at));
        at = after_blanks(text, member.value_end);
        if (at < text.size() && text[at] == ',') at = after_blanks(text, at + 1);
        members.push_back(std::move(member));
    }
    return members;
}

}  // namespace

const JsonMember* JsonBody::find(const std::string& key) const {
    for (const JsonMember& member : members)
        if (member.key == key) return &member;
    return nullptr;
}

Diagnostic JsonBody::fault(size_t at, const std::string& path, const std::string& message) const {
    const TextPlace place = place_at(text, std::min(at, text.size()));
    return {kBodyFile, place.line, place.column, Severity::error, path, message, StatusCode::usage};
}

std::string JsonBody::alone(const JsonMember& member) const {
    std::string blank = text.substr(0, member.value_at);
    for (char& c : blank)
        if (c != '\n') c = ' ';
    return blank + text.substr(member.value_at, member.value_end - member.value_at);
}

JsonBody read_json_body(const std::string& text, Diagnostics& faults) {
    JsonBody body;
    const auto refuse = [&](size_t at, const std::string& message) {
        body.text = text.substr(0, kMaxBodyBytes);
        faults.push_back(body.fault(at, "", message));
        return body;
    };
    if (text.size() > kMaxBodyBytes)
        return refuse(0, concat("longer than ", kMaxBodyBytes, " bytes"));
    if (const auto deep = find_deep_bracket(text, kMaxBodyDepth)) {
        body.text = text;
        Diagnostic fault = body.fault(
            0, "", concat("more than ", kMaxBodyDepth, " objects and lists within each other"));
        fault.line = deep->line;
        fault.column = deep->column;
        faults.push_back(fault);
        return body;
    }
    io::Json whole;
    try {
        whole = io::Json::parse(text);
    } catch (const io::Json::parse_error& error) {
        return refuse(error.byte > 0 ? error.byte - 1 : 0, "is no JSON here");
    } catch (const io::Json::exception& error) {
        return refuse(0, std::string("is no JSON: ") + error.what());
    }
    if (!whole.is_object()) return refuse(0, "is no JSON object");
    body.text = text;
    body.members = members_of(text);
    std::set<std::string> met;
    for (const JsonMember& member : body.members)
        if (!met.insert(member.key).second)
            faults.push_back(body.fault(member.key_at, member.key, "is there twice"));
    return body;
}

}  // namespace postchain::service
