#include "tools/sequence/files/output_files.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <set>
#include <tuple>

#include "chain/base/readable_file.h"
#include "chain/base/stop.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;

std::string without_links(const fs::path& folder) {
    std::error_code error;
    const fs::path given = folder.empty() ? fs::path(".") : folder;
    const fs::path found = fs::weakly_canonical(given, error);
    // A relative path stays relative if no part of it exists.
    const fs::path whole = fs::absolute(error ? given : found, error).lexically_normal();
    return whole.has_filename() ? whole.string() : whole.parent_path().string();
}

std::string resolved_path(const std::string& folder, const std::string& name) {
    return folder == "/" ? folder + name : folder + "/" + name;
}

std::string name_of(const std::string& path) {
    return fs::path(path).filename().string();
}

// A dangling link exists too: its name is taken.
bool is_there(const std::string& path) {
    struct stat info;
    return ::lstat(path.c_str(), &info) == 0;
}

bool is_folder(const std::string& path) {
    struct stat info;
    return ::stat(path.c_str(), &info) == 0 && S_ISDIR(info.st_mode);
}

Status usage(const std::string& path, const std::string& message) {
    return Status(StatusCode::usage, concat(path, ": ", message));
}

Status refused(const std::string& path, const std::string& message) {
    return Status(StatusCode::output, concat(path, ": ", message));
}

std::string read_mark(const std::string& path) {
    return text_of_file(path);
}

