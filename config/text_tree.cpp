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
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <unordered_map>

#include "chain/base/readable_file.h"
#include "chain/base/stop.h"
#include "config/reporter.h"
#include "config/text_check.h"

namespace postchain {
namespace {

size_t offset_of(const YAML::Mark& mark) {
    return size_t(std::max(mark.pos, 0));
}

// Builds the tree from the events of a parser. Offsets are those of bytes in the text. Throws a
// TextFault, through the parser, to stop it.
class Builder {
  public:
    Builder(const PlaceIndex& places, const TextLimits& limits, Reporter& reporter)
        : places_(places), limits_(limits), reporter_(reporter) {}

    TextNode root;

    TextNode start(size_t offset, TextNode::Kind kind) {
        const TextPlace place = places_.at(offset);
        if (++nodes_ > limits_.nodes) throw TextFault{place, too_many_nodes(limits_.nodes)};
        if (is_stopped()) throw TextFault{place, stopped_status().message()};
        TextNode node;
        node.kind = kind;
        node.line = place.line;
        node.column = place.column;
        return node;
    }

    void open(TextNode node) {
        if (int(stack_.size()) >= limits_.depth)
            throw TextFault{{node.line, node.column}, nested_too_deep(limits_.depth)};
        Level level;
        level.node = std::move(node);
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

  private:
    struct Level {
        TextNode node;
        std::optional<TextNode> key;                 // map only: without its value so far
        std::unordered_map<std::string, int> lines;  // lines of the keys so far
        size_t keys = 0;                             // those that count
    };

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
        level.keys += !(limits_.frame_keys && is_whole(key.text));
        if (level.keys > limits_.keys)
            throw TextFault{{key.line, key.column},
                            concat("more than ", limits_.keys, " keys in one map; remove some")};
        level.node.entries.push_back({std::move(key), std::move(value)});
    }

    static bool is_whole(std::string_view word) {
        if (word.starts_with('-')) word.remove_prefix(1);
        return !word.empty() && word.find_first_not_of("0123456789") == word.npos;
    }

    const PlaceIndex& places_;
    const TextLimits& limits_;
    Reporter& reporter_;
    size_t nodes_ = 0;
    std::vector<Level> stack_;
};

// The events of yaml-cpp.
class YamlEvents : public YAML::EventHandler {
  public:
    YamlEvents(std::string_view text, Builder& builder, Reporter& reporter)
        : text_(text), builder_(builder), reporter_(reporter) {}

    void OnDocumentStart(const YAML::Mark&) override {}
    void OnDocumentEnd() override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        TextNode node = start(mark, TextNode::Kind::null);
        refuse_properties(mark, node, "?", anchor);
        builder_.attach(std::move(node));
    }

    void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
        TextNode node = start(mark, TextNode::Kind::null);
        reporter_.error(node, "", "aliases (*name) are not allowed; write the value again");
        builder_.attach(std::move(node));
    }

    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        TextNode node = start(mark, TextNode::Kind::scalar);
        node.text = value;
        node.quoted = tag != "?";  // "!" is yaml-cpp's tag of a quoted or block scalar
        refuse_properties(mark, node, tag == "!" ? "?" : tag, anchor);
        builder_.attach(std::move(node));
    }

    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open(mark, TextNode::Kind::list, tag, anchor);
    }
    void OnSequenceEnd() override { builder_.close(); }

    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        open(mark, TextNode::Kind::map, tag, anchor);
    }
    void OnMapEnd() override { builder_.close(); }

  private:
    TextNode start(const YAML::Mark& mark, TextNode::Kind kind) {
        return builder_.start(offset_of(mark), kind);
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
        TextNode node = start(mark, kind);
        refuse_properties(mark, node, tag, anchor);
        builder_.open(std::move(node));
    }

    std::string_view text_;
    Builder& builder_;
    Reporter& reporter_;
};

