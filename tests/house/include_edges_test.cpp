// Who may include whom (docs/architecture.md): reads the #include lines of every source file and
// fails on any edge that is not in the list.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Edges = std::map<std::string, std::set<std::string>>;

// A room is a folder of its own part of the house; the value: rooms it may include besides itself.
const Edges& allowed_rooms() {
    static const Edges edges = {
        {"shaders", {}},
        {"shaders/shared", {}},
        {"chain", {"shaders"}},
        {"passes", {"chain"}},
        {"passes/motion_blur", {"chain", "shaders/shared"}},
        {"passes/fxaa", {"chain", "shaders/shared"}},
        {"passes/depth_of_field", {"chain", "shaders/shared"}},
        {"config", {"chain", "shaders"}},
        {"tools/io", {"config", "chain"}},
        {"tools/metrics", {"chain"}},
        {"tools/scenes", {"tools/io", "chain", "shaders/shared"}},
        {"tools/offline", {"tools/io", "config", "passes", "chain"}},
        {"tools/report",
         {"tools/offline", "tools/io", "tools/metrics", "tools/scenes", "config", "passes", "chain",
          "shaders"}},
        {"tools/stress", {"tools/io", "passes", "chain", "shaders"}},
        {"tools/postchain",
         {"tools/stress", "tools/report", "tools/offline", "tools/io", "tools/metrics",
          "tools/scenes", "config", "passes", "chain"}},
    };
    return edges;
}

// Headers of other projects, by their first folder or name; the value: rooms that may use them.
// What is in none of the lists is the standard library and the system.
const Edges& allowed_libraries() {
    static const Edges edges = {
        {"epoxy", {"chain", "tools/scenes"}},
        {"glm", {"shaders/shared", "tools/scenes"}},
        {"OpenEXR", {"tools/io", "tools/postchain"}},
        {"Imath", {"tools/io"}},
        {"OpenImageIO", {"tools/io", "tools/postchain"}},
        {"yaml-cpp", {"config"}},
        {"nlohmann", {"tools/offline", "tools/postchain", "tools/report"}},
        {"zlib.h", {"tools/report"}},
        {"CLI", {"tools/postchain"}},
        {"spdlog", {"tools/postchain"}},
        {"GLFW", {}},
        {"httplib.h", {}},
        {"sqlite3.h", {}},
        {"imgui.h", {}},
        {"gtest", {}},
        {"gmock", {}},
        {"benchmark", {}},
    };
    return edges;
}

struct Include {
    std::string file;  // relative to the root of the source
    int line = 0;
    std::string target;
    bool quoted = false;
};

std::vector<Include> includes_of(const fs::path& file, const fs::path& root) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"])re");
    std::vector<Include> found;
    std::ifstream in(file);
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
        std::smatch match;
        if (std::regex_search(text, match, pattern))
            found.push_back({fs::relative(file, root).string(), line, match[2], match[1] == "\""});
    }
    return found;
}

// The longest listed room that holds the file.
std::string room_of(const std::string& path) {
    std::string best;
    for (const auto& [room, targets] : allowed_rooms())
        if (path.rfind(room + "/", 0) == 0 && room.size() > best.size()) best = room;
    return best;
}

bool is_source(const fs::path& path) {
    const auto extension = path.extension();
    return extension == ".h" || extension == ".cpp" || extension == ".comp" || extension == ".glsl";
}

// One line per include that is not allowed.
std::vector<std::string> faults_of(const Include& include) {
    const std::string place = include.file + ":" + std::to_string(include.line) + ": ";
    const std::string from = room_of(include.file);
    if (from.empty()) return {place + "is in no room of the list"};
    if (!include.quoted) {
        const auto library =
            allowed_libraries().find(include.target.substr(0, include.target.find('/')));
        if (library == allowed_libraries().end() || library->second.count(from)) return {};
        return {place + from + " may not use <" + include.target + ">"};
    }
    // GLSL and the shared headers name files relative to shaders/.
    const bool shading = from.rfind("shaders", 0) == 0;
    std::string target = include.target;
    if (shading && target.rfind("shaders/", 0) != 0) target = "shaders/" + target;
    const std::string to = room_of(target);
    if (to.empty()) return {place + "includes \"" + include.target + "\", which is in no room"};
    if (to == from || allowed_rooms().at(from).count(to)) return {};
    if (shading && to.rfind("shaders", 0) == 0) return {};
    return {place + from + " may not include " + to + " (" + include.target + ")"};
}

TEST(IncludeEdges, NoArrowRunsUp) {
    const fs::path root = POSTCHAIN_SOURCE_DIR;
    size_t files = 0;
    for (const char* top : {"chain", "passes", "shaders", "config", "tools"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            if (!entry.is_regular_file() || !is_source(entry.path())) continue;
            ++files;
            for (const auto& include : includes_of(entry.path(), root))
                for (const auto& fault : faults_of(include)) ADD_FAILURE() << fault;
        }
    }
    EXPECT_GT(files, 50u) << "the walk found too little to mean anything";
}

// Metrics know pictures and nothing of chains, so that anything with pixels can be measured.
TEST(IncludeEdges, MetricsKnowOnlyPicturesOfTheChain) {
    const fs::path root = POSTCHAIN_SOURCE_DIR;
    size_t files = 0;
    for (const auto& entry : fs::directory_iterator(root / "tools/metrics")) {
        if (!is_source(entry.path())) continue;
        ++files;
        for (const auto& include : includes_of(entry.path(), root)) {
            if (!include.quoted || include.target.rfind("tools/metrics/", 0) == 0) continue;
            EXPECT_TRUE(include.target == "chain/image.h" || include.target == "chain/status.h")
                << include.file << ":" << include.line << ": " << include.target;
        }
    }
    EXPECT_GT(files, 10u);
}

TEST(IncludeEdges, TheListItselfHasNoCircle) {
    for (const auto& [start, targets] : allowed_rooms()) {
        std::set<std::string> seen, open = targets;
        while (!open.empty()) {
            const std::string room = *open.begin();
            open.erase(open.begin());
            EXPECT_NE(room, start) << "a circle through " << start;
            if (!seen.insert(room).second) continue;
            const auto next = allowed_rooms().find(room);
            ASSERT_NE(next, allowed_rooms().end()) << room;
            open.insert(next->second.begin(), next->second.end());
        }
    }
}

TEST(IncludeEdges, FaultsAreSeen) {
    const auto faults = [](const char* file, const char* target, bool quoted) {
        return faults_of({file, 1, target, quoted}).size();
    };
    EXPECT_EQ(faults("passes/fxaa/fxaa.cpp", "passes/motion_blur/motion_blur.h", true), 1u);
    EXPECT_EQ(faults("chain/plan.cpp", "passes/registry.h", true), 1u);
    EXPECT_EQ(faults("chain/plan.cpp", "yaml-cpp/yaml.h", false), 1u);
    EXPECT_EQ(faults("tools/io/a.cpp", "tools/offline/runner.h", true), 1u);
    EXPECT_EQ(faults("tools/nowhere/a.cpp", "chain/plan.h", true), 1u);
    EXPECT_EQ(faults("passes/fxaa/fxaa.cpp", "chain/pass.h", true), 0u);
    EXPECT_EQ(faults("tools/offline/runner.cpp", "tools/io/sequence.h", true), 0u);
}

}  // namespace
