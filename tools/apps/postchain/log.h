// Messages on stderr: text, or one JSON object per line with --log-format json.
#pragma once

#include <string>

namespace postchain::log {

enum class Level { detail, info, warning, error };

void set_up(bool verbose, bool quiet, bool json);
void write(Level level, const std::string& text);
// Without "postchain: error: " in front: a diagnostic, which says place and severity itself.
void write_as_is(Level level, const std::string& text);
inline void detail(const std::string& text) {
    write(Level::detail, text);
}
inline void info(const std::string& text) {
    write(Level::info, text);
}
inline void warning(const std::string& text) {
    write(Level::warning, text);
}
inline void error(const std::string& text) {
    write(Level::error, text);
}

// The line that is rewritten in place on a terminal; an empty text clears it. Does nothing when
// stderr is no terminal or with --quiet or JSON.
void progress(const std::string& text);
bool progress_is_shown();
// The same, and how much is done (0 to 1), for the manager of a farm where it is told.
void progress(double share, const std::string& text);

// From now on stdout gets the lines of Open Job Description, whose runner makes a progress bar and
// a status of them: openjd_progress (percent) and openjd_status where progress is given with a
// share, openjd_fail with each error. Source: OpenJobDescription/openjd-specifications, "How Jobs
// Are Run", stdout/stderr messages.
void tell_openjd();

}  // namespace postchain::log
