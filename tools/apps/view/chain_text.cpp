#include "tools/apps/view/chain_text.h"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "config/chain_file.h"
#include "config/text_tree.h"

namespace postchain::view {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;  // key and YAML text

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find('\n', at), text.size());
        lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

bool is_comment(const std::string& line) {
    const size_t first = line.find_first_not_of(" \t\r");
    return first == std::string::npos || line[first] == '#';
}

// The lines "key: value" of write_chain() that are indented by `indent`.
Rows rows_in(const std::string& text, const std::string& indent) {
    Rows rows;
    for (const std::string& line : lines_of(text)) {
        const size_t colon = line.find(": ");
        if (colon == std::string::npos || !line.starts_with(indent) || line[indent.size()] == ' ' ||
            line[indent.size()] == '-')
            continue;
        rows.emplace_back(line.substr(indent.size(), colon - indent.size()),
                          line.substr(colon + 2));
    }
    return rows;
}

Rows rows_of(const ChainLink& link) {
    Chain one;
    one.links.push_back(link.clone());
    return rows_in(write_chain(one), "      ");
}

Rows rows_of(const Camera& camera) {
    Chain one;
    one.camera = camera;
    return rows_in(write_chain(one), "  ");
}

const std::string* find(const Rows& rows, const std::string& key) {
    for (const auto& row : rows)
        if (row.first == key) return &row.second;
    return nullptr;
}

// The rows of `rows` whose value is another one than in `than`.
Rows others(const Rows& rows, const Rows& than) {
    Rows changed;
    for (const auto& row : rows)
        if (const std::string* old = find(than, row.first); !old || *old != row.second)
            changed.push_back(row);
    return changed;
}

std::string in_braces(const Rows& rows) {
    std::string text;
    for (const auto& [key, value] : rows) text += (text.empty() ? "" : ", ") + key + ": " + value;
    return text;
}

// The text without these lines of it.
std::string without(std::string text, const std::string& lines) {
    size_t at = text.find(lines);
    while (at != std::string::npos && at > 0 && text[at - 1] != '\n') at = text.find(lines, at + 1);
    if (at != std::string::npos) text.erase(at, lines.size());
    return text;
}

std::string entry_line(const ChainLink& link, const std::string& indent) {
    ChainLink plain;
    plain.type = link.type;
    plain.pass = link.type->create();
    const Rows rows = others(rows_of(link), rows_of(plain));
    return indent + "- " + link.type->name + (rows.empty() ? "" : ": {" + in_braces(rows) + "}");
}

// Edits of lines, applied from the last to the first.
class LineEdits {
  public:
    explicit LineEdits(std::vector<std::string>& lines) : lines_(lines) {}
    // `column` counts characters from 1; false if `old` is not at this place.
    bool replace(int line, int column, const std::string& old, const std::string& text) {
        const size_t byte = byte_of(line, column);
        if (lines_[size_t(line) - 1].compare(byte, old.size(), old) != 0) return false;
        edits_.emplace_back(line, byte, old.size(), text);
        return true;
    }
    // Removes an entry that has its line for itself, or one in braces with another one beside it.
    // False: neither is so.
    bool erase(const std::vector<TextEntry>& entries, size_t i) {
        const TextNode &key = entries[i].key, &value = entries[i].value;
        const std::string& line = lines_[size_t(key.line) - 1];
        const size_t begin = byte_of(key.line, key.column);
        if (!is_plain(value, key.line)) return false;
        const size_t end = byte_of(key.line, value.column) + value.text.size();
        if (line.find_first_not_of(' ') == begin && is_comment(line.substr(end))) {
            erased_.insert(size_t(key.line) - 1);
            return true;
        }
        const auto remove = [&](size_t from, size_t to) {
            edits_.emplace_back(key.line, from, to - from, "");
            return true;
        };
        if (i + 1 < entries.size() && entries[i + 1].key.line == key.line)
            return remove(begin, byte_of(key.line, entries[i + 1].key.column));
        if (i == 0 || !is_plain(entries[i - 1].value, key.line)) return false;
        const TextNode& before = entries[i - 1].value;
        return remove(byte_of(key.line, before.column) + before.text.size(), end);
    }
    // Removes a map of such lines with its key. False: it is written otherwise.
    bool erase_block(const TextEntry& entry) {
        const TextNode& key = entry.key;
        const size_t end = byte_of(key.line, key.column) + key.text.size();
        const std::string& line = lines_[size_t(key.line) - 1];
        if (line.compare(end, 1, ":") != 0 || !is_comment(line.substr(end + 1))) return false;
        for (size_t i = 0; i < entry.value.entries.size(); ++i)
            if (!erase(entry.value.entries, i)) return false;
        erased_.insert(size_t(key.line) - 1);
        return true;
    }
    bool is_erased(size_t line) const { return erased_.contains(line); }
    void apply() {
        std::stable_sort(edits_.begin(), edits_.end(), [](const auto& a, const auto& b) {
            return std::tie(std::get<0>(a), std::get<1>(a)) >
                   std::tie(std::get<0>(b), std::get<1>(b));
        });
        for (const auto& [line, byte, length, text] : edits_)
            lines_[size_t(line) - 1].replace(byte, length, text);
    }