// Refuses a second document where it begins.
class SecondDocument : public YAML::EventHandler {
  public:
    explicit SecondDocument(const PlaceIndex& places) : places_(places) {}

    void OnDocumentStart(const YAML::Mark& mark) override {
        throw TextFault{places_.at(offset_of(mark)),
                        "text after the end of the document; a file has only one document"};
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

  private:
    const PlaceIndex& places_;
};

// The parser of nlohmann_json says where a token ends, by the characters that it has taken. Between
// two tokens are only spaces, commas and colons.
class JsonEvents : public nlohmann::json_sax<nlohmann::json> {
  public:
    // Counts what the parser takes.
    class Cursor {
      public:
        using iterator_category = std::input_iterator_tag;
        using value_type = char;
        using difference_type = std::ptrdiff_t;
        using pointer = const char*;
        using reference = const char&;

        Cursor(const char* at, const char** taken) : at_(at), taken_(taken) {}
        reference operator*() const { return *at_; }
        Cursor& operator++() {
            *taken_ = ++at_;
            return *this;
        }
        bool operator==(const Cursor& other) const { return at_ == other.at_; }

      private:
        const char* at_;
        const char** taken_;
    };

    JsonEvents(std::string_view text, const PlaceIndex& places, Builder& builder)
        : text_(text), places_(places), builder_(builder) {}

    // Why the text is not JSON.
    std::optional<TextFault> fault;

    bool parse() {
        const char* end = text_.data() + text_.size();
        return nlohmann::json::sax_parse(Cursor(text_.data(), &taken_), Cursor(end, &taken_), this);
    }

    bool null() override { return plain(TextNode::Kind::null); }
    bool boolean(bool) override { return plain(TextNode::Kind::scalar); }
    bool number_integer(int64_t) override { return plain(TextNode::Kind::scalar); }
    bool number_unsigned(uint64_t) override { return plain(TextNode::Kind::scalar); }
    bool number_float(double, const std::string&) override { return plain(TextNode::Kind::scalar); }
    bool string(std::string& value) override {
        TextNode node = builder_.start(next_token(), TextNode::Kind::scalar);
        node.text = std::move(value);
        node.quoted = true;
        builder_.attach(std::move(node));
        return true;
    }
    bool key(std::string& value) override { return string(value); }
    bool start_object(size_t) override { return open(TextNode::Kind::map); }
    bool end_object() override { return close(); }
    bool start_array(size_t) override { return open(TextNode::Kind::list); }
    bool end_array() override { return close(); }
    bool binary(nlohmann::json::binary_t&) override { return false; }  // not in a text
    bool parse_error(size_t position, const std::string&,
                     const nlohmann::json::exception& error) override {
        constexpr int kOutOfRange = 406;  // nlohmann_json's number of this error
        if (error.id == kOutOfRange)
            fault = {places_.at(next_token()), "a number is too large for a double"};
        else
            fault = {places_.at(position > 0 ? position - 1 : 0), "not valid JSON from here on"};
        return false;
    }

  private:
    // The parser has looked at the character behind a number.
    bool plain(TextNode::Kind kind) {
        const size_t begin = next_token();
        TextNode node = builder_.start(begin, kind);
        if (kind == TextNode::Kind::scalar) {
            const size_t end = text_.find_first_of(" \t\r\n,]}", begin);
            node.text = text_.substr(begin, end - begin);
        }
        builder_.attach(std::move(node));
        return true;
    }
    bool open(TextNode::Kind kind) {
        builder_.open(builder_.start(next_token(), kind));
        return true;
    }
    bool close() {
        next_token();
        builder_.close();
        return true;
    }

    // The offset of the token that the parser has read.
    size_t next_token() {
        const size_t begin = text_.find_first_not_of(" \t\r\n,:", end_);
        end_ = size_t(taken_ - text_.data());
        return begin;
    }

