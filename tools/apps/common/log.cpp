#include "tools/apps/common/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <ctime>

#include "chain/base/printable.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_survey.h"

namespace postchain::log {
namespace {

constexpr const char* kNames[] = {"detail", "info", "warning", "error"};

constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info,
                                                 spdlog::level::warn, spdlog::level::err};

bool g_json = false;
bool g_terminal = false;
bool g_line_open = false;
bool g_openjd = false;
std::string g_percent;  // last value printed

spdlog::logger& logger() {
    static const auto made = spdlog::stderr_logger_mt("postchain");
    return *made;
}

// Prints one line on stdout, which in that mode carries the messages.
void tell(const char* what, const std::string& text) {
    std::printf("%s: %s\n", what, printable(as_options(text)).c_str());
    std::fflush(stdout);
}

}  // namespace

std::string duration(double seconds) {
    const long s = long(seconds + 0.5);
    char text[32];
    if (s >= 3600)
        std::snprintf(text, sizeof(text), "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
    else
        std::snprintf(text, sizeof(text), "%ld:%02ld", s / 60, s % 60);
    return text;
}

void set_up(bool verbose, bool quiet, bool json) {
    g_json = json;
    g_terminal = !quiet && !json && isatty(STDERR_FILENO);
    logger().set_level(quiet ? spdlog::level::err
                             : (verbose ? spdlog::level::debug : spdlog::level::info));
    logger().set_pattern("%v");
    logger().flush_on(spdlog::level::debug);
}

void write(Level level, const std::string& text) {
    const bool named = !g_json && (level == Level::warning || level == Level::error);
    write_as_is(level, named ? concat("postchain: ", kNames[size_t(level)], ": ", text) : text);
}

void write_event(Level level, const std::string& text, const io::Json& fields) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    const std::time_t seconds = std::time_t(ms / 1000);
    std::tm parts = {};
    gmtime_r(&seconds, &parts);
    char date[32], time[48];
    std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%S", &parts);
    std::snprintf(time, sizeof(time), "%s.%03dZ", date, int(ms % 1000));
    if (!g_json) return write_as_is(level, concat(time, " ", text));
    io::Json line = {
        {"time", time}, {"level", kNames[size_t(level)]}, {"message", as_options(text)}};
    line.update(fields);
    logger().log(kLevels[size_t(level)], "{}", io::json_text(line));
}

void write_as_is(Level level, const std::string& text) {
    const auto index = static_cast<size_t>(level);
    progress("");
    std::fflush(stdout);  // both may be one file, in which lines keep their order
    if (g_openjd && level == Level::error) tell("openjd_fail", text);
    if (g_json) {
        const io::Json line = {{"level", kNames[index]}, {"message", as_options(text)}};
        logger().log(kLevels[index], "{}", io::json_text(line));
        return;
    }
    logger().log(kLevels[index], "{}", printable(as_options(text)));
}

Status write(const Diagnostics& diagnostics, Level notes) {
    for (const auto& one : diagnostics)
        write_as_is(one.severity == Severity::note      ? notes
                    : one.severity == Severity::warning ? Level::warning
                                                        : Level::error,
                    one.text());
    const Status status = status_of(diagnostics);
    return status.ok() ? status : Status(status.code(), "");
}

void progress(const std::string& text) {
    if (!g_terminal || (text.empty() && !g_line_open)) return;
    std::fprintf(stderr, "\r\033[K%s", printable(as_options(text)).c_str());
    std::fflush(stderr);
    g_line_open = !text.empty();
}

bool progress_is_shown() {
    return g_terminal;
}

void progress(double share, const std::string& text) {
    progress(text);
    if (!g_openjd) return;
    char percent[16];
    std::snprintf(percent, sizeof(percent), "%.1f", 100 * share);
    if (g_percent == percent) return;
    g_percent = percent;
    tell("openjd_progress", percent);
    tell("openjd_status", text);
}

void tell_openjd() {
    g_openjd = true;
}

}  // namespace postchain::log

namespace postchain {

void FrameErrors::add(int frame, const Status& status) {
    const auto [fault, is_new] =
        faults_.try_emplace(sequence::fault_of(status.message()), Fault{frame, {}});
    if (is_new)
        log::error(status.message());
    else
        fault->second.more.push_back(frame);
}

void FrameErrors::finish() const {
    for (const auto& [words, fault] : faults_)
        if (!fault.more.empty())
            log::error(concat(fault.more.size() == 1 ? "frame " : "frames ",
                              sequence::frames_text(fault.more), ": the error of frame ",
                              fault.first));
}

int fail(const Status& status) {
    if (!status.message().empty()) log::error(status.message());
    return exit_code(status);
}

void print_text(const std::string& text) {
    std::fputs(printable(as_options(text), Lines::keep).c_str(), stdout);
}

void print_line(const io::Json& json) {
    std::printf("%s\n", io::json_text(json).c_str());
    std::fflush(stdout);
}

}  // namespace postchain
