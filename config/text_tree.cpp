#include "config/text_tree.h"

#include <unistd.h>
#include <yaml.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "chain/base/readable_file.h"
#include "chain/base/stop.h"
#include "config/reporter.h"
#include "config/text_check.h"

namespace postchain {
namespace {

// Builds the tree from the events of a parser. Throws a TextFault to stop it.
class Builder {
  public:
    Builder(const TextLimits& limits, Reporter& reporter) : limits_(limits), reporter_(reporter) {}

    TextNode root;

    TextNode start(TextPlace place, TextNode::Kind kind) {
        if (++nodes_ > limits_.nodes)
            throw TextFault{place, concat("more than ", limits_.nodes, " values; shorten it")};
        if (is_stopped()) throw TextFault{place, stopped_status().message()};
        if (reporter_.full()) throw TextFault{place, "too many errors"};  // not shown either
        TextNode node;
        node.kind = kind;
        node.line = place.line;
        node.column = place.column;
        return node;
    }

    void open(TextNode node) {
        if (int(stack_.size()) >= limits_.depth)
            throw TextFault{{node.line, node.column},
                            concat("nested deeper than ", limits_.depth, " levels")};
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

    const TextLimits& limits_;
    Reporter& reporter_;
    size_t nodes_ = 0;
    std::vector<Level> stack_;
};

// The parser of libyaml, event by event.
class YamlParser {
  public:
    YamlParser(std::string_view text, Builder& builder, Reporter& reporter)
        : text_(text), builder_(builder), reporter_(reporter) {
        if (!yaml_parser_initialize(&parser_)) throw std::bad_alloc();
        yaml_parser_set_encoding(&parser_, YAML_UTF8_ENCODING);
        yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()),
                                     text.size());
    }
    YamlParser(const YamlParser&) = delete;
    YamlParser& operator=(const YamlParser&) = delete;
    ~YamlParser() { yaml_parser_delete(&parser_); }

    void parse() {
        for (yaml_event_type_t type = YAML_NO_EVENT; type != YAML_STREAM_END_EVENT;) {
            yaml_event_t event;
            if (!yaml_parser_parse(&parser_, &event)) throw_fault();
            const std::unique_ptr<yaml_event_t, void (*)(yaml_event_t*)> owner(&event,
                                                                               yaml_event_delete);
            type = event.type;
            take(event);
        }
    }

  private:
    static TextPlace place_of(const yaml_mark_t& mark) {
        return {int(mark.line) + 1, int(mark.column) + 1};
    }

    [[noreturn]] void throw_fault() const {
        if (parser_.error == YAML_MEMORY_ERROR) throw std::bad_alloc();
        TextPlace place = parser_.error == YAML_READER_ERROR
                              ? place_at(text_, parser_.problem_offset)
                              : place_of(parser_.problem_mark);
        // A list, map or string without its end is reported where it begins.
        const TextPlace end = place_at(text_, text_.find_last_not_of(" \t\r\n") + 1);
        if (parser_.context && place >= end) place = std::min(place_of(parser_.context_mark), end);
        throw TextFault{place, concat("not YAML or JSON: ", parser_.context ? parser_.context : "",
                                      parser_.context ? ", " : "", parser_.problem)};
    }

    void take(const yaml_event_t& event) {
        const auto& data = event.data;
        switch (event.type) {
            case YAML_DOCUMENT_START_EVENT:
                if (++documents_ > 1)
                    throw TextFault{place_of(event.start_mark),
                                    "text after the end of the document; a file has only one "
                                    "document"};
                break;
            case YAML_ALIAS_EVENT:
                builder_.attach(start(event, TextNode::Kind::null, nullptr, nullptr));
                break;
            case YAML_SCALAR_EVENT:
                scalar(event);
                break;
            case YAML_SEQUENCE_START_EVENT:
                builder_.open(start(event, TextNode::Kind::list, data.sequence_start.anchor,
                                    data.sequence_start.tag));
                break;
            case YAML_MAPPING_START_EVENT:
                builder_.open(start(event, TextNode::Kind::map, data.mapping_start.anchor,
                                    data.mapping_start.tag));
                break;
            case YAML_SEQUENCE_END_EVENT:
            case YAML_MAPPING_END_EVENT:
                builder_.close();
                break;
            default:
                break;
        }
    }

    void scalar(const yaml_event_t& event) {
        const auto& data = event.data.scalar;
        std::string text(reinterpret_cast<const char*>(data.value), data.length);
        const bool plain = data.style == YAML_PLAIN_SCALAR_STYLE;
        const bool null = plain && (text.empty() || text == "~" || text == "null");
        TextNode node = start(event, null ? TextNode::Kind::null : TextNode::Kind::scalar,
                              data.anchor, data.tag);
        if (!null) node.text = std::move(text);
        node.quoted = !plain;
        builder_.attach(std::move(node));
    }

