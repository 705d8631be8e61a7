// Output of the command: messages on stderr, as text or with --log-format json as one JSON object
// per line; text and JSON lines on stdout; and its exit code. Settings as_options().
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/diagnostic.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::log {

enum class Level { detail, info, warning, error };

void set_up(bool verbose, bool quiet, bool json);
void write(Level level, const std::string& text);
// An event with a time: in text before the message, in JSON "time" and the members of `fields`.
void write_event(Level level, const std::string& text, const io::Json& fields);
// Prints without "postchain: error: " in front: a diagnostic states place and severity itself.
void write_as_is(Level level, const std::string& text);
// Writes each on its line, notes at the level `notes`. Errors become a status without a message,
// which fail() does not print again.
Status write(const Diagnostics& diagnostics, Level notes);
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

// "1:02:03", "2:03".
std::string duration(double seconds);

// Progress line, rewritten in place on a terminal; an empty string clears it. Does nothing if
// stderr is not a terminal, with --quiet, or with JSON.
void progress(const std::string& text);
bool progress_is_shown();
// Also reports the fraction done (0 to 1) to a farm's manager, if enabled.
void progress(double share, const std::string& text);

// Prints Open Job Description lines on stdout from now on, for its runner's progress bar and
// status: openjd_progress (percent) and openjd_status for progress with a fraction, openjd_fail for
// each error. Source: OpenJobDescription/openjd-specifications, "How Jobs Are Run", stdout/stderr
// messages.
void tell_openjd();

}  // namespace postchain::log

namespace postchain {

// Errors of frames. One that many frames share, apart from the path it begins with, is printed for
// the first of them.
class FrameErrors {
  public:
    void add(int frame, const Status& status);
    // Says which frames had errors that were not printed. Call it after the last frame.
    void finish() const;

  private:
    struct Fault {
        int first = 0;
        std::vector<int> more;
    };
    std::map<std::string, Fault> faults_;  // by message without its path
};

// Prints the status as an error, unless it is already printed, and returns its exit code.
int fail(const Status& status);
// Standard output: text; a line, also if a reader waits for it, and whole if other threads print
// theirs. Text may contain invalid UTF-8.
void print_text(const std::string& text);
void print_line(const io::Json& json);

}  // namespace postchain
