// Every link of README.md, its neighbors and docs/ leads to a file and a heading that exist, every
// page named in a comment exists, and every page can be reached from README.md.
#include <gtest/gtest.h>

#include <cctype>
#include <map>
#include <regex>

#include "tests/structure/files.h"

namespace postchain::doc_links_test {
namespace {

using namespace structure;
namespace fs = std::filesystem;

struct Link {
    int line = 0;
    std::string target;  // "docs/frame.md#depth", "#depth", "images/wheels.jpg"
};

struct Page {
    std::vector<Link> links;
    std::set<std::string> anchors;
};

// Anchor of a heading in rendered Markdown: letters, digits, - and _, spaces as -.
std::string anchor_of(const std::string& heading) {
    std::string anchor;
    for (const char c : heading) {
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
            anchor += char(std::tolower(static_cast<unsigned char>(c)));
        else if (c == ' ')
            anchor += '-';
    }
    return anchor;
}

Page read_page(const fs::path& path) {
    static const std::regex link(R"re(\]\(([^)\s]+)\))re");
    static const std::regex heading(R"re(^#+ +(.*\S) *$)re");
    static const std::regex code(R"re(`[^`]*`)re");
    Page page;
    bool fenced = false;
    int line = 0;
    for (const std::string& text : lines_of(path)) {
        ++line;
        if (text.rfind("```", 0) == 0) fenced = !fenced;
        if (fenced) continue;
        std::smatch match;
        if (std::regex_match(text, match, heading)) page.anchors.insert(anchor_of(match[1]));
        const std::string prose = std::regex_replace(text, code, "");
        for (std::sregex_iterator it(prose.begin(), prose.end(), link), end; it != end; ++it)
            page.links.push_back({line, (*it)[1]});
    }
    return page;
}

// Relative to the root: its own pages and every page below docs/.
const std::map<std::string, Page>& pages() {
    static const std::map<std::string, Page> all = [] {
        std::map<std::string, Page> found;
        for (const auto& entry : fs::directory_iterator(kRoot))
            if (entry.path().extension() == ".md")
                found[entry.path().filename().string()] = read_page(entry.path());
        for (const File& file : files_below({"docs"}, {".md"}))
            found[file.name] = read_page(kRoot / file.name);
        return found;
    }();
    return all;
}

bool is_external(const std::string& target) {
    return target.find("://") != std::string::npos || target.rfind("mailto:", 0) == 0;
}

// File that a link on `page` leads to, relative to the root.
std::string file_of(const std::string& page, const std::string& target) {
    const std::string path = target.substr(0, target.find('#'));
    if (path.empty()) return page;
    return (fs::path(page).parent_path() / path).lexically_normal().string();
}

// The fault of a link; empty = none.
std::string fault_of(const std::string& page, const std::string& target) {
    if (is_external(target)) return "";
    const std::string file = file_of(page, target);
    if (!fs::exists(kRoot / file)) return "leads to " + file + ", which does not exist";
    const size_t hash = target.find('#');
    if (hash == std::string::npos) return "";
    const auto found = pages().find(file);
    if (found == pages().end() || found->second.anchors.count(target.substr(hash + 1)) == 0)
        return file + " has no heading for " + target.substr(hash);
    return "";
}

TEST(DocLinks, LeadToAFileAndAHeading) {
    size_t count = 0;
    for (const auto& [name, page] : pages())
        for (const auto& link : page.links) {
            ++count;
            EXPECT_EQ(fault_of(name, link.target), "") << name << ":" << link.line;
        }
    EXPECT_GT(count, 50u) << "the search found too few links";
}

TEST(DocLinks, EveryPageIsReachableFromTheReadme) {
    std::set<std::string> seen, open = {"README.md"};
    while (!open.empty()) {
        const std::string name = *open.begin();
        open.erase(open.begin());
        if (!seen.insert(name).second) continue;
        for (const auto& link : pages().at(name).links)
            if (!is_external(link.target) && pages().count(file_of(name, link.target)))
                open.insert(file_of(name, link.target));
    }
    for (const auto& [name, page] : pages())
        EXPECT_EQ(seen.count(name), 1u) << name << " cannot be reached from README.md";
}

// Comments and pages also name pages in plain text: "docs/frame.md".
TEST(DocLinks, PagesNamedInPlainTextExist) {
    static const std::regex named(R"re((^|[^/\w])(docs/[\w/]+\.(md|html)))re");
    std::vector<File> files =
        files_below({"chain", "passes", "shaders", "config", "tools", "tests", "docs"},
                    {".h", ".cpp", ".comp", ".glsl", ".txt", ".yaml", ".sh", ".js", ".md"});
    files.push_back({"README.md", lines_of(kRoot / "README.md")});
    size_t count = 0;
    for (const File& file : files)
        for (size_t i = 0; i < file.lines.size(); ++i) {
            const std::string& text = file.lines[i];
            for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it) {
                ++count;
                const std::string page = (*it)[2];
                EXPECT_TRUE(fs::exists(kRoot / page)) << place_of(file, i) << page;
            }
        }
    EXPECT_GT(count, 50u) << "the search found too few names";
}

TEST(DocLinks, FaultsAreSeen) {
    EXPECT_EQ(anchor_of("What `run` does, and why (1/d)"), "what-run-does-and-why-1d");
    for (const char* bad : {"docs/no-such-page.md", "docs/frame.md#nowhere"})
        EXPECT_NE(fault_of("README.md", bad), "") << bad;
    for (const char* good : {"../README.md#try-it", "#depth", "https://example.org/x.md"})
        EXPECT_EQ(fault_of("docs/frame.md", good), "") << good;
}

}  // namespace
}  // namespace postchain::doc_links_test
