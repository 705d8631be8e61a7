// TextTree: YAML or JSON text -> a tree of scalars, lists and maps with the place of each.
//
//   text --size, UTF-8--> events of nlohmann_json (JSON) or libyaml --limits, duplicates-->
//   TextNode
//
// A text that begins with { or [ and is valid JSON is read as JSON, any other as YAML. (libyaml
// reads neither the surrogates of JSON nor keys of more than 1024 characters.) Rules:
//   - a plain scalar is true, false, null, a decimal integer, a decimal number, or a string;
//   - a quoted scalar is a string, always;
//   - anchors, aliases, tags, merge keys, directives, duplicate keys, a second document, text that
//     is not UTF-8, control characters, and a text beyond a limit are errors.
//
// The work is in proportion to the text: no step looks a key up among all others.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.h"

namespace postchain {

struct TextLimits {
    size_t bytes = size_t(1) << 20;
    int depth = 32;         // nested lists and maps
    size_t nodes = 20'000;  // scalars, lists and maps
    size_t keys = 256;      // of one map
    // Whole numbers among the keys are not counted: the frames of a camera file.
    bool frame_keys = false;
};

struct TextNode;
struct TextEntry;

struct TextNode {
    enum class Kind { null, scalar, list, map };
    Kind kind = Kind::null;
    bool quoted = false;             // scalar only
    std::string text;                // scalar only
    int line = 1;                    // from 1
    int column = 1;                  // from 1, in characters
    std::vector<TextNode> items;     // list
    std::vector<TextEntry> entries;  // map, in the order of the text

    bool is_map() const { return kind == Kind::map; }
    bool is_list() const { return kind == Kind::list; }
    bool is_scalar() const { return kind == Kind::scalar; }
    bool is_null() const { return kind == Kind::null; }
    const TextNode* find(std::string_view key) const;  // value in a map, or null
    // "a list", "a map", "nothing", or the scalar as written
    std::string describe() const;
};

struct TextEntry {
    TextNode key;  // a scalar
    TextNode value;
};

struct TextTree {
    TextNode root;
    Diagnostics diagnostics;  // errors only; root lacks the faulty parts
};

// `code` becomes the code of every error. Stops with an error if nobody waits for the tree any more
// (chain/base/stop.h).
TextTree read_text_tree(std::string_view text, const std::string& file_name,
                        StatusCode code = StatusCode::chain, const TextLimits& limits = {});
// As read_text_tree(), but a text that is not JSON is an error at its first wrong character.
TextTree read_json_tree(std::string_view text, const std::string& file_name, StatusCode code,
                        const TextLimits& limits = {});

// Reads at most limits.bytes + 1 bytes of a file; read_text_tree() refuses larger texts.
Result<std::string> read_text_file(const std::string& path, StatusCode code,
                                   const TextLimits& limits = {});

}  // namespace postchain
