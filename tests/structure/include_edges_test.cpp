// Checks include edges (docs/architecture.md), found from the #include lines of every source file.
// The only rule is the order of layers: includes go down, never up, and within a layer never in a
// cycle.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <sstream>

#include "tests/structure/files.h"

namespace postchain::include_edges_test {
namespace {

using namespace structure;
namespace fs = std::filesystem;
using Edges = std::map<std::string, std::set<std::string>>;

// From bottom to top; folders in one entry are independent of each other.
const std::vector<std::vector<std::string>>& layers() {
    static const std::vector<std::vector<std::string>> order = {
        {"shaders"},
        {"chain"},
        {"passes", "config"},
        {"tools/sequence", "tools/page"},
        {"tools/measure"},
        {"tools/service"},
        {"tools/apps", "tools/samples", "tools/python"},
    };
    return order;
}

// Headers of other projects by their name or first folder, with the folders and files that may use
// them. All others belong to the standard library and the system. OpenImageIO and OpenColorIO are
// in the module alone, so that programs need not load them at start-up.
const Edges& allowed_libraries() {
    static const Edges edges = {
        {"epoxy/egl.h", {"chain/egl"}},
        {"epoxy",
         {"chain/gl", "chain/egl", "chain/guest", "tools/measure/scenes", "tools/apps/view",
          "tools/samples"}},
        {"glm", {"shaders", "chain/guest", "tools/measure/scenes"}},
        {"OpenEXR", {"tools/sequence/exr", "tools/apps"}},
        {"Imath", {"tools/sequence/exr"}},
        {"OpenImageIO",
         {"tools/sequence/image/ocio_config.cpp", "tools/sequence/image/ocio_config.h",
          "tools/sequence/image/image_calls.cpp", "tools/sequence/image/image_codec.cpp"}},
        {"OpenColorIO",
         {"tools/sequence/image/ocio_config.cpp", "tools/sequence/image/ocio_config.h"}},
        {"yaml-cpp", {"config"}},
        {"vulkan", {"chain/vk", "tools/samples/vulkan"}},
        {"glslang", {"chain/vk"}},
        {"nlohmann", {"tools"}},
        {"zlib.h",
         {"tools/measure/report", "tools/sequence/exr", "tools/sequence/image",
          "tools/service/http"}},
        {"libdeflate.h", {"tools/sequence/exr"}},
        {"CLI", {"tools/apps"}},
        {"pybind11", {"tools/python"}},
        {"spdlog", {"tools/apps"}},
        {"GLFW", {"tools/apps/view"}},
        {"boost", {"tools/measure/experiment", "tools/service/http"}},
        {"sqlite3.h", {"tools/service/store"}},
        {"prometheus", {"tools/service/work", "tools/service/http"}},
        {"imgui.h", {"tools/apps/view"}},
        {"imgui_stdlib.h", {"tools/apps/view"}},
        {"backends", {"tools/apps/view"}},
        {"fontconfig", {"tools/apps/view/fonts.cpp"}},
        {"gtest", {}},
        {"gmock", {}},
    };
    return edges;
}

bool is_in(const std::string& path, const std::string& folder) {
    return path == folder || path.rfind(folder + "/", 0) == 0;
}

// The layer folder of a path and its index from the bottom; "" and -1 if none.
std::pair<std::string, int> layer_of(const std::string& path) {
    for (size_t i = 0; i < layers().size(); ++i)
        for (const auto& folder : layers()[i])
            if (is_in(path, folder)) return {folder, int(i)};
    return {"", -1};
}

// Passes are independent of each other; shared code is in passes/common.
bool is_another_pass(const std::string& from, const std::string& to) {
    return is_in(from, "passes") && is_in(to, "passes") && from != to && from != "passes" &&
           to != "passes" && to != "passes/common" && to != "passes/inverse_warp";
}

struct Include {
    std::string file;  // relative to the root of the source
    std::string place;
    std::string target;  // quoted: relative to the root as well
    bool quoted = false;