  private:
    // Whether all of the value stands on this line as it is.
    bool is_plain(const TextNode& value, int line) const {
        return value.is_scalar() && !value.quoted && value.line == line &&
               lines_[size_t(line) - 1].compare(byte_of(line, value.column), value.text.size(),
                                                value.text) == 0;
    }
    size_t byte_of(int line, int column) const {
        const std::string& at = lines_[size_t(line) - 1];
        size_t byte = 0;
        for (int i = 1; i < column && byte < at.size(); ++i) do
                ++byte;
            while (byte < at.size() && (uint8_t(at[byte]) & 0xc0) == 0x80);
        return byte;
    }

    std::vector<std::string>& lines_;
    std::set<size_t> erased_;  // from 0
    std::vector<std::tuple<int, size_t, size_t, std::string>> edits_;
};

// Changes the values of a map in its text. False: it cannot be done in place.
bool edit_map(const TextNode& map, const Rows& old_rows, const Rows& new_rows,
              const std::vector<std::string>& lines, LineEdits& edits) {
    const TextNode* kept = nullptr;  // the first key
    bool gone = false;               // the entry before
    for (size_t i = 0; i < map.entries.size(); ++i) {
        const TextNode& key = map.entries[i].key;
        const bool goes = !find(new_rows, key.text) && find(old_rows, key.text);
        // The last of several in braces would take what the one before has taken.
        if (goes && ((gone && i + 1 == map.entries.size()) || !edits.erase(map.entries, i)))
            return false;
        if (!goes && !kept) kept = &key;
        gone = goes;
    }
    Rows added;
    for (const auto& row : others(new_rows, old_rows)) {
        const TextNode* value = map.find(row.first);
        if (!value)
            added.push_back(row);
        else if (!value->is_scalar() || value->quoted ||
                 !edits.replace(value->line, value->column, value->text, row.second))
            return false;
    }
    if (added.empty()) return kept != nullptr;
    if (!kept) return false;
    const TextNode& first = *kept;
    if (lines[size_t(map.line) - 1].find('{') != std::string::npos &&
        edits.replace(map.line, map.column, "{", "{" + in_braces(added) + ", "))
        return true;
    std::string text;
    for (const auto& [key, value] : added)
        text += key + ": " + value + "\n" + std::string(size_t(first.column) - 1, ' ');
    return edits.replace(first.line, first.column, first.text, text + first.text);
}

// Changes the values of a pass in its text.
bool edit_entry(const TextNode& item, const ChainLink& old_link, const ChainLink& link,
                const std::vector<std::string>& lines, LineEdits& edits) {
    const Rows old_rows = rows_of(old_link), new_rows = rows_of(link);
    if (old_rows == new_rows) return true;
    if (item.is_scalar())
        return edits.replace(item.line, item.column, item.text,
                             item.text + ": {" + in_braces(others(new_rows, old_rows)) + "}");
    if (item.entries.size() != 1 || !item.entries[0].value.is_map()) return false;
    return edit_map(item.entries[0].value, old_rows, new_rows, lines, edits);
}

bool edit_camera(const TextNode& root, const Camera& old_camera, const Camera& camera,
                 const std::vector<std::string>& lines, LineEdits& edits) {
    const Rows old_rows = rows_of(old_camera), new_rows = rows_of(camera);
    if (old_rows == new_rows) return true;
    for (const TextEntry& entry : root.entries)
        if (entry.key.text == "camera")
            return entry.value.is_map() &&
                   (new_rows.empty() ? edits.erase_block(entry)
                                     : edit_map(entry.value, old_rows, new_rows, lines, edits));
    for (const TextEntry& entry : root.entries) {
        if (entry.key.text != "passes") continue;
        return edits.replace(entry.key.line, entry.key.column, "passes",
                             "camera: {" + in_braces(new_rows) + "}\npasses");
    }
    return false;
}

// The lines of the file's passes, each with the comments above it.
struct Blocks {
    size_t first = 0, end = 0;  // lines, from 0
    struct Block {
        size_t begin = 0, content = 0, end = 0;
    };
    std::vector<Block> blocks;
    std::string indent;
};

