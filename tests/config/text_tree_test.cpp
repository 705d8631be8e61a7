// Strict reading of YAML and JSON.
#include "config/text_tree.h"
#include "config/scalar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdio>
#include <thread>

#include "chain/base/stop.h"
#include "fake_passes.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain {
namespace {

using test::texts;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<std::string> errors_of(const std::string& text) {
    return texts(read_text_tree(text, "t").diagnostics);
}

TEST(TextTree, ReadsYamlAndJsonAlike) {
    const TextTree yaml = read_text_tree("a: 1\nb:\n  - x\n  - {c: true}\n", "t");
    const TextTree json = read_text_tree(R"({"a": 1, "b": ["x", {"c": true}]})", "t");
    for (const TextTree* tree : {&yaml, &json}) {
        EXPECT_THAT(texts(tree->diagnostics), IsEmpty());
        ASSERT_EQ(tree->root.entries.size(), 2u);
        EXPECT_EQ(*value_of(*tree->root.find("a")), ParameterValue(int64_t(1)));
        const TextNode& list = *tree->root.find("b");
        ASSERT_EQ(list.items.size(), 2u);
        EXPECT_EQ(list.items[0].text, "x");
        EXPECT_EQ(*value_of(*list.items[1].find("c")), ParameterValue(true));
    }
}

// All of a node, in the order of the text.
std::string told(const TextNode& node) {
    std::string text = concat(int(node.kind), node.quoted, " '", node.text, "' ", node.line, ":",
                              node.column, " (");
    for (const TextNode& item : node.items) text += told(item);
    for (const TextEntry& entry : node.entries) text += told(entry.key) + told(entry.value);
    return text + ")";
}

TEST(TextTree, ReadsLineEndsOfWindows) {
    for (const std::string text :
         {"a: 1\nb:\n  - x\n  - {c: true,\n     d: 2}\n# end\ne: word\nf: 0.5\n",
          "{\n \"a\": 1,\n \"b\": [\n  true,\n  -2.5\n ],\n \"c\": {\n  \"d\": \"e\",\n  \"f\": "
          "null\n },\n \"g\": 3\n}\n"}) {
        std::string other;
        for (const char c : text) other += c == '\n' ? "\r\n" : std::string(1, c);
        const TextTree plain = read_text_tree(text, "t"), windows = read_text_tree(other, "t");
        EXPECT_THAT(texts(plain.diagnostics), IsEmpty());
        EXPECT_THAT(texts(windows.diagnostics), IsEmpty());
        EXPECT_EQ(told(windows.root), told(plain.root));
    }
}

TEST(TextTree, ReadsJsonWithTabsEscapesAndNoSpaces) {
    const TextTree tree = read_text_tree("{\n\t\"a\":1,\n\t\"b\":\"q\\\"\\u0041\\/\\n\"}", "t");
    EXPECT_THAT(texts(tree.diagnostics), IsEmpty());
    EXPECT_EQ(tree.root.find("b")->text, "q\"A/\n");
    // Beyond 16 bits: U+1F600 is F0 9F 98 80 in UTF-8.
    const TextTree pair = read_text_tree(R"({"a": "x\ud83d\uDE00y", "b": "\\ud83d", "c": 1})", "t");
    EXPECT_THAT(texts(pair.diagnostics), IsEmpty());
    EXPECT_EQ(pair.root.find("a")->text, "x\xf0\x9f\x98\x80y");
    EXPECT_EQ(pair.root.find("b")->text, "\\ud83d");
    for (const char* half :
         {R"({"a": "\ud83d"})", R"({"a": "\ude00\ud83d"})", R"({"a": "\\ud83d\ude00"})"})
        EXPECT_THAT(errors_of(half), SizeIs(1)) << half;
}

TEST(TextTree, CountsLinesAndColumnsInCharacters) {
    // The key after the two-byte e-acute is at column 9, not 10.
    const TextTree tree = read_text_tree("# c\n{a: '\xc3\xa9', b: [1,\n  2]}\n", "t");
    ASSERT_THAT(texts(tree.diagnostics), IsEmpty());
    EXPECT_EQ(tree.root.line, 2);
    EXPECT_EQ(tree.root.entries[1].key.line, 2);
    EXPECT_EQ(tree.root.entries[1].key.column, 10);
    EXPECT_EQ(tree.root.find("b")->items[1].line, 3);
    EXPECT_EQ(tree.root.find("b")->items[1].column, 3);
    // Without the byte order mark.
    const TextNode marked = read_text_tree("\xef\xbb\xbf\x61: 1", "t").root;
    EXPECT_EQ(marked.entries[0].key.column, 1);
    EXPECT_EQ(marked.entries[0].key.text, "a");
    std::string text = "{";
    for (int i = 0; i < 255; ++i) text += concat("some_key_", i, ": 0, ");
    const TextNode far = read_text_tree(text + "z: 1}", "t").root;
    EXPECT_EQ(far.entries.back().key.column, int(text.size() + 1));
}

TEST(TextTree, RefusesWhatHasNoOneMeaning) {
    const std::pair<const char*, std::vector<const char*>> cases[] = {
        {"a: 1\nb: 2\na: 3\n", {"3:1: error: duplicate key 'a'; it is already given in line 1"}},
        {R"({"x": {"a": 1, "a": 1}})", {"1:16: error: duplicate key 'a'"}},
        {"a: &x 1\nb: *x\n", {"1:4: error: anchors (&name) are", "2:4: error: aliases (*name)"}},
        {"a: &x {c: 1}\nb: {<<: *x}\n",
         {"1:4: error: anchors", "2:9: error: aliases", "2:5: error: merge keys"}},
        {"a: *nowhere\n", {"1:4: error:"}},
        {"a: !!int 5\n", {"1:4: error: tags"}},
        {"a: !mine [1]\n", {"1:4: error: tags"}},
        {"a: ! 5\n", {"1:4: error: tags"}},
        {"a: '!x &y *z <<'\n'<<': 1\n", {}},
        {"a: 1\n---\nb: 2\n", {"only one document"}},
        {R"({"a": 1} {"b": 2})", {"1:10: error"}},
        {"---\na: 1\n...\n", {}},
        {"%YAML 1.2\n---\na: 1\n", {"1:1: error: directives (%NAME) are not allowed; remove it"}},
        {"a: 1\n...\n%TAG !a! b\n", {"3:1: error: directives (%NAME)"}},
        {"# \u2028%TAG !a! b", {"1:4: error: directives (%NAME)"}},
        {"a: 50 %\n", {}},
        {"a: [1, 2\n", {"1:4: error: not YAML or JSON"}},
        {"a: 1\n b: 2\n", {"t:2:"}},
        {"\"a: 1\n",
         {"1:1: error: not YAML or JSON: while scanning a quoted scalar, found unexpected end"}},
        {"a: 'b\n",
         {"1:4: error: not YAML or JSON: while scanning a quoted scalar, found unexpected end of "
          "stream"}},
        {"a: \"b\n\n", {"found unexpected end of stream"}},
        {"{[1]: 2}", {"a key is a word, not a list"}},
        {"&x ~\n", {"1:1: error: anchors"}}};
    for (const auto& [text, expected] : cases) {
        const auto errors = errors_of(text);
        ASSERT_EQ(errors.size(), expected.size()) << text;
        for (size_t i = 0; i < errors.size(); ++i)
            EXPECT_THAT(errors[i], HasSubstr(expected[i])) << text;
    }
}

TEST(TextTree, NamesAnEmptyFile) {
    for (const char* text : {"", "\n \n", "# nothing\n", "---\n", "\xef\xbb\xbf", "null", "~"})
        EXPECT_THAT(errors_of(text),
                    ElementsAre("t:1:1: error: is empty; write the file's first key"))
            << "'" << text << "'";
}

TEST(TextTree, RefusesWhatIsNotUtf8) {
    EXPECT_THAT(errors_of("a: 1\nb: \xff\n"), ElementsAre("t:2:4: error: byte 0xff is not UTF-8"));
    EXPECT_THAT(errors_of("b: \xe9t\xe9"), ElementsAre(HasSubstr("byte 0xe9 is not UTF-8")));
    // Overlong '/', a surrogate, above U+10FFFF, cut off, without a third or a fourth byte.
    for (const char* bad : {"\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82", "\x80",
                            "\xf0\x9f\x41\x80", "\xf0\x9f\x98\x41"})
        EXPECT_THAT(errors_of(concat("a: ", bad)), ElementsAre(HasSubstr("is not UTF-8")));
    for (const char* good : {"\xc2\xa0", "\xed\x9f\xbf", "\xf4\x8f\xbf\xbf", "\xe2\x82\xac"})
        EXPECT_THAT(errors_of(concat("a: 'x", good, "'")), IsEmpty());
    // UTF-16 starts with a byte order mark that is not UTF-8, or contains zero bytes.
    EXPECT_THAT(errors_of(std::string("\xff\xfe\x61\0", 4)), SizeIs(1));
    EXPECT_THAT(errors_of(std::string("a\0:\0", 4)),
                ElementsAre(HasSubstr("control character 0x00")));
    EXPECT_THAT(errors_of("a: \xc2\x9f"),
                ElementsAre("t:1:4: error: control character 0x9f is not allowed"));
}

TEST(TextTree, RefusesTooMuchText) {
    const auto spaces = [](size_t bytes) { return std::string(bytes, ' '); };
    EXPECT_THAT(errors_of(spaces((size_t(1) << 20) + 1)),
                ElementsAre("t:1:1: error: larger than 1048576 bytes; shorten it"));
    EXPECT_THAT(errors_of("a: 1" + spaces((size_t(1) << 20) - 4)), IsEmpty());
}

// "k0: 1", "k1: 1" and so on, with `end` behind each.
std::string entries(size_t count, const std::string& quote, const std::string& end) {
    std::string text;
    for (size_t i = 0; i < count; ++i)
        text += concat(quote, "k", i, quote, ": 1", i + 1 < count ? end : "");
    return text;
}

TEST(TextTree, LimitsTheKeysOfAMap) {
    EXPECT_THAT(errors_of(entries(256, "", "\n")), IsEmpty());
    EXPECT_THAT(errors_of(entries(257, "", "\n")),
                ElementsAre("t:257:1: error: more than 256 keys in one map; remove some"));
    EXPECT_THAT(errors_of("{" + entries(256, "\"", ",\n") + "}"), IsEmpty());
    EXPECT_THAT(errors_of("{" + entries(257, "\"", ",\n") + "}"),
                ElementsAre("t:257:1: error: more than 256 keys in one map; remove some"));
    // Each map has its own.
    EXPECT_THAT(errors_of("[{" + entries(256, "\"", ",") + "}, {" + entries(256, "\"", ",") + "}]"),
                IsEmpty());
}

TEST(TextTree, FramesOfACameraAreNotCountedAsKeys) {
    std::string frames;
    for (int frame = -200; frame < 200; ++frame) frames += concat("\"", frame, "\": {},");
    const std::string text = "{" + frames + entries(256, "\"", ",") + "}";
    const TextLimits of_camera = {.frame_keys = true};
    const auto errors = [&](const std::string& given, const TextLimits& limits) {
        return texts(read_text_tree(given, "t", StatusCode::input, limits).diagnostics);
    };
    EXPECT_THAT(errors(text, of_camera), IsEmpty());
    EXPECT_THAT(errors(text, {}), SizeIs(1));
    for (const char* word : {"-", "1a", "1.5", "k"})
        EXPECT_THAT(errors(text.substr(0, text.size() - 1) + ", \"" + word + "\": 1}", of_camera),
                    ElementsAre(HasSubstr("more than 256 keys")))
            << word;
}

TEST(TextTree, LimitsTheValues) {
    const auto list = [](size_t items, const std::string& item) {
        std::string text;
        for (size_t i = 0; i + 1 < items; ++i) text += item + ",";
        return text + item;
    };
    // With the map, its key and the list.
    EXPECT_THAT(errors_of("{\"a\": [" + list(19'997, "1") + "]}"), IsEmpty());
    EXPECT_THAT(errors_of("{\"a\": [" + list(19'998, "1") + "]}"),
                ElementsAre("t:1:40002: error: more than 20000 values; shorten it"));
    EXPECT_THAT(errors_of("a: [" + list(19'997, "x") + "]"), IsEmpty());
    EXPECT_THAT(errors_of("a: [" + list(20'001, "x") + "]"),
                ElementsAre(HasSubstr("more than 20000 values; shorten it")));
    std::string block = "a:\n";
    for (int i = 0; i < 19'997; ++i) block += "- x\n";
    EXPECT_THAT(errors_of(block), IsEmpty());
    EXPECT_THAT(errors_of(block + "- x\n"),
                ElementsAre("t:19999:3: error: more than 20000 values; shorten it"));
    EXPECT_THAT(errors_of("[" + list(7'000, "[[x]]") + "]"),
                ElementsAre("t:1:39999: error: more than 20000 values; shorten it"));
}

TEST(TextTree, StopsWhenNobodyWaits) {
    std::atomic<bool> stop = false;
    const StopFlag scope(&stop);
    for (const char* text : {"a: 1\n", "{\"a\": 1}"}) {
        stop = false;
        EXPECT_THAT(errors_of(text), IsEmpty());
        stop = true;
        EXPECT_THAT(errors_of(text), ElementsAre(HasSubstr("nobody waits"))) << text;
    }
}

// Places, kinds and texts of values as they are written, by the parser of JSON.
TEST(TextTree, JsonKeepsPlacesAndTexts) {
    const TextTree tree = read_json_tree(
        "{\"a\" :\t1.50,\n \"\xc3\xa9\\n\": [true ,null,-0,\"1\"] , \"b\":{\"c\":[]},\"d\":12}",
        "t", StatusCode::usage);
    ASSERT_THAT(texts(tree.diagnostics), IsEmpty());
    const auto shown = [](const TextNode& node) {
        return concat(node.line, ":", node.column, " ", node.describe());
    };
    std::vector<std::string> found;
    for (const auto& [key, value] : tree.root.entries) {
        found.push_back(shown(key));
        found.push_back(shown(value));
        for (const TextNode& item : value.items) found.push_back(shown(item));
    }
    EXPECT_THAT(found,
                ElementsAre("1:2 'a' (quoted, so a string)", "1:8 '1.50'",
                            "2:2 '\xc3\xa9\n' (quoted, so a string)", "2:9 a list", "2:10 'true'",
                            "2:16 nothing", "2:21 '-0'", "2:24 '1' (quoted, so a string)",
                            "2:31 'b' (quoted, so a string)", "2:35 a map",
                            "2:44 'd' (quoted, so a string)", "2:48 '12'"));
    EXPECT_EQ(shown(*tree.root.find("b")->find("c")), "2:40 a list");
}

TEST(TextTree, YamlIsNoJson) {
    const auto errors = [](const std::string& text) {
        return texts(read_json_tree(text, "t", StatusCode::usage).diagnostics);
    };
    EXPECT_THAT(errors("{\"a\": 1}"), IsEmpty());
    EXPECT_THAT(errors("{\"a\":\n x}"), ElementsAre("t:2:2: error: not valid JSON from here on"));
    EXPECT_THAT(errors("{\"a\": 1} 2"), ElementsAre("t:1:10: error: not valid JSON from here on"));
    EXPECT_THAT(errors("{\"a\": 1e999}"),
                ElementsAre("t:1:7: error: a number is too large for a double"));
    EXPECT_THAT(errors("{\"a\": 1, \"a\": 2}"), ElementsAre(HasSubstr("duplicate key 'a'")));
    EXPECT_THAT(errors(""), SizeIs(1));
}

TEST(TextTree, RefusesAMegabyteOfNesting) {
    const auto repeat = [](const std::string& what) {
        std::string text;
        while (text.size() + what.size() <= size_t(1) << 20) text += what;
        return text;
    };
    EXPECT_THAT(errors_of(repeat("[")), ElementsAre("t:1:33: error: nested deeper than 32 levels"));
    for (const char* what : {"[", "{", "[{", "{a: ", "{a: [", "- ", "? ", "[\n", "- - "})
        EXPECT_THAT(errors_of(repeat(what)), ElementsAre(HasSubstr("error:"))) << what;
    EXPECT_THAT(errors_of("# one\n" + repeat("[").substr(6)),
                ElementsAre("t:2:33: error: nested deeper than 32 levels"));
    EXPECT_THAT(errors_of("[a # no end"), ElementsAre(HasSubstr("error:")));
    // Brackets behind a quote, and one level of indentation per line.
    EXPECT_THAT(errors_of("[a ' , " + repeat("[").substr(20)), ElementsAre(HasSubstr("deeper")));
    std::string steps;
    for (int i = 0; i < 600; ++i) steps += std::string(size_t(i), ' ') + "a:\n";
    EXPECT_THAT(errors_of(steps), ElementsAre("t:33:33: error: nested deeper than 32 levels"));
}

TEST(TextTree, AllowsNestingUpToTheLimit) {
    const std::string open(100, '[');
    EXPECT_THAT(errors_of(std::string(33, '[') + "1" + std::string(33, ']')), SizeIs(1));
    // Brackets in quotes and comments are text.
    for (const std::string& good :
         {std::string(32, '[') + "1" + std::string(32, ']'),
          "# " + open + "\na: \"" + open + "\"\n", "a: \"\\\" " + open + "\"\n"})
        EXPECT_THAT(errors_of(good), IsEmpty()) << good;
}

TEST(TextTree, LimitsTheNumberOfErrors) {
    std::string text;
    for (int i = 0; i < 5000; ++i) text += "a: 1\n";
    EXPECT_THAT(errors_of(text), SizeIs(101));
    EXPECT_THAT(errors_of(text).back(), HasSubstr("too many errors"));
}

ParameterValue plain(const std::string& text) {
    const auto value = value_of_plain_text(text);
    return value.ok() ? *value : ParameterValue("refused: " + value.status().message());
}

TEST(Scalar, ReadsNumbersBooleansAndWords) {
    const std::pair<const char*, ParameterValue> values[] = {
        {"25", int64_t(25)},
        {"-0", int64_t(0)},
        {"+7", int64_t(7)},
        {"-9223372036854775808", std::numeric_limits<int64_t>::min()},
        {"9223372036854775808", 9223372036854775808.0},
        {".5", 0.5},
        {"5.", 5.0},
        {"+1.5e+3", 1500.0},
        {"-1E-2", -0.01},
        {"25.0", 25.0},
        {"true", true},
        {"false", false},
        {"null", ParameterValue()}};
    for (const auto& [text, value] : values) EXPECT_EQ(plain(text), value) << text;
    for (const char* word :
         {"yes",   "no",    "on",   "off",   "True",  "FALSE", "Null", "guertin", "1,5", "1.2.3",
          "12abc", "e5",    ".",    "-",     "+",     "1e",    "0x",   "--1",     "+-1", "_1",
          "0x1F",  "-0x10", "0o17", "0b101", "1_000", ".inf",  "-inf", "NaN"})
        EXPECT_EQ(plain(word), ParameterValue(std::string(word))) << word;
}

TEST(Scalar, RefusesNumbersInForbiddenForms) {
    for (const char* bad : {"010", "-007", "00.5", "[1, 010]", "1e999", "-1e999"})
        EXPECT_THAT(text_of(plain(bad)), HasSubstr("refused:")) << bad;
}

TEST(Scalar, TakesQuotedNumbersForText) {
    const TextTree tree = read_text_tree("{a: \"25\", b: '0x1', c: \"true\"}", "t");
    EXPECT_EQ(*value_of(*tree.root.find("a")), ParameterValue(std::string("25")));
    EXPECT_EQ(*value_of(*tree.root.find("b")), ParameterValue(std::string("0x1")));
    EXPECT_EQ(*value_of(*tree.root.find("c")), ParameterValue(std::string("true")));
}

TEST(Scalar, WritesWhatItReadsBack) {
    std::vector<ParameterValue> values = {{}, true, int64_t(-3), 0.1, 1e300, 5e-324};
    for (const char* text : {"guertin", "25", "true", "a: b", "", "no\n\"\\ #", "on"})
        values.push_back(std::string(text));
    for (const auto& value : values) {
        const TextTree tree = read_text_tree("a: " + yaml_text_of(value), "t");
        ASSERT_THAT(texts(tree.diagnostics), IsEmpty()) << yaml_text_of(value);
        EXPECT_EQ(*value_of(*tree.root.find("a")), value) << yaml_text_of(value);
    }
}

TEST(Scalar, QuotesWordsThatAnotherReaderTakesForValues) {
    for (const char* word : {"yes", "Yes", "NO", "Off", "on", "True", "Null", "NaN", "Y", "n"})
        EXPECT_EQ(yaml_text_of(std::string(word)), concat('"', word, '"'));
    for (const char* word : {"yesterday", "none", "only", "x"})
        EXPECT_EQ(yaml_text_of(std::string(word)), word);
}

// Files of sizes from one block to beyond the limit, and a pipe.
TEST(TextFile, IsReadToItsEndOrToItsLimit) {
    const test::TempFolder folder;
    const std::string path = folder.path("text");
    const TextLimits limits = {20000, 8};
    for (const size_t size : {0, 1, 4095, 4096, 4097, 19999, 20000, 20001, 50000}) {
        std::string text;
        while (text.size() < size) text += char('a' + text.size() % 23);
        test::write_text(path, text);
        const auto read = read_text_file(path, StatusCode::chain, limits);
        ASSERT_TRUE(read.ok()) << size;
        EXPECT_EQ(*read, text.substr(0, 20001)) << size;
    }
    std::remove(path.c_str());
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    const std::string text(15000, 'p');
    std::thread writer([&] { test::write_text(path, text); });
    const auto read = read_text_file(path, StatusCode::chain, limits);
    writer.join();
    std::remove(path.c_str());
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(*read, text);
}

}  // namespace
}  // namespace postchain
