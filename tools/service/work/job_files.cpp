#include "tools/service/work/job_files.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "config/text_tree.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/service/work/process.h"
#include "tools/service/work/programs.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

constexpr auto kLongestImage = std::chrono::seconds(60);

std::string type_of(const std::string& name) {
    const std::string extension = fs::path(name).extension().string();
    if (extension == ".html") return "text/html; charset=utf-8";
    if (extension == ".json") return "application/json";
    if (extension == ".csv") return "text/csv; charset=utf-8";
    if (extension == ".md") return "text/markdown; charset=utf-8";
    if (extension == ".png") return "image/png";
    if (extension == ".exr") return "image/x-exr";
    if (extension == ".yaml") return "application/yaml";
    if (extension == ".js") return "text/javascript; charset=utf-8";
    return "";
}

ResultFile file_at(const std::string& path) {
    const std::string name = fs::path(path).filename().string();
    const std::string type = type_of(name);
    std::error_code error;
    const auto bytes = fs::file_size(path, error);
    return {path, name, type.empty() ? "application/octet-stream" : type,
            error ? 0 : uint64_t(bytes)};
}

int64_t bytes_in_folder(const std::string& folder) {
    std::error_code error;
    int64_t bytes = 0;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
         at.increment(error)) {
        std::error_code one;
        if (!at->is_symlink(one) && at->is_regular_file(one)) bytes += int64_t(at->file_size(one));
    }
    return bytes;
}

// "a.0001.exr" and what is named after it: "a.0001.exr.json", "a.0001.exr.png".
int64_t bytes_of_frames(const io::PathPattern& pattern) {
    const std::string extension = fs::path(pattern.text()).extension().string();
    std::error_code error;
    int64_t bytes = 0;
    for (fs::directory_iterator at(pattern.folder(), error), end; !error && at != end;
         at.increment(error)) {
        const std::string name = at->path().filename().string();
        bool named = false;
        for (size_t dot = name.find(extension); !named && dot != std::string::npos;
             dot = name.find(extension, dot + 1))
            named = pattern.match(name.substr(0, dot + extension.size())).has_value();
        std::error_code one;
        if (named && !at->is_symlink(one) && at->is_regular_file(one))
            bytes += int64_t(at->file_size(one));
    }
    return bytes;
}

Answer<io::InputSpec> input_of(const JobRequest& request) {
    auto input = io::InputSpec::parse(request.input);
    if (!input.ok()) return not_found("a study has no frames of its own; its report shows them");
    return std::move(*input);
}

}  // namespace

int64_t bytes_on_disk(const std::string& writes) {
    std::istringstream lines(writes);
    int64_t bytes = 0;
    for (std::string line; std::getline(lines, line);) {
        std::error_code error;
        if (fs::is_directory(line, error)) {
            bytes += bytes_in_folder(line);
        } else if (const auto pattern = io::PathPattern::parse(line);
                   pattern.ok() && pattern->has_token()) {
            bytes += bytes_of_frames(*pattern);
        } else {
            for (const std::string& path : {line, sequence::sidecar_path(line), line + ".png"})
                if (fs::is_regular_file(path, error)) bytes += int64_t(fs::file_size(path, error));
        }
    }
    return bytes;
}

Result<bool> settle(JobStore& store, const User& user) {
    bool freed = false;
    if (user.max_bytes == 0) return freed;
    ASSIGN_OR_RETURN(const auto entries, store.ledger(user.name));
    for (const LedgerEntry& entry : entries) {
        const int64_t bytes = bytes_on_disk(entry.writes);
        if (bytes >= entry.bytes) continue;
        RETURN_IF_ERROR(store.settle(user.name, entry.writes, bytes));
        freed = true;
    }
    return freed;
}

Status check_disk(JobStore& store, const KnownUser& owner) {
    if (!owner) return Status();
    const auto why = store.over_disk(*owner);
    // A store that fails is for the next change to say.
    if (!why.ok() || why->empty()) return Status();
    const auto freed = settle(store, *owner);
    if (freed.ok() && *freed) return check_disk(store, owner);
    return Status(StatusCode::output, *why + "; then retry the job");
}

std::string sidecar_of(const std::string& output, const Roots& roots) {
    const auto path = roots.resolve(sequence::sidecar_path(output));
    if (!path.ok()) return "";
    auto text = read_text_file(*path, StatusCode::output);
    return text.ok() ? std::move(*text) : std::string();
}