std::vector<std::string> names_in(const std::string& folder) {
    std::vector<std::string> names;
    const OpenFolder in(folder);
    std::error_code error;
    for (fs::directory_iterator it(in.path(), error), end; !error && it != end; it.increment(error))
        names.push_back(it->path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace

Status make_folder(const std::string& folder) {
    const int error = make_folders(folder);
    if (error == 0) return Status();
    return refused(folder, concat("cannot be created: ",
                                  error == EXDEV ? reason_of_open(error) : std::strerror(error),
                                  "; choose another folder"));
}

bool is_inside(const std::string& path, const std::string& folder) {
    return path == folder || path.starts_with(folder == "/" ? folder : folder + "/");
}

std::string FolderNames::name(const std::string& folder) const {
    const std::string whole = without_links(folder);
    for (std::string at = whole;; at = fs::path(at).parent_path().string()) {
        struct stat info;
        if (::stat(at.c_str(), &info) == 0)
            if (const auto known = known_.find({info.st_dev, info.st_ino}); known != known_.end())
                return at == whole ? known->second
                                   : resolved_path(known->second,
                                                   whole.substr(at == "/" ? 1 : at.size() + 1));
        if (at.size() <= 1) return whole;
    }
}

std::string FolderNames::add(const std::string& folder) {
    const std::string whole = name(folder);
    for (std::string at = whole;; at = fs::path(at).parent_path().string()) {
        struct stat info;
        if (::stat(at.c_str(), &info) == 0)
            known_.emplace(FileIdentity(info.st_dev, info.st_ino), at);
        if (at.size() <= 1) return whole;
    }
}

OutputFiles::OutputFiles(OnExisting on_existing, std::string choices)
    : on_existing_(on_existing), choices_(std::move(choices)) {}

std::string OutputFiles::add_folder(const std::string& folder) {
    auto known = resolved_folders_.find(folder);
    if (known == resolved_folders_.end())
        known = resolved_folders_.emplace(folder, folder_names_.add(folder)).first;
    return known->second;
}

std::string OutputFiles::resolved(const std::string& path) {
    return resolved_path(add_folder(fs::path(path).parent_path().string()), name_of(path));
}

void OutputFiles::read(const InputFile& file) {
    struct stat info;
    const std::string what = concat(file.what, " ", file.path);
    // Missing files are not read: the name of a shipped chain or profile is not a path.
    if (::stat(file.path.c_str(), &info) != 0) return;
    inputs_.emplace(FileIdentity(info.st_dev, info.st_ino), what);
    input_at_.emplace(resolved(file.path), what);
    std::error_code error;
    if (fs::is_symlink(file.path, error))
        input_at_.emplace(resolved(fs::canonical(file.path, error).string()), what);
}

void OutputFiles::read(const PathPattern& pattern, const std::string& what) {
    for (const auto& [frame, path] : pattern.discover()) read({path, what});
    patterns_.push_back({add_folder(pattern.folder()), pattern, what});
}

void OutputFiles::write(OutputFile file) {
    const auto [at, fresh] = file_at_.emplace(resolved(file.path), files_.size());
    if (!fresh) twice_.emplace_back(at->second, files_.size());
    files_.push_back(std::move(file));
}

void OutputFiles::write(OutputFamily family) {
    family.folder = add_folder(family.folder);
    families_.push_back(std::move(family));
}

void OutputFiles::write(OutputFolder folder) {
    add_folder(folder.path);
    folders_.push_back(std::move(folder));
}

std::string OutputFiles::choice() const {
    return choices_.empty() ? "" : "choose " + setting("on_existing", choices_) + ", or ";
}

// The damage that a write to this path would do to an input; empty: none.
std::string OutputFiles::conflict(const std::string& path, const std::string& resolved) const {
    struct stat info;
    if (::stat(path.c_str(), &info) == 0)
        if (const auto input = inputs_.find({info.st_dev, info.st_ino}); input != inputs_.end())
            return concat("would replace ", input->second, ", which this job reads");
    const std::string folder = fs::path(resolved).parent_path().string();
    for (const Pattern& pattern : patterns_)
        if (folder == pattern.folder && pattern.names.match(name_of(resolved)))
            return concat("would be one more frame of ", pattern.what, " ", pattern.names.text());
    return "";
}

// An input in the folder; empty: none.
std::string OutputFiles::input_in(const std::string& folder) const {
    for (const auto& [path, what] : input_at_)
        if (is_inside(path, folder)) return what;
    return "";
}

Status OutputFiles::family_names(const OutputFamily& family) const {
    for (const auto& [path, index] : file_at_)
        if (fs::path(path).parent_path() == family.folder && family.has(name_of(path)))
            return usage(files_[index].path, concat("is ", files_[index].what, ", and could be ",
                                                    family.what, "; ", family.remedy));
    for (const std::string& name : names_in(family.folder))
        if (family.has(name)) {
            const std::string path = resolved_path(family.folder, name);
            if (const std::string clash = conflict(path, path); !clash.empty())
                return usage(path, concat(family.what, " ", clash, "; ", family.remedy));
        }
    return Status();
}

Status OutputFiles::check_names() const {
    for (const auto& [resolved, index] : file_at_) {
        if (is_stopped()) return stopped_status();
        const OutputFile& file = files_[index];
        for (const auto& [what, text, most] : {std::tuple("name", name_of(resolved), kLongestName),
                                               {"path", file.path, kLongestPath}})
            if (text.size() > most)
                return usage(file.path,
                             concat("the ", what, " of ", file.what, " has ", text.size(),
                                    " bytes, more than ", most, "; ", file.remedy));
        if (const std::string clash = conflict(file.path, resolved); !clash.empty())
            return usage(file.path, concat(file.what, " ", clash, "; ", file.remedy));
    }
    if (!twice_.empty()) {
        const auto& [first, second] = twice_.front();
        return usage(files_[second].path,
                     concat("would be written twice, as ", files_[first].what, " and as ",
                            files_[second].what, "; ", files_[second].remedy));
    }
    for (const OutputFamily& family : families_) RETURN_IF_ERROR(family_names(family));
    for (const OutputFolder& folder : folders_)
        if (const std::string input = input_in(folder_names_.name(folder.path)); !input.empty())
            return usage(folder.path, concat("is the folder of ", folder.what, ", and ", input,
                                             ", which this job reads, is in it; ", folder.remedy));
    return Status();
}

Status OutputFiles::folder_state(const OutputFolder& folder) const {
    if (!is_there(folder.path)) return Status();
    if (!is_folder(folder.path))
        return refused(folder.path, concat("is a file; the folder of ", folder.what,
                                           " cannot be created; ", folder.remedy));
    std::vector<std::string> names = names_in(folder.path);
    // The only content if the process was killed before it had renamed the mark.
    std::erase_if(names, [&](const auto& name) { return is_temporary_of(name, folder.mark); });
    if (names.empty()) return Status();
    const std::string mark = folder.path + "/" + folder.mark;
    if (!is_there(mark))
        return refused(folder.path,
                       concat("folder is not empty and is not ", folder.what, "; ", folder.remedy));
    if (const std::string owner = read_mark(mark); owner != folder.owner)
        return refused(folder.path, concat("folder is another's: ",
                                           owner.substr(0, owner.find('\n')), "; ", folder.remedy));
    if (on_existing_ == OnExisting::fail && names.size() > 1)  // more than the mark
        return refused(folder.path,
                       concat("has ", folder.what, " already; ", choice(), folder.remedy));
    return Status();
}

Status OutputFiles::existing(const std::vector<const OutputFile*>& files) const {
    const OutputFile* first = nullptr;
    size_t count = 0;
    for (const OutputFile* file : files) {
        if (is_stopped()) return stopped_status();
        if (is_folder(file->path))
            return refused(file->path, concat("is a folder, not a file; it would be ", file->what,
                                              "; ", file->remedy));
        if (on_existing_ != OnExisting::fail || !is_there(file->path)) continue;
        if (count++ == 0) first = file;
    }
    if (first == nullptr) return Status();
    return refused(
        first->path,
        concat("exists", count > 1 ? concat(", and ", count - 1, " more") : "",
               "; it would be replaced by ", first->what, " (", choice(), first->remedy, ")"));
}

Status OutputFiles::check_existing(const std::vector<std::string>& paths) const {
    std::vector<const OutputFile*> files;
    for (const std::string& path : paths) {
        const auto known = file_at_.find(resolved_path(
            folder_names_.name(fs::path(path).parent_path().string()), name_of(path)));
        if (known != file_at_.end()) files.push_back(&files_[known->second]);
    }
    return existing(files);
}

Status OutputFiles::check_existing() const {
    std::vector<const OutputFile*> files;
    for (const OutputFile& file : files_) files.push_back(&file);
    RETURN_IF_ERROR(existing(files));
    for (const OutputFamily& family : families_)
        for (const std::string& name : names_in(family.folder))
            if (on_existing_ == OnExisting::fail && family.has(name))
                return refused(resolved_path(family.folder, name),
                               concat("exists; it could be replaced by ", family.what, " (",
                                      choice(), family.remedy, ")"));
    for (const OutputFolder& folder : folders_) RETURN_IF_ERROR(folder_state(folder));
    return Status();
}

Status OutputFiles::check() const {
    RETURN_IF_ERROR(check_names());
    return check_existing();
}

Status OutputFiles::check_folders() const {
    for (const OutputFile& file : files_) RETURN_IF_ERROR(check_folder_of(file.path));
    return Status();
}

void OutputFiles::remove_left_temporaries() const {
    std::map<std::string, std::set<std::string>> names;  // file names by folder
    for (const auto& [path, index] : file_at_)
        names[fs::path(path).parent_path().string()].insert(name_of(path));
    for (const auto& at : names)
        remove_dead_temporaries(at.first,
                                [&](const auto& name) { return at.second.count(name) > 0; });
    for (const OutputFamily& family : families_) remove_dead_temporaries(family.folder, family.has);
    for (const OutputFolder& own : folders_) {
        const auto any = [](const std::string&) { return true; };
        remove_dead_temporaries(own.path, any);
        std::error_code error;
        for (fs::recursive_directory_iterator it(own.path, error), end; !error && it != end;
             it.increment(error))
            if (it->is_directory(error)) remove_dead_temporaries(it->path().string(), any);
    }
}

Status OutputFiles::make_folders() const {
    for (const OutputFolder& folder : folders_) {
        RETURN_IF_ERROR(make_folder(folder.path));
        RETURN_IF_ERROR(
            atomic_write_text(folder.path + "/" + folder.mark, folder.owner, OnExisting::skip)
                .status());
    }
    return Status();
}

Result<OnExisting> OutputFiles::permit(const std::string& path) const {
    const std::string folder = folder_names_.name(fs::path(path).parent_path().string());
    const std::string whole = resolved_path(folder, name_of(path));
    if (const std::string clash = conflict(path, whole); !clash.empty())
        return usage(path, "this file " + clash + "; it is not written");
    for (const OutputFolder& own : folders_)
        if (is_inside(whole, folder_names_.name(own.path))) return OnExisting::overwrite;
    bool known = file_at_.count(whole) > 0;
    for (const OutputFamily& family : families_)
        known = known || (folder == family.folder && family.has(name_of(path)));
    // Files to be kept under skip are not written at all.
    return known && on_existing_ != OnExisting::fail ? OnExisting::overwrite : OnExisting::fail;
}

Status OutputFiles::put(const std::string& path, std::string_view text) const {
    ASSIGN_OR_RETURN(const auto permitted, permit(path));
    return atomic_write_text(path, text, permitted).status();
}

}  // namespace postchain::io
