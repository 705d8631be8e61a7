// A header leads to its source: what x.cpp defines for others, x.h beside it declares, and x.cpp
// includes it first (so that every header is compiled on its own). A program's main.cpp exports
// nothing and has none.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = POSTCHAIN_SOURCE_DIR;

std::vector<std::string> lines_of(const fs::path& file) {
    std::vector<std::string> lines;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

// The first quoted or angled include; empty: none.
std::string first_include(const std::vector<std::string>& lines) {
    static const std::regex pattern(R"re(^#include [<"]([^>"]+)[>"])re");
    std::smatch match;
    for (const auto& line : lines)
        if (std::regex_search(line, match, pattern)) return match[1];
    return "";
}

// What a source defines for others: names of functions, and of classes whose members it defines,
// at the beginning of a line (clang-format sees to that) and outside an unnamed namespace.
std::vector<std::string> exports_of(const std::vector<std::string>& lines) {
    static const std::regex member(R"re(^[A-Za-z][^(=]*?\b([A-Z]\w*)(<\w+>)?::~?\w+\()re");
    static const std::regex function(R"re(^[A-Za-z][^(=]*?[ *&](\w+)\()re");
    std::vector<std::string> names;
    bool hidden = false;
    for (const auto& line : lines) {
        if (line == "namespace {") hidden = true;
        if (line == "}  // namespace") hidden = false;
        // A definition opens a block or goes on in the next line; it is never a single statement.
        if (hidden || line.empty() || line.back() == ';' || line.starts_with("static ")) continue;
        std::smatch match;
        const bool found =
            std::regex_search(line, match, member) || std::regex_search(line, match, function);
        if (found && match[1] != "operator" && match[1] != "main") names.push_back(match[1]);
    }
    return names;
}

bool has_word(const std::vector<std::string>& lines, const std::string& word) {
    const std::regex pattern("\\b" + word + "\\b");
    for (const auto& line : lines)
        if (std::regex_search(line, pattern)) return true;
    return false;
}

// What is wrong with a source, given its header's lines; one line each.
std::vector<std::string> faults_of(const std::string& file, const std::vector<std::string>& source,
                                   const std::vector<std::string>& header) {
    const std::string own = file.substr(0, file.size() - 3) + "h";
    if (header.empty()) return {"has no header " + own};
    std::vector<std::string> faults;
    // A sample builds outside this tree too, and names what lies beside it by its name alone.
    const std::string named =
        file.starts_with("tools/samples/") ? fs::path(own).filename().string() : own;
    if (first_include(source) != named) faults.push_back("does not include its header first");
    for (const auto& name : exports_of(source))
        if (!has_word(header, name))
            faults.push_back("defines " + name + ", not declared in " + own);
    return faults;
}

TEST(HeaderSource, EverySourceHasTheHeaderThatDeclaresIt) {
    size_t count = 0, exported = 0;
    for (const char* top : {"chain", "passes", "config", "tools", "tests/support"}) {
        for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
            const fs::path& path = entry.path();
            if (path.extension() != ".cpp" || path.filename() == "main.cpp") continue;
            const std::string file = fs::relative(path, kRoot).string();
            const auto source = lines_of(path);
            const auto header = lines_of(fs::path(path).replace_extension(".h"));
            for (const auto& fault : faults_of(file, source, header))
                ADD_FAILURE() << file << ": " << fault;
            ++count;
            exported += exports_of(source).size();
        }
    }
    EXPECT_GT(count, 100u) << "the walk found too little to mean anything";
    EXPECT_GT(exported, 400u);
}

TEST(HeaderSource, FaultsAreSeen) {
    const std::vector<std::string> source = {
        "#include \"chain/a.h\"",
        "",
        "namespace {",
        "int hidden() {",
        "}  // namespace",
        "Result<int> Known::ask(int a) const {",
        "const std::map<int, int>& exported(int a,",
        "                                   int b) {",
    };
    const std::vector<std::string> header = {"class Known;", "exported();"};
    EXPECT_TRUE(faults_of("chain/a.cpp", source, header).empty());
    EXPECT_EQ(faults_of("chain/a.cpp", source, {"class Known;"}).size(), 1u);
    EXPECT_EQ(faults_of("chain/a.cpp", source, {"exported();"}).size(), 1u);
    EXPECT_EQ(faults_of("chain/b.cpp", source, header).size(), 1u);
    EXPECT_EQ(faults_of("chain/a.cpp", source, {}).size(), 1u);
    EXPECT_EQ(faults_of("tools/samples/b/a.cpp", {"#include \"a.h\""}, {"//"}).size(), 0u);
    EXPECT_EQ(faults_of("tools/samples/b/a.cpp", {"#include \"chain/a.h\""}, {"//"}).size(), 1u);
}

}  // namespace