Answer<ShownFrame> shown_frame(const Job& job, const JobFrame& frame, bool after,
                               const JobReader& reader) {
    const Roots& roots = reader.roots();
    ASSIGN_OR_RETURN(const JobRequest request, reader.job(job.body));
    ASSIGN_OR_RETURN(const auto input, input_of(request));
    const std::string path = after ? frame.output : input.color().format(frame.frame);
    if (!roots.resolve(path).ok())
        return Problem{Problem::Kind::forbidden,
                       roots.shown(path) + ": links outside the folders of this service"};
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return not_found(roots.shown(path) + ": does not exist");
    ShownFrame shown{path, frame.frame};
    for (const auto& [key, word] : request.options) shown.words.push_back(word);
    return shown;
}

Answer<ShownFrame> shown_frame(const Job& job, const std::vector<JobFrame>& frames,
                               const JobReader& reader) {
    const auto done = [](const JobFrame& frame) {
        return frame.state == FrameState::written || frame.state == FrameState::skipped;
    };
    const auto last = std::find_if(frames.rbegin(), frames.rend(), done);
    if (last != frames.rend()) return shown_frame(job, *last, true, reader);
    JobFrame first = frames.empty() ? JobFrame() : frames.front();
    if (frames.empty()) {
        ASSIGN_OR_RETURN(const JobRequest request, reader.job(job.body));
        ASSIGN_OR_RETURN(const auto input, input_of(request));
        std::optional<io::FrameRange> range;
        if (const auto wanted = io::FrameRange::parse(request.value("frames", "")); wanted.ok())
            range = *wanted;
        const auto list = io::find_frames(input, range);
        if (!list.ok()) return not_found(reader.roots().shown_in(list.status().message()));
        first.frame = list->files.empty() ? 0 : list->files.begin()->first;
    }
    return shown_frame(job, first, false, reader);
}

Answer<ShownFrame> input_frame(const std::string& input, int frame, const Roots& roots) {
    const auto spec = io::InputSpec::parse(input);
    if (!spec.ok()) return Problem{Problem::Kind::invalid, spec.status().message()};
    auto pattern = resolve_pattern(spec->color(), roots);
    if (pattern.ok()) {
        const auto path = roots.resolve(pattern->format(frame));
        std::error_code error;
        if (path.ok() && !fs::is_regular_file(*path, error))
            return not_found(roots.shown(*path) + ": does not exist");
        if (path.ok()) return ShownFrame{*path, frame};
        pattern = path.status();
    }
    return Problem{Problem::Kind::forbidden, pattern.status().message()};
}

Result<std::string> image_of(const std::string& program, const ShownFrame& shown,
                             const Roots& roots, const PictureWanted& wanted, uint64_t memory) {
    const io::Json task = {{"folders", roots.entries()}, {"words", shown.words},
                           {"path", shown.path},         {"frame", shown.frame},
                           {"memory", memory},           {"type", wanted.type},
                           {"side", wanted.side}};
    ProcessSettings process{{program, kImageWord}};
    process.memory = kOwnMemory + 3 * memory;
    auto ran = run_program(process, io::json_text(task) + "\n", kLongestImage, wanted.left.get());
    if (!ran.ok()) return Status(StatusCode::input, ran.status().message()).at(shown.path);
    if (ran->exit_code == 0) return std::move(ran->out);
    if (ran->exit_code == 1) return status_of_json(ran->out);
    return Status(StatusCode::input,
                  shown.path + ": its reader crashed; the file is damaged or too large");
}

Status status_of_json(const std::string& text) {
    const auto fault = io::read_json(text, "fault");
    if (!fault.ok() || !fault->is_object())
        return Status(StatusCode::internal, "postchain-preview failed");
    return Status(StatusCode(value_of(*fault, "code", int(StatusCode::internal))),
                  value_of(*fault, "message", std::string()));
}

Answer<ResultFile> report_file_of(const Job& job, const std::string& name,
                                  const JobReader& reader) {
    ASSIGN_OR_RETURN(const JobRequest request, reader.job(job.body));
    if (request.kind == RequestKind::run) return not_found("job " + job.id + " has no report");
    const std::string& folder = request.output;
    const auto path = reader.roots().resolve(folder + "/" + name);
    std::error_code error;
    if (name.empty() || type_of(name).empty() || !path.ok() || !path->starts_with(folder + "/") ||
        !fs::is_regular_file(*path, error))
        return not_found("the report of job " + job.id + " does not have this file");
    return file_at(*path);
}

Answer<ResultFile> output_of(const JobFrame& frame, const Roots& roots) {
    const auto path = roots.resolve(frame.output);
    if (!path.ok()) return Problem{Problem::Kind::forbidden, path.status().message()};
    const bool done = frame.state == FrameState::written || frame.state == FrameState::skipped;
    std::error_code error;
    if (!done || !fs::is_regular_file(*path, error))
        return not_found(concat("frame ", frame.frame, " is not finished, or not on disk"));
    return file_at(*path);
}

}  // namespace postchain::service