    TextNode start(const yaml_event_t& event, TextNode::Kind kind, const yaml_char_t* anchor,
                   const yaml_char_t* tag) {
        TextNode node = builder_.start(place_of(event.start_mark), kind);
        if (event.type == YAML_ALIAS_EVENT)
            reporter_.error(node, "", "aliases (*name) are not allowed; write the value again");
        if (anchor)
            reporter_.error(node, "", "anchors (&name) are not allowed; write the value again");
        if (tag) reporter_.error(node, "", "tags (!name) are not allowed; quote a string instead");
        return node;
    }

    std::string_view text_;
    Builder& builder_;
    Reporter& reporter_;
    yaml_parser_t parser_;
    int documents_ = 0;
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

    JsonEvents(std::string_view text, Builder& builder) : text_(text), builder_(builder) {}

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
            fault = {next_token(), "a number is too large for a double"};
        else
            fault = {place_at(text_, position > 0 ? position - 1 : 0, begin_, place_),
                     "not valid JSON from here on"};
        return false;
    }

  private:
    // The parser has looked at the character behind a number.
    bool plain(TextNode::Kind kind) {
        TextNode node = builder_.start(next_token(), kind);
        if (kind == TextNode::Kind::scalar) {
            const size_t end = text_.find_first_of(" \t\r\n,]}", begin_);
            node.text = text_.substr(begin_, end - begin_);
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

    // The place of the token that the parser has read.
    TextPlace next_token() {
        const size_t begin = text_.find_first_not_of(" \t\r\n,:", end_);
        place_ = place_at(text_, begin, begin_, place_);
        begin_ = begin;
        end_ = size_t(taken_ - text_.data());
        return place_;
    }

    std::string_view text_;
    Builder& builder_;
    const char* taken_ = text_.data();
    // The last token.
    TextPlace place_;
    size_t begin_ = 0;
    size_t end_ = 0;
};

// Reads a text, whose faults become diagnostics of the tree.
class TextReader {
  public:
    TextReader(std::string_view text, const std::string& file_name, StatusCode code,
               const TextLimits& limits)
        : text_(without_mark(text)),
          limits_(limits),
          reporter_(file_name, code, tree_.diagnostics) {}

    TextTree read(bool only_json) {
        try {
            read_or_throw(only_json);
        } catch (const TextFault& fault) {
            reporter_.add(Severity::error, fault.place.line, fault.place.column, "", fault.message);
            tree_.root = TextNode();
        }
        return std::move(tree_);
    }

  private:
    static std::string_view without_mark(std::string_view text) {
        if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
        return text;
    }

    void read_or_throw(bool only_json) {
        if (text_.size() > limits_.bytes)
            throw TextFault{{}, concat("larger than ", limits_.bytes, " bytes; shorten it")};
        if (const auto bad = find_bad_character(text_)) throw *bad;
        const size_t first = text_.find_first_not_of(" \t\r\n");
        const bool begins_as_json =
            first != text_.npos && (text_[first] == '{' || text_[first] == '[');
        if (only_json || begins_as_json) {
            const auto fault = read_json();
            if (!fault) return;
            if (only_json) throw *fault;
            tree_.diagnostics.clear();
        }
        read_yaml();
    }

    std::optional<TextFault> read_json() {
        Builder builder(limits_, reporter_);
        JsonEvents events(text_, builder);
        if (!events.parse()) return events.fault;
        tree_.root = std::move(builder.root);
        return std::nullopt;
    }

    // Before libyaml, whose time grows with the square of their number. It ends lines at these.
    void refuse_directives() const {
        for (size_t at = text_.find('%'); at != text_.npos; at = text_.find('%', at + 1)) {
            const std::string_view before = text_.substr(0, at);
            if (before.empty() || before.ends_with('\n') || before.ends_with('\r') ||
                before.ends_with("\u2028") || before.ends_with("\u2029"))
                throw TextFault{place_at(text_, at),
                                "directives (%NAME) are not allowed; remove it"};
        }
    }

    void read_yaml() {
        refuse_directives();
        Builder builder(limits_, reporter_);
        YamlParser(text_, builder, reporter_).parse();
        if (builder.root.is_null() && !has_errors(tree_.diagnostics))
            throw TextFault{{}, "is empty; write the file's first key"};
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
    return TextReader(text, file_name, code, limits).read(false);
}

TextTree read_json_tree(std::string_view text, const std::string& file_name, StatusCode code,
                        const TextLimits& limits) {
    return TextReader(text, file_name, code, limits).read(true);
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
