#include "config/text_tree.h"

#include <unistd.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <optional>
#include <sstream>
#include <unordered_map>

#include "chain/base/readable_file.h"
#include "config/reporter.h"
#include "config/text_check.h"

namespace postchain {
namespace {

// Thrown through yaml-cpp by Builder, to stop its recursion.
struct TooDeep {
    YAML::Mark mark;
};

// Builds the tree from yaml-cpp's events.
class Builder : public YAML::EventHandler {
  public:
    Builder(std::string_view text, const PlaceIndex& places, int depth, Reporter& reporter)
        : text_(text), places_(places), depth_(depth), reporter_(reporter) {}

    TextNode root;

    void OnDocumentStart(const YAML::Mark&) override {}
    void OnDocumentEnd() override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        TextNode node = start(mark, TextNode::Kind::null);
        refuse_properties(mark, node, "?", anchor);
        attach(std::move(node));
    }

    void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
        TextNode node = start(mark, TextNode::Kind::null);
        reporter_.error(node, "", "aliases (*name) are not allowed; write the value again");
        attach(std::move(node));
    }

    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        TextNode node = start(mark, TextNode::Kind::scalar);
        node.text = value;
        node.quoted = tag != "?";  // "!" is yaml-cpp's tag of a quoted or block scalar
        refuse_properties(mark, node, tag == "!" ? "?" : tag, anchor);
        attach(std::move(node));
    }

    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open(mark, TextNode::Kind::list, tag, anchor);
    }
    void OnSequenceEnd() override { close(); }

    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        open(mark, TextNode::Kind::map, tag, anchor);
    }
    void OnMapEnd() override { close(); }

  private:
    struct Level {
        TextNode node;
        std::optional<TextNode> key;                 // map only: without its value so far
        std::unordered_map<std::string, int> lines;  // lines of the keys so far
    };

    TextNode start(const YAML::Mark& mark, TextNode::Kind kind) const {
        TextNode node;
        node.kind = kind;
        const TextPlace place = places_.at(size_t(std::max(mark.pos, 0)));
        node.line = place.line;
        node.column = place.column;
        return node;
    }

    // A node with an explicit tag or anchor begins there.
    void refuse_properties(const YAML::Mark& mark, const TextNode& node, const std::string& tag,
                           YAML::anchor_t anchor) {
        const bool bang =
            mark.pos >= 0 && size_t(mark.pos) < text_.size() && text_[size_t(mark.pos)] == '!';
        if (anchor != 0)
            reporter_.error(node, "", "anchors (&name) are not allowed; write the value again");
        if (tag != "?" || bang)
            reporter_.error(node, "", "tags (!name) are not allowed; quote a string instead");
    }

    void open(const YAML::Mark& mark, TextNode::Kind kind, const std::string& tag,
              YAML::anchor_t anchor) {
        if (int(stack_.size()) >= depth_) throw TooDeep{mark};
        Level level;
        level.node = start(mark, kind);
        refuse_properties(mark, level.node, tag, anchor);
        stack_.push_back(std::move(level));
    }

    void close() {
        TextNode node = std::move(stack_.back().node);
        stack_.pop_back();
        attach(std::move(node));
    }

    void attach(TextNode node) {
        if (stack_.empty()) {
            root = std::move(node);
            return;
        }
        Level& level = stack_.back();
        if (level.node.is_list()) {
            level.node.items.push_back(std::move(node));
        } else if (!level.key) {
            level.key = std::move(node);
        } else {
            add_entry(level, std::move(*level.key), std::move(node));
            level.key.reset();
        }
    }

    void add_entry(Level& level, TextNode key, TextNode value) {
        if (!key.is_scalar()) {
            reporter_.error(key, "", "a key is a word, not " + key.describe());
            return;
        }
        if (key.text == "<<" && !key.quoted) {
            reporter_.error(key, "", "merge keys (<<) are not allowed; write the values again");
            return;
        }
        const auto [found, added] = level.lines.emplace(key.text, key.line);
        if (!added) {
            reporter_.error(key, "",
                            concat("duplicate key '", key.text, "'; it is already given in line ",
                                   found->second));
            return;
        }
        level.node.entries.push_back({std::move(key), std::move(value)});
    }

    std::string_view text_;
    const PlaceIndex& places_;
    int depth_;
    Reporter& reporter_;
    std::vector<Level> stack_;
};

