// A header leads to its source: x.h declares what x.cpp exports, and x.cpp includes x.h first (so
// that every header compiles on its own). A program's main.cpp exports nothing and has no header.
// One header declares all subcommands of the command.
#include <gtest/gtest.h>

#include <regex>

#include "tests/structure/files.h"

namespace postchain::header_source_test {
namespace {

using namespace structure;
namespace fs = std::filesystem;

// The first quoted or angled include; empty = none.
std::string first_include(const std::vector<std::string>& lines) {
    static const std::regex pattern(R"re(^#include [<"]([^>"]+)[>"])re");
    std::smatch match;
    for (const auto& line : lines)
        if (std::regex_search(line, match, pattern)) return match[1];
    return "";
}

// Exports of a source: functions, and classes whose members it defines, at the beginning of a line
// (as clang-format formats them) and outside an unnamed namespace.
std::vector<std::string> exports_of(const std::vector<std::string>& lines) {
    static const std::regex member(R"re(^[A-Za-z][^(=]*?\b([A-Z]\w*)(<\w+>)?::~?\w+\()re");
    static const std::regex function(R"re(^[A-Za-z][^(=]*?[ *&](\w+)\()re");
    std::vector<std::string> names;
    bool hidden = false;
    for (const auto& line : lines) {
        if (line == "namespace {") hidden = true;
        if (line == "}  // namespace") hidden = false;
        // A definition opens a block or continues on the next line; it never ends in a semicolon.
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

// The header that declares what a source exports: the one of its name, or for a subcommand without
// one the header of all. Two libraries have the functions of postchain.h. x_windows.cpp replaces
// x.cpp.
std::string header_of(const std::string& file) {
    if (file == "chain/guest/chain_interface.cpp") return "chain/guest/postchain.h";
    const std::string stem = file.substr(0, file.size() - 4), suffix = "_windows";
    const std::string own =
        (stem.ends_with(suffix) ? stem.substr(0, stem.size() - suffix.size()) : stem) + ".h";
    return file.starts_with("tools/apps/postchain/") && !fs::exists(kRoot / own)
               ? "tools/apps/postchain/subcommands.h"
               : own;
}

// Faults of a source, given its header's lines; one line each.
std::vector<std::string> faults_of(const std::string& file, const std::vector<std::string>& source,
                                   const std::vector<std::string>& header) {
    const std::string own = header_of(file);
    if (header.empty()) return {"has no header " + own};
    std::vector<std::string> faults;
    // Samples are also built outside this tree and name neighboring files without a path.
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
    for (const auto& [file, source] :
         files_below({"chain", "passes", "config", "tools", "tests/support"}, {".cpp"})) {
        if (file.ends_with("/main.cpp")) continue;
        const auto header = lines_of(kRoot / header_of(file));
        for (const auto& fault : faults_of(file, source, header))
            ADD_FAILURE() << file << ": " << fault;
        ++count;
        exported += exports_of(source).size();
    }
    EXPECT_GT(count, 100u) << "the search found too few sources";
    EXPECT_GT(exported, 400u);
}

TEST(HeaderSource, FaultsAreSeen) {
    using Lines = std::vector<std::string>;
    const Lines source = {
        "#include \"chain/a.h\"",
        "namespace {",
        "int hidden() {",
        "}  // namespace",
        "Result<int> Known::ask(int a) const {",
        "const std::map<int, int>& exported(int a,",
        "                                   int b) {",
    };
    const Lines header = {"class Known;", "exported();"};
    EXPECT_TRUE(faults_of("chain/a.cpp", source, header).empty());
    for (const Lines& lacking : {Lines{"class Known;"}, Lines{"exported();"}, Lines{}})
        EXPECT_EQ(faults_of("chain/a.cpp", source, lacking).size(), 1u);
    EXPECT_EQ(faults_of("chain/b.cpp", source, header).size(), 1u);
    EXPECT_EQ(faults_of("chain/a_windows.cpp", source, header).size(), 0u);
    const char* sample = "tools/samples/b/a.cpp";
    EXPECT_EQ(faults_of(sample, {"#include \"a.h\""}, {"//"}).size(), 0u);
    EXPECT_EQ(faults_of(sample, {"#include \"chain/a.h\""}, {"//"}).size(), 1u);
}

}  // namespace
}  // namespace postchain::header_source_test
