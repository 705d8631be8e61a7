#include "tools/service/work/programs.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <sstream>

#include "chain/base/printable.h"
#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "tools/service/work/process.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

constexpr auto kLimit = std::chrono::seconds(100);  // below that of a request
constexpr int kMostPlanned = 100;                   // frames of a request

// A JSON object that is the first line of a text.
std::optional<Json> first_object(const std::string& text) {
    const auto json = io::read_json(text.substr(0, text.find('\n')), "answer", io::kReportLimits);
    if (!json.ok() || !json->is_object()) return std::nullopt;
    return *json;
}

}  // namespace

std::string place_of_own_folder() {
    constexpr std::string_view kName = "postchain-serve.";
    std::error_code error;
    const std::string parent = fs::temp_directory_path(error).string();
    for (fs::directory_iterator at(parent, error), end; !error && at != end; at.increment(error)) {
        const std::string name = at->path().filename();
        struct stat found = {};
        if (!name.starts_with(kName) || ::lstat(at->path().c_str(), &found) != 0 ||
            found.st_uid != ::geteuid())
            continue;
        const pid_t process = std::atoi(name.c_str() + kName.size());
        std::error_code ignored;
        if (process > 0 && ::kill(process, 0) != 0) fs::remove_all(at->path(), ignored);
    }
    return concat(parent, "/", kName, ::getpid(), ".");
}

PrivateFolder::PrivateFolder(const std::string& begin) : path_(begin + "XXXXXX") {
    if (!::mkdtemp(path_.data())) path_.clear();
}

PrivateFolder::~PrivateFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
}

std::string last_line(const std::string& messages) {
    std::string last;
    std::istringstream lines(messages);
    for (std::string line; std::getline(lines, line);)
        if (!line.empty()) last = line;
    for (const std::string_view word : {"postchain: ", "error: "})
        if (last.starts_with(word)) last.erase(0, word.size());
    return printable(last);
}

std::string random_name(const std::string& prefix) {
    std::random_device random;
    const auto half = [&] { return hex_of(uint64_t(random()) << 32 | random()); };
    return prefix + half() + half();
}

std::vector<std::string> confining_words(const Roots& roots, const std::string& own) {
    std::vector<std::string> words;
    for (const std::string& folder : roots.entries()) words.push_back("--confine-to=" + folder);
    words.push_back("--also-read=" + own);
    return words;
}

Problem problem_of_faults(const Json& faults, const std::string& body, const JobRequest& request,
                          const Roots& roots) {
    RequestBody text(body, roots);
    for (const Json& fault : faults) {
        if (!fault.is_object()) continue;
        const std::string file = value_of(fault, "file", std::string()),
                          message = value_of(fault, "message", std::string());
        if (file.empty()) {
            text.fault(value_of(fault, "key", std::string()), message);
            continue;
        }
        Diagnostic one;
        one.file = file;
        one.line = value_of(fault, "line", 0);
        one.column = value_of(fault, "column", 0);
        one.path = value_of(fault, "path", std::string());
        one.message = message;
        for (const NamedText& subject : request.subjects)
            if (subject.written && fs::path(file).filename() == subject.word)
                one.file = subject.in_body ? kBodyFile : subject.key + "_text";
        text.add(std::move(one));
    }
    return text.problem();
}

Result<Schemas> Programs::schemas(const std::string& version) const {
    ASSIGN_OR_RETURN(const auto found, run_program({{program_, "--version"}}, "", kLimit));
    std::string expected = "postchain " + version + "\n";
    if (found.out != expected)
        return Status(StatusCode::usage,
                      concat(program_, " is ", last_line(found.out), ", the service is ", version));
    Schemas schemas;
    for (const RequestKind kind : kRequestKinds) {
        if (kind == RequestKind::preview) continue;
        ASSIGN_OR_RETURN(const auto said,
                         run_program({{program_, name_of(kind), "--schema"}}, "", kLimit));
        const auto json =
            io::read_json(said.out, concat(program_, " ", name_of(kind)), io::kReportLimits);
        // Without the lab its kinds are missing.
        if (said.exit_code != 0 && kind != RequestKind::run && kind != RequestKind::plan) continue;
        RETURN_IF_ERROR(json.status());
        schemas[kind] = *json;
    }
    schemas[RequestKind::preview] = schemas.at(RequestKind::plan);
    return schemas;
}