std::optional<Blocks> blocks_of(const TextNode& root, const std::vector<std::string>& lines) {
    const TextNode* passes = root.find("passes");
    if (!passes || !passes->is_list() || passes->items.empty()) return {};
    Blocks found;
    int key_line = 0, next_line = int(lines.size()) + 1;
    for (const TextEntry& entry : root.entries)
        if (entry.key.text == "passes") key_line = entry.key.line;
    for (const TextEntry& entry : root.entries)
        if (entry.key.line > key_line) next_line = std::min(next_line, entry.key.line);
    for (const TextNode& item : passes->items) {
        const std::string& line = lines[size_t(item.line) - 1];
        const size_t dash = line.find_first_not_of(' ');
        if (item.line <= key_line || dash == std::string::npos || line[dash] != '-') return {};
        found.indent = line.substr(0, dash);
        found.blocks.push_back({.content = size_t(item.line) - 1});
    }
    size_t begin = size_t(key_line);
    for (size_t i = 0; i < found.blocks.size(); ++i) {
        Blocks::Block& block = found.blocks[i];
        block.begin = begin;
        block.end =
            i + 1 < found.blocks.size() ? found.blocks[i + 1].content : size_t(next_line) - 1;
        if (block.content < begin) return {};
        while (block.end > block.content + 1 && is_comment(lines[block.end - 1])) --block.end;
        begin = block.end;
    }
    found.first = size_t(key_line);
    found.end = begin;
    return found;
}

std::optional<ChainFileText> edited(const std::string& old_text, const Document& document) {
    const TextTree tree = read_text_tree(old_text, "");
    const ChainFile old = parse_chain(old_text, "", document.registry());
    if (!tree.diagnostics.empty() || !old.status().ok()) return {};
    std::vector<std::string> lines = lines_of(old_text);
    const auto blocks = blocks_of(tree.root, lines);
    if (!blocks || blocks->blocks.size() != old.chain.links.size()) return {};
    const DocumentState& state = document.state();
    const TextNode& items = *tree.root.find("passes");
    LineEdits edits(lines);
    // The lines of passes that cannot be changed in place.
    std::vector<std::string> anew(state.id.size());
    for (size_t i = 0; i < state.id.size(); ++i) {
        const ChainLink& link = state.chain.links[i];
        const auto entry = size_t(document.entry(i));
        LineEdits one(lines);
        const bool from_file =
            document.entry(i) >= 0 && entry < old.chain.links.size() &&
            old.chain.links[entry].type == link.type &&
            edit_entry(items.items[entry], old.chain.links[entry], link, lines, one);
        if (from_file)
            edit_entry(items.items[entry], old.chain.links[entry], link, lines, edits);
        else if (const auto off = document.off_in_file().find(state.id[i]);
                 off != document.off_in_file().end() && off->second.link == link.text())
            anew[i] = off->second.body;
        else
            anew[i] = entry_line(link, blocks->indent) + "\n";
    }
    const Camera camera = document.chain_to_save().camera;
    if (!edit_camera(tree.root, old.chain.camera, camera, lines, edits)) return {};
    edits.apply();

    const auto from_to = [&](size_t from, size_t to) {
        std::string text;
        for (size_t i = from; i < to; ++i)
            if (!edits.is_erased(i)) text += lines[i] + "\n";
        return text;
    };
    ChainFileText found{from_to(0, blocks->first), true, {}};
    bool any = false;
    for (size_t i = 0; i < state.id.size(); ++i) {
        OffPass pass{"", anew[i], state.chain.links[i].text()};
        if (const int entry = document.entry(i);
            entry >= 0 && size_t(entry) < blocks->blocks.size()) {
            const Blocks::Block& block = blocks->blocks[size_t(entry)];
            pass.above = from_to(block.begin, block.content);
            if (anew[i].empty()) pass.body = from_to(block.content, block.end);
        } else if (const auto off = document.off_in_file().find(state.id[i]);
                   off != document.off_in_file().end()) {
            pass.above = off->second.above;
        }
        any = any || !state.off[i];
        found.text += state.off[i] ? pass.lines() : pass.above + pass.body;
        if (state.off[i]) found.off.emplace(state.id[i], std::move(pass));
    }
    if (!any) return {};
    found.text += from_to(blocks->end, lines.size());
    return found;
}

}  // namespace

ChainFileText chain_file_text(const std::string& file_text, const Document& document) {
    const Chain chain = document.chain_to_save();
    std::string old_text = file_text;
    for (const auto& [id, pass] : document.off_in_file())
        old_text = without(old_text, pass.lines());
    if (auto found = edited(old_text, document)) {
        const ChainFile again = parse_chain(found->text, "", document.registry());
        if (again.status().ok() && write_chain(again.chain) == write_chain(chain)) return *found;
    }
    ChainFileText found;
    for (const std::string& line : lines_of(old_text)) {
        if (!is_comment(line)) break;
        found.text += line + "\n";
    }
    found.text += write_chain(chain);
    const DocumentState& state = document.state();
    for (size_t i = 0; i < state.off.size(); ++i) {
        if (!state.off[i]) continue;
        const ChainLink& link = state.chain.links[i];
        const OffPass pass{"", entry_line(link, "  ") + "\n", link.text()};
        found.text += pass.lines();
        found.off.emplace(state.id[i], pass);
    }
    return found;
}

}  // namespace postchain::view
