#include "tools/service/work/browse.h"

#include <algorithm>
#include <filesystem>

#include "chain/base/readable_file.h"
#include "config/chain_find.h"
#include "tools/sequence/files/folder_scan.h"
#include "tools/sequence/files/json.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

constexpr size_t kMaxNames = 5000;  // of each kind in a reply
constexpr size_t kMaxRead = 100;    // text files of a folder that are read
constexpr uintmax_t kMaxText = 1 << 18;

Json sequences_in(const std::string& folder, const Roots& roots) {
    Json list = Json::array();
    const auto found = io::scan_folder(folder);
    if (!found.ok()) return list;  // it has none
    for (const io::FoundSequence& one : *found) {
        if (list.size() == kMaxNames) break;
        list.push_back({{"name", fs::path(one.pattern).filename().string()},
                        {"path", roots.shown(one.pattern)},
                        {"frames", io::range_text(one.frames)},
                        {"count", one.frames.size()}});
    }
    return list;
}

// The list of /v1/browse in which a text file belongs; empty: in none.
std::string kind_of(const TextNode& root) {
    if (root.find("postchain_study")) return "studies";
    if (root.find("passes")) return root.find("postchain") ? "chains" : "";
    for (const char* key : {"focal_length_mm", "f_stop", "focus_distance", "shutter_frames",
                            "shutter_angle_deg", "camera_matrix_world"})
        if (root.find(key)) return "cameras";
    return "";
}

bool is_text(const fs::directory_entry& entry) {
    const fs::path name = entry.path().filename();
    const std::string extension = name.extension().string();
    if (extension != ".json" && extension != ".yaml" && extension != ".yml") return false;
    std::error_code error;
    // A sidecar is beside each output: frame.0001.exr.json, frame.0001.json.
    const std::string stem = name.stem().string();
    const bool sidecar =
        stem.find(".exr") != stem.npos || (!stem.empty() && io::is_digit(stem.back()));
    return !sidecar && entry.is_regular_file(error) && entry.file_size(error) <= kMaxText && !error;
}

Json folder_json(const std::string& path, const Roots& roots) {
    return {{"name", fs::path(path).filename().string()}, {"path", roots.shown(path)}};
}

}  // namespace

Answer<std::string> browse(const std::string& folder, const Roots& roots) {
    Json reply = {{"folder", folder}, {"parent", nullptr}};
    for (const char* kind : {"folders", "sequences", "cameras", "chains", "studies"})
        reply[kind] = Json::array();
    const auto& entries = roots.entries();
    if (folder.empty() && entries.size() > 1) {
        for (const std::string& root : entries)
            reply["folders"].push_back(folder_json(root, roots));
        return io::json_text(reply);
    }
    const auto path = roots.resolve(folder.empty() ? entries.front() : folder);
    if (!path.ok()) return Problem{Problem::Kind::forbidden, path.status().message(), {}, 0};
    const OpenFolder in(*path);
    std::error_code error;
    const fs::directory_iterator opened(in.path(), error);
    if (error) return not_found(roots.shown(*path) + ": " + error.message());
    std::vector<std::pair<std::string, bool>> found;  // whether it is a folder
    for (fs::directory_iterator at = opened; !error && at != fs::directory_iterator();
         at.increment(error)) {
        const std::string name = at->path().filename().string();
        const bool is_folder = at->is_directory(error);
        // Most entries are frames, whose links need not be followed.
        if (!name.starts_with('.') && (is_folder || is_text(*at)) &&
            roots.resolve(joined_path(*path, name)).ok())
            found.emplace_back(joined_path(*path, name), is_folder);
        error.clear();
    }
    std::ranges::sort(found);
    reply["folder"] = roots.shown(*path);
    const bool is_root = std::ranges::find(entries, *path) != entries.end();
    if (!is_root)
        reply["parent"] = roots.shown(fs::path(*path).parent_path().string());
    else if (entries.size() > 1)
        reply["parent"] = "";
    size_t read = 0;
    for (const auto& [name, is_folder] : found) {
        if (is_folder) {
            if (reply["folders"].size() < kMaxNames)
                reply["folders"].push_back(folder_json(name, roots));
        } else if (++read <= kMaxRead) {
            const auto text = read_text_file(name, StatusCode::input);
            const auto kind = text.ok() ? kind_of(read_text_tree(*text, name).root) : std::string();
            if (!kind.empty()) reply[kind].push_back(roots.shown(name));
        }
    }
    reply["sequences"] = sequences_in(*path, roots);
    return io::json_text(reply);
}

Answer<std::string> chains_of(const std::string& file, const Roots& roots) {
    Json list = Json::array();
    if (!file.empty()) {
        const auto path = roots.resolve(file);
        if (!path.ok()) return Problem{Problem::Kind::forbidden, path.status().message(), {}, 0};
        std::error_code error;
        if (!fs::is_regular_file(*path, error))
            return not_found(roots.shown(*path) + ": does not exist, or is not a file");
        const auto text = read_text_file(*path, StatusCode::input);
        if (!text.ok()) return not_found(roots.shown_in(text.status().message()));
        if (kind_of(read_text_tree(*text, file).root) != "chains")
            return Problem{Problem::Kind::invalid,
                           roots.shown(*path) + ": is not a chain file; give one"};
        list.push_back({{"name", file}, {"text", *text}});
    } else {
        for (const std::string& name : shipped_chains())
            if (const auto chain = find_chain(name); chain.ok())
                list.push_back({{"name", name}, {"text", chain->text}});
    }
    return io::json_text({{"chains", list}});
}

}  // namespace postchain::service