Answer<Programs::Said> Programs::ask(const std::string& body, const JobRequest& request,
                                     const Roots& roots,
                                     const std::vector<std::string>& words) const {
    const PrivateFolder texts(folder_ + "/ask-");
    if (texts.path().empty() || !write_texts(request, texts.path()).ok())
        return Problem{
            Problem::Kind::unavailable, folder_ + ": cannot be written", {}, kRetryAfterS};
    ProcessSettings process;
    process.words = {program_};
    for (std::string& word : words_of(request, texts.path())) process.words.push_back(word);
    for (std::string& word : confining_words(roots, texts.path())) process.words.push_back(word);
    process.words.insert(process.words.end(), words.begin(), words.end());
    process.folder = roots.folders().front();
    process.memory = memory_;
    const auto ran = run_program(process, "", kLimit);
    if (!ran.ok())
        return Problem{
            Problem::Kind::unavailable, roots.shown_in(ran.status().message()), {}, kRetryAfterS};
    if (const auto json = first_object(ran->out); json && json->contains("faults"))
        return problem_of_faults(json->at("faults"), body, request, roots);
    if (ran->exit_code > 128)
        return Problem{Problem::Kind::invalid,
                       "a file that the request names crashed its reader; it is damaged"};
    return Said{ran->exit_code, ran->out, roots.shown_in(last_line(ran->err))};
}

Answer<CheckedJob> Programs::check(const std::string& body, const JobRequest& request,
                                   const Roots& roots) const {
    std::vector<std::string> checking = {"--check"};
    // By default a failed frame does not end a job of the service.
    if (request.kind == RequestKind::run && request.value("on_error", "").empty())
        checking.emplace_back("--on-error=continue");
    ASSIGN_OR_RETURN(const Said said, ask(body, request, roots, checking));
    const auto json = first_object(said.out);
    if (said.exit_code != 0 || !json) {
        RequestBody text(body, roots);
        text.fault("", said.last_error);
        return text.problem();
    }
    CheckedJob job;
    for (const std::string& line : value_of(*json, "writes", std::vector<std::string>()))
        job.writes += (job.writes.empty() ? "" : "\n") + line;
    job.warnings = value_of(*json, "warnings", std::vector<std::string>());
    for (std::string& warning : job.warnings) warning = roots.shown_in(warning);
    job.needs_new_folder = json->value("new_folder", false);
    const auto frames = json->find("frames");
    if (frames == json->end() || !frames->is_array()) {
        job.frames = value_of(*json, "frames", 0);
        return job;
    }
    for (const Json& one : *frames) {
        if (!one.is_object()) continue;
        JobFrame frame;
        frame.frame = value_of(one, "frame", 0);
        frame.output = value_of(one, "output", std::string());
        if (one.contains("missing")) {
            frame.state = FrameState::missing;
            frame.message = roots.shown_in(value_of(one, "missing", std::string()));
        } else if (one.contains("refused")) {
            frame.state = FrameState::quarantined;
            frame.message = roots.shown_in(value_of(one, "refused", std::string()));
        }
        job.of_run.push_back(std::move(frame));
    }
    job.frames = int(job.of_run.size());
    return job;
}

Answer<std::string> Programs::plan(const std::string& body, const JobRequest& request,
                                   const Roots& roots) const {
    const int most = request.value("frames", "").empty() ? 1 : kMostPlanned;
    ASSIGN_OR_RETURN(const Said said,
                     ask(body, request, roots, {"--json", concat("--most=", most)}));
    Json frames = Json::array();
    std::istringstream lines(said.out);
    for (std::string line; std::getline(lines, line);) {
        auto read = io::read_json(line, "plan", io::kReportLimits);
        if (!read.ok() || !read->is_object()) continue;
        Json frame = {{"frame", value_of(*read, "frame", 0)}};
        const auto warnings = read->find("warnings");
        frame["warnings"] = warnings == read->end() ? Json::array() : *warnings;
        read->erase("warnings");
        if (read->contains("error"))
            frame["error"] = value_of(*read, "error", std::string());
        else
            frame["plan"] = std::move(*read);
        frames.push_back(std::move(frame));
    }
    if (frames.empty()) {
        RequestBody text(body, roots);
        text.fault("", said.last_error);
        return text.problem();
    }
    return roots.shown_in(io::json_text({{"frames", std::move(frames)}}));
}

}  // namespace postchain::service
