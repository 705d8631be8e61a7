#include "tools/service/work/body_keys.h"

#include "config/schema.h"

namespace postchain::service {

io::Json string_schema(const char* help) {
    return {{"description", help}, {"type", "string"}};
}

io::Json strings_schema(const char* help) {
    return {{"description", help}, {"type", "array"}, {"items", {{"type", "string"}}}};
}

io::Json string_or_object(const char* help) {
    return {{"description", help}, {"type", {"string", "object"}}};
}

void add_chain_keys(const std::string& key, BodyKeys& keys) {
    keys.emplace_back(key, string_or_object("a shipped chain's name, a chain file, or a chain as "
                                            "an object"));
    keys.emplace_back(key + "_text",
                      string_schema(("the text of a chain file, in place of " + key).c_str()));
}

void add_row_keys(const ParameterTable& table, const std::string& group, BodyKeys& keys) {
    for (const Parameter& row : table.rows())
        if (row.group == group) keys.emplace_back(row.key, io::json_from(row_schema(row)));
}

}  // namespace postchain::service
