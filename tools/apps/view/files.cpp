#include "tools/apps/view/files.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <string_view>

#include "chain/base/text.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::view {
namespace {

namespace fs = std::filesystem;

bool is_of(const std::string& name, FileKind kind) {
    const std::string lower = lower_case(name);
    const auto ends = [&](std::initializer_list<std::string_view> endings) {
        return std::any_of(endings.begin(), endings.end(),
                           [&](std::string_view ending) { return lower.ends_with(ending); });
    };
    if (kind == FileKind::chain) return ends({".yaml", ".yml"});
    if (kind == FileKind::camera) return ends({".json"});
    return ends({".exr", ".tif", ".tiff", ".png", ".jpg", ".jpeg", ".dpx", ".hdr", ".tga"});
}

// "shot.####.exr" of "shot.0001.exr"; the name itself without a number.
std::string pattern_of_name(const std::string& name) {
    const io::NumberPlace place = io::number_place(name);
    if (place.digits == place.end) return name;
    return name.substr(0, place.digits) + std::string(place.end - place.digits, '#') +
           name.substr(place.end);
}

}  // namespace

const char* name_of(FileKind kind) {
    constexpr std::array kNames = {"chain", "frames", "camera", "ground truth"};
    return kNames[size_t(kind)];
}

void OpenRequest::set(FileKind kind, const std::string& path) {
    const std::array<std::string*, 4> members = {&chain, &input, &camera, &truth};
    *members[size_t(kind)] = path;
}

std::string pattern_of(const std::string& path) {
    const fs::path file(path);
    const std::string pattern = pattern_of_name(file.filename().string());
    const std::string whole = (file.parent_path() / pattern).string();
    const auto parsed = io::PathPattern::parse(whole);
    return parsed.ok() && parsed->discover().size() > 1 ? whole : path;
}

Result<OpenRequest> request_for(const std::vector<std::string>& paths) {
    OpenRequest request;
    for (const std::string& path : paths) {
        std::error_code error;
        if (fs::is_directory(path, error)) {
            ASSIGN_OR_RETURN(const auto rows, list_folder(path, FileKind::frames));
            const auto first = std::find_if(rows.begin(), rows.end(),
                                            [](const FileRow& row) { return !row.is_folder(); });
            if (first == rows.end())
                return Status(StatusCode::usage,
                              path + ": the folder has no images; open another one");
            request.input = (fs::path(path) / first->name).string();
        } else if (is_of(path, FileKind::chain)) {
            request.chain = path;
        } else if (is_of(path, FileKind::camera)) {
            request.camera = path;
        } else if (is_of(path, FileKind::frames)) {
            request.input = pattern_of(path);
        } else {
            return Status(StatusCode::usage,
                          path + ": is no chain (.yaml), camera (.json) or image");
        }
    }
    return request;
}

Result<std::vector<FileRow>> list_folder(const std::string& folder, FileKind kind) {
    std::error_code error;
    std::map<std::string, int> files;       // by pattern
    std::map<std::string, std::string> of;  // a name of each
    std::vector<FileRow> rows;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        const std::string name = it->path().filename().string();
        if (name.starts_with(".")) continue;
        std::error_code gone;
        if (it->is_directory(gone)) {
            rows.push_back({name + "/"});
        } else if (is_of(name, kind)) {
            const bool joins = kind == FileKind::frames || kind == FileKind::truth;
            const std::string pattern = joins ? pattern_of_name(name) : name;
            ++files[pattern];
            of[pattern] = name;
        }
    }
    if (error) return Status(StatusCode::input, folder + ": " + error.message());
    std::sort(rows.begin(), rows.end(),
              [](const FileRow& a, const FileRow& b) { return a.name < b.name; });
    for (const auto& [pattern, count] : files)
        rows.push_back({count > 1 ? pattern : of[pattern], count});
    return rows;
}

}  // namespace postchain::view