// Records where a second document begins.
class SecondDocument : public YAML::EventHandler {
  public:
    std::optional<YAML::Mark> mark;
    void OnDocumentStart(const YAML::Mark& m) override {
        mark = m;
        throw TooDeep{m};  // stops reading
    }
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
    void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
    void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  const std::string&) override {}
    void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                         YAML::EmitterStyle::value) override {}
    void OnSequenceEnd() override {}
    void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                    YAML::EmitterStyle::value) override {}
    void OnMapEnd() override {}
};

}  // namespace

TextTree read_text_tree(std::string_view given, const std::string& file_name, StatusCode code,
                        const TextLimits& limits) {
    TextTree tree;
    Reporter reporter(file_name, code, tree.diagnostics);
    std::string_view text = given;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
    const auto refuse = [&](const TextPlace& place, const std::string& message) {
        reporter.add(Severity::error, place.line, place.column, "", message);
        tree.root = TextNode();
        return tree;
    };
    const auto too_deep = [&] { return concat("nested deeper than ", limits.depth, " levels"); };

    if (text.size() > limits.bytes)
        return refuse({1, 1}, concat("larger than ", limits.bytes, " bytes; shorten it"));
    if (const auto bad = find_bad_character(text)) return refuse(bad->place, bad->message);
    if (const auto deep = find_deep_bracket(text, limits.depth)) return refuse(*deep, too_deep());
    if (const auto directive = find_directive(text))
        return refuse(*directive, "directives (%NAME) are not allowed; remove it");

    const std::string joined_text = join_surrogates(text);
    text = joined_text;
    const PlaceIndex places(text);
    const auto place_of = [&](const YAML::Mark& mark) {
        return places.at(size_t(std::max(mark.pos, 0)));
    };
    Builder builder(text, places, limits.depth, reporter);
    // yaml-cpp would read a final line end as the end of an open quote.
    const size_t end = text.find_last_not_of(" \t\r\n") + 1;
    try {
        std::istringstream in{std::string(text.substr(0, end))};
        YAML::Parser parser(in);
        if (!parser.HandleNextDocument(builder) || builder.root.is_null()) {
            if (!has_errors(tree.diagnostics))
                return refuse({1, 1}, "is empty; write the file's first key");
        }
        SecondDocument second;
        try {
            parser.HandleNextDocument(second);
        } catch (const TooDeep&) {
        }
        if (second.mark)
            return refuse(place_of(*second.mark),
                          "text after the end of the document; a file has only one document");
    } catch (const TooDeep& deep) {
        return refuse(place_of(deep.mark), too_deep());
    } catch (const YAML::Exception& error) {
        return refuse(place_of(error.mark), "not YAML or JSON: " + error.msg);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {  // from the standard library
        return refuse({1, 1}, std::string("cannot be read: ") + error.what());
    }
    tree.root = std::move(builder.root);
    return tree;
}

const TextNode* TextNode::find(std::string_view key) const {
    for (const auto& entry : entries)
        if (entry.key.text == key) return &entry.value;
    return nullptr;
}

std::string TextNode::describe() const {
    switch (kind) {
        case Kind::null:
            return "nothing";
        case Kind::list:
            return "a list";
        case Kind::map:
            return "a map";
        case Kind::scalar:
            break;
    }
    std::string shown = text.size() > 60 ? text.substr(0, 60) + "..." : text;
    return quoted ? "'" + shown + "' (quoted, so a string)" : "'" + shown + "'";
}

Result<std::string> read_text_file(const std::string& path, StatusCode code,
                                   const TextLimits& limits) try {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return Status(code, path + ": is a folder, not a file");
    const ReadableFile file(path, Pipes::read_by_commands);
    if (!file.ok() && file.error() == ENOMEM) return out_of_memory(path);
    if (!file.ok()) return Status(code, concat(path, ": ", file.fault()));
    // Reads blocks: a text may be far smaller than its limit, or come from a pipe.
    std::string text;
    char block[16384];
    while (text.size() <= limits.bytes) {
        const ssize_t got =
            ::read(file.fd(), block, std::min(sizeof(block), limits.bytes + 1 - text.size()));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return Status(code, path + ": cannot be read");
        if (got == 0) break;
        text.append(block, size_t(got));
    }
    return text;
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain
