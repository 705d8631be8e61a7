// Runs the built command as from a user's shell, and captures its outcome.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain::test {

using Arguments = std::vector<std::string>;
using Json = nlohmann::ordered_json;

struct Launch {
    std::map<std::string, std::optional<std::string>> environment = {};  // no value: unset
    std::string folder = {};                                             // working folder
    std::optional<long> file_bytes = {};                                 // RLIMIT_FSIZE
    std::optional<long> memory_bytes = {};                               // RLIMIT_AS
    std::string stdout_path = {};                                        // instead of capturing it
    bool close_stdout = false;
    bool close_stderr = false;
    double timeout_s = 300;  // then the process is killed and the test fails
};

struct Outcome {
    int code = -1;    // -1 if a signal ended it
    int signal = 0;   // the signal that ended it
    std::string out;  // stdout
    std::string err;  // stderr
    long peak_kib = 0;

    std::string text() const;  // for failure messages
};

// A running process; command[0] is the program.
class Process {
  public:
    Process(const Arguments& command, const Launch& launch = {});
    ~Process();  // kills it if it was not waited for
    Process(const Process&) = delete;

    void send(int signal) const;
    bool running();
    // Waits until `state` or the process's end.
    template <class State>
    void until(const State& state) {
        const auto last = std::chrono::steady_clock::now() + std::chrono::seconds(120);
        while (running() && !state() && std::chrono::steady_clock::now() < last)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    Outcome wait();

  private:
    Launch launch_;
    TempFolder folder_;  // holds the captured streams
    pid_t pid_ = -1;
    int status_ = 0;
    long peak_kib_ = 0;
    bool done_ = false;
};

inline Arguments joined(Arguments words, const Arguments& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}
// The command line of the built postchain.
Arguments with_command(const Arguments& arguments);
// The first argument is the subcommand: run({"plan", "paper", "-i", ...}).
Outcome run(const Arguments& arguments, const Launch& launch = {});
Outcome run_program(const Arguments& command, const Launch& launch = {});

// JSON objects of a text with one per line; the test fails if a line is not one.
std::vector<Json> json_lines(const std::string& text);

bool contains(const std::string& text, const std::string& part);

// It ends with this exit code, and stderr or stdout has each of the words.
void expect_ends(const Outcome& outcome, int code, const std::vector<std::string>& words = {});
void expect_prints(const Outcome& outcome, int code, const std::vector<std::string>& words);

// The first group of each match.
std::vector<std::string> matches(const std::string& text, const std::string& pattern);

}  // namespace postchain::test
