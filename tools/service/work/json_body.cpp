#include "tools/service/work/json_body.h"

#include <tuple>

#include "config/reporter.h"
#include "config/text_check.h"
#include "tools/sequence/files/json.h"

namespace postchain::service {

TextTree read_json_body(const std::string& text) {
    TextTree tree = read_text_tree(text, kBodyFile, StatusCode::usage);
    if (has_errors(tree.diagnostics)) return tree;
    Reporter reporter(kBodyFile, StatusCode::usage, tree.diagnostics);
    if (!tree.root.is_map())
        reporter.error(tree.root, "", "a request is a JSON object, not " + tree.root.describe());
    try {
        std::ignore = io::Json::parse(text);
    } catch (const io::Json::parse_error& error) {
        const TextPlace place = place_at(text, error.byte > 0 ? error.byte - 1 : 0);
        reporter.add(Severity::error, place.line, place.column, "", "not valid JSON from here on");
    } catch (const io::Json::out_of_range&) {
        reporter.error(tree.root, "", "a number is too large for a double");
    }
    return tree;
}

bool is_string(const TextNode& node) {
    return node.is_scalar() && node.quoted;
}

}  // namespace postchain::service