    std::string from() const { return fs::path(file).parent_path().string(); }
    std::string to() const { return fs::path(target).parent_path().string(); }
};

std::vector<Include> includes_of(const File& file) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"])re");
    std::vector<Include> found;
    for (size_t i = 0; i < file.lines.size(); ++i) {
        std::smatch match;
        if (!std::regex_search(file.lines[i], match, pattern)) continue;
        Include include{file.name, place_of(file, i), match[2], match[1] == "\""};
        // GLSL and the shared headers name files relative to shaders/.
        if (include.quoted && !fs::exists(kRoot / include.target) &&
            fs::exists(kRoot / "shaders" / include.target))
            include.target = "shaders/" + include.target;
        // Samples are also built outside this tree and name neighboring files without a path.
        if (include.quoted && is_in(include.from(), "tools/samples") &&
            fs::exists(kRoot / include.from() / include.target))
            include.target = include.from() + "/" + include.target;
        found.push_back(std::move(include));
    }
    return found;
}

const std::vector<Include>& all_includes() {
    static const std::vector<Include> all = [] {
        std::vector<Include> found;
        for (const File& file : files_below({"chain", "passes", "shaders", "config", "tools"},
                                            {".h", ".cpp", ".comp", ".glsl"}))
            for (Include& include : includes_of(file)) found.push_back(std::move(include));
        return found;
    }();
    return all;
}

// The fault of an include; empty = none.
std::string fault_of(const Include& include) {
    const auto [from, height] = layer_of(include.from());
    if (height < 0) return "lies in no layer";
    if (!include.quoted) {
        auto library = allowed_libraries().find(include.target);
        if (library == allowed_libraries().end())
            library = allowed_libraries().find(include.target.substr(0, include.target.find('/')));
        if (library == allowed_libraries().end()) return "";
        for (const auto& folder : library->second)
            if (is_in(include.file, folder)) return "";
        return include.file + " may not use <" + include.target + ">";
    }
    const auto [to, depth] = layer_of(include.to());
    if (depth < 0) return "includes \"" + include.target + "\", which lies in no layer";
    if (depth > height) return from + " may not include what is above it: " + include.target;
    if (depth == height && from != to) return from + " and " + to + " may not know each other";
    if (from == "tools/samples" && include.from() != include.to())
        return "a sample builds alone, with what is installed: " + include.target;
    if (is_another_pass(include.from(), include.to()))
        return include.from() + " may not know another pass: " + include.target;
    // So that metrics work on any pixels.
    if (include.from() == "tools/measure/metrics" && include.to() != include.from() &&
        include.target != "chain/base/image.h" && include.target != "chain/base/status.h")
        return "metrics know only the images of the chain, not " + include.target;
    return "";
}

// Folder -> other folders that it includes.
Edges found_edges() {
    Edges edges;
    for (const auto& include : all_includes())
        if (include.quoted && include.from() != include.to())
            edges[include.from()].insert(include.to());
    return edges;
}

// The first folder on a cycle through `start`; empty = no cycle.
std::string circle_through(const std::string& start, const Edges& edges) {
    std::set<std::string> seen, open;
    if (const auto first = edges.find(start); first != edges.end()) open = first->second;
    while (!open.empty()) {
        const std::string folder = *open.begin();
        open.erase(open.begin());
        if (folder == start) return start;
        if (!seen.insert(folder).second) continue;
        if (const auto next = edges.find(folder); next != edges.end())
            open.insert(next->second.begin(), next->second.end());
    }
    return "";
}

TEST(IncludeEdges, NoneRunsUp) {
    for (const auto& include : all_includes())
        if (const std::string fault = fault_of(include); !fault.empty())
            ADD_FAILURE() << include.place << fault;
    EXPECT_GT(all_includes().size(), 500u) << "the search found too few includes";
}

TEST(IncludeEdges, NoneGoesInACircle) {
    const Edges edges = found_edges();
    for (const auto& [folder, targets] : edges)
        EXPECT_EQ(circle_through(folder, edges), "") << "a cycle through " << folder;
}