    std::string_view text_;
    const PlaceIndex& places_;
    Builder& builder_;
    const char* taken_ = text_.data();
    size_t end_ = 0;  // of the last token
};

// Reads a text, whose faults become diagnostics of the tree.
class TextReader {
  public:
    TextReader(std::string_view text, const std::string& file_name, StatusCode code,
               const TextLimits& limits)
        : text_(without_mark(text)),
          limits_(limits),
          reporter_(file_name, code, tree_.diagnostics) {}

    TextTree json() {
        read([&] {
            check();
            if (const auto fault = read_json()) throw *fault;
        });
        return std::move(tree_);
    }

    TextTree yaml_or_json() {
        read([&] {
            check();
            const size_t first = text_.find_first_not_of(" \t\r\n");
            if (first != text_.npos && (text_[first] == '{' || text_[first] == '[')) {
                const auto fault = read_json();
                if (!fault) return;
                if (text_.size() > kMaxYamlBytes) throw *fault;
                tree_.diagnostics.clear();
            }
            read_yaml();
        });
        return std::move(tree_);
    }

  private:
    static std::string_view without_mark(std::string_view text) {
        if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
        return text;
    }

    template <class Read>
    void read(const Read& steps) {
        try {
            steps();
        } catch (const TextFault& fault) {
            reporter_.add(Severity::error, fault.place.line, fault.place.column, "", fault.message);
            tree_.root = TextNode();
        }
    }

    void check() const {
        if (text_.size() > limits_.bytes)
            throw TextFault{{}, concat("larger than ", limits_.bytes, " bytes; shorten it")};
        if (const auto bad = find_bad_character(text_)) throw *bad;
    }

    std::optional<TextFault> read_json() {
        const PlaceIndex places(text_);
        Builder builder(places, limits_, reporter_);
        JsonEvents events(text_, places, builder);
        if (!events.parse()) return events.fault;
        tree_.root = std::move(builder.root);
        return std::nullopt;
    }

    void read_yaml() {
        if (text_.size() > kMaxYamlBytes)
            throw TextFault{{},
                            concat("larger than ", kMaxYamlBytes,
                                   " bytes of YAML; shorten it, or write it as JSON")};
        if (const auto large = find_large_flow(text_, limits_.depth, limits_.nodes)) throw *large;
        if (const auto directive = find_directive(text_))
            throw TextFault{*directive, "directives (%NAME) are not allowed; remove it"};
        const PlaceIndex places(text_);
        Builder builder(places, limits_, reporter_);
        YamlEvents events(text_, builder, reporter_);
        // yaml-cpp would read a final line end as the end of an open quote.
        const size_t end = text_.find_last_not_of(" \t\r\n") + 1;
        try {
            std::istringstream in{std::string(text_.substr(0, end))};
            YAML::Parser parser(in);
            const bool any = parser.HandleNextDocument(events);
            if ((!any || builder.root.is_null()) && !has_errors(tree_.diagnostics))
                throw TextFault{{}, "is empty; write the file's first key"};
            SecondDocument second(places);
            parser.HandleNextDocument(second);
        } catch (const YAML::Exception& error) {
            throw TextFault{places.at(offset_of(error.mark)), "not YAML or JSON: " + error.msg};
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& error) {  // from the standard library
            throw TextFault{{}, std::string("cannot be read: ") + error.what()};
        }
        tree_.root = std::move(builder.root);
    }

    std::string_view text_;
    const TextLimits& limits_;
    TextTree tree_;
    Reporter reporter_;
};

}  // namespace

TextTree read_text_tree(std::string_view text, const std::string& file_name, StatusCode code,
                        const TextLimits& limits) {
    return TextReader(text, file_name, code, limits).yaml_or_json();
}

TextTree read_json_tree(std::string_view text, const std::string& file_name, StatusCode code,
                        const TextLimits& limits) {
    return TextReader(text, file_name, code, limits).json();
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
