#include "tools/service/work/held_paths.h"

#include <sys/stat.h>

#include <filesystem>

namespace postchain::service {
namespace {

Status check_link(const std::string& path, const Roots& roots, StatusCode code) {
    struct stat info;
    if (::lstat(path.c_str(), &info) == 0 && !S_ISLNK(info.st_mode)) return Status();
    if (roots.resolve(path).ok()) return Status();
    return Status(code, path + ": links outside the folders of this service");
}

}  // namespace

PathKind path_kind(const Parameter& row) {
    if (row.type != ParameterType::text) return PathKind::none;
    if (row.unit == "IN" || row.unit == "TRUTH") return PathKind::input;
    if (row.unit == "OUT") return PathKind::output;
    if (row.unit == "FILE" || row.unit == "DIR") return PathKind::file;
    return row.key == "profile" ? PathKind::profile : PathKind::none;
}

bool is_word(const std::string& text) {
    return text.find_first_of("/.") == std::string::npos;
}

std::string joined_path(const std::string& folder, const std::string& name) {
    return folder == "/" ? folder + name : folder + "/" + name;
}

io::PathHold hold_of(const Roots& roots) {
    return [roots](const std::string& path) { return roots.resolve(path); };
}

Result<io::PathPattern> resolve_pattern(const io::PathPattern& pattern, const Roots& roots) {
    std::string path = pattern.text();
    if (!pattern.has_token()) {
        ASSIGN_OR_RETURN(auto resolved, roots.resolve(path));
        return io::PathPattern::parse(resolved);
    }
    // Checks the file name too.
    RETURN_IF_ERROR(roots.resolve(path).status());
    ASSIGN_OR_RETURN(auto folder, roots.resolve(pattern.folder()));
    return io::PathPattern::parse(
        joined_path(folder, std::filesystem::path(path).filename().string()));
}

Status check_folder(const std::string& folder, const Roots& roots) {
    if (const auto now = roots.resolve(folder); now.ok() && *now == folder) return Status();
    return Status(StatusCode::output,
                  folder + ": is no longer in the folders of this service; it is a link now");
}

Status check_inputs(const io::InputSpec& input, const Roots& roots) {
    for (const auto& [role, pattern] : input.patterns) {
        if (const auto now = roots.resolve(pattern.folder()); !now.ok())
            return Status(StatusCode::input,
                          pattern.folder() + ": links outside the folders of this service");
        for (const auto& [frame, path] : pattern.discover())
            RETURN_IF_ERROR(check_link(path, roots, StatusCode::input));
    }
    return Status();
}

}  // namespace postchain::service