// Each room includes only those before it: planning is independent of GL, running plans makes no
// context and knows no pass, and chain/vk has no GL.
TEST(IncludeEdges, ChainHasEightRooms) {
    const std::vector<std::string> order = {"chain/base",  "chain/frame", "chain/plan",
                                            "chain/pass",  "chain/gl",    "chain/egl",
                                            "chain/guest", "chain/vk"};
    const auto place = [&](const std::string& folder) {
        return std::find(order.begin(), order.end(), folder) - order.begin();
    };
    for (const auto& include : all_includes()) {
        if (!is_in(include.from(), "chain")) continue;
        EXPECT_LT(place(include.from()), 8) << include.place << "in none of the eight";
        if (!include.quoted || !is_in(include.to(), "chain")) continue;
        EXPECT_LE(place(include.to()), place(include.from())) << include.place << include.target;
        for (const auto& [from, to] : {std::pair{"chain/gl", "chain/pass"},
                                       {"chain/egl", "chain/pass"},
                                       {"chain/vk", "chain/gl"}})
            EXPECT_FALSE(is_in(include.from(), from) && is_in(include.to(), to))
                << include.place << include.target;
    }
}

// The diagram of docs/architecture.md, lines "folder -> folders", matches the includes: edges of
// each layer, and of the folders of chain/ and tools/ within it.
TEST(IncludeEdges, DiagramOfTheDocumentationIsComplete) {
    Edges expected;
    for (const auto& [folder, targets] : found_edges()) {
        const std::string from = layer_of(folder).first;
        for (const auto& target : targets) {
            const std::string to = layer_of(target).first;
            if (from != to)
                expected[from].insert(to);
            else if (is_in(folder, "tools") || is_in(folder, "chain"))
                expected[folder].insert(target);
        }
    }
    Edges written;
    static const std::regex pattern(R"re(^([a-z_/]+)\s+->\s+([a-z_/ ]+)$)re");
    for (const std::string& text : lines_of(kRoot / "docs/architecture.md")) {
        std::smatch match;
        if (!std::regex_match(text, match, pattern)) continue;
        std::istringstream words(match[2]);
        for (std::string word; words >> word;) written[match[1]].insert(word);
    }
    const auto text = [](const Edges& edges) {
        std::string all;
        for (const auto& [from, targets] : edges) {
            all += from + " ->";
            for (const auto& to : targets) all += " " + to;
            all += "\n";
        }
        return all;
    };
    EXPECT_EQ(text(written), text(expected));
}

TEST(IncludeEdges, FaultsAreSeen) {
    const struct {
        const char *file, *target;
        bool quoted, fault;
    } rows[] = {
        {"passes/fxaa/fxaa.cpp", "passes/motion_blur/motion_blur.h", true, true},
        {"passes/fxaa/fxaa.cpp", "config/profile.h", true, true},
        {"chain/plan/plan.cpp", "passes/registry.h", true, true},
        {"chain/plan/plan.cpp", "yaml-cpp/yaml.h", false, true},
        {"chain/plan/plan.cpp", "epoxy/gl.h", false, true},
        {"chain/gl/a.cpp", "epoxy/egl.h", false, true},
        {"tools/sequence/exr/a.cpp", "tools/measure/metrics/flip.h", true, true},
        {"tools/sequence/image/a.h", "OpenImageIO/imageio.h", false, true},
        {"tools/measure/metrics/flip.cpp", "chain/plan/plan.h", true, true},
        {"tools/nowhere/a.cpp", "chain/plan/plan.h", true, true},
        {"tools/samples/ogre/a.cpp", "chain/guest/postchain.h", true, true},
        {"tools/samples/ogre/a.cpp", "tools/samples/glfw/a.h", true, true},
        {"tools/samples/ogre/a.cpp", "tools/samples/ogre/a.h", true, false},
        {"passes/fxaa/fxaa.cpp", "passes/common/warp.h", true, false},
        {"tools/apps/postchain/run.cpp", "tools/sequence/files/sequence.h", true, false},
    };
    for (const auto& [file, target, quoted, fault] : rows)
        EXPECT_EQ(!fault_of({file, "", target, quoted}).empty(), fault) << file << " " << target;
    EXPECT_EQ(circle_through("a", {{"a", {"b"}}, {"b", {"c"}}, {"c", {"a"}}}), "a");
    EXPECT_EQ(circle_through("a", {{"a", {"b"}}, {"b", {"c"}}}), "");
}

}  // namespace
}  // namespace postchain::include_edges_test
