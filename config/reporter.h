// Reporter: collects the diagnostics of one text, with a limit on their number.
#pragma once

#include <string>

#include "chain/text.h"
#include "config/diagnostic.h"
#include "config/text_tree.h"

namespace postchain {

// So that a file of garbage does not answer with a million lines.
inline constexpr size_t kMaxDiagnostics = 100;

class Reporter {
  public:
    Reporter(std::string file, StatusCode code, Diagnostics& out)
        : file_(std::move(file)), code_(code), out_(out) {}

    void add(Severity severity, int line, int column, const std::string& path,
             const std::string& message);
    void error(const TextNode& at, const std::string& path, const std::string& message) {
        add(Severity::error, at.line, at.column, path, message);
    }
    void warning(const TextNode& at, const std::string& path, const std::string& message) {
        add(Severity::warning, at.line, at.column, path, message);
    }
    void note(const TextNode& at, const std::string& path, const std::string& message) {
        add(Severity::note, at.line, at.column, path, message);
    }

  private:
    std::string file_;
    StatusCode code_;
    Diagnostics& out_;
};

// Into the order of the text; the last word about too many errors stays last.
void sort_by_place(Diagnostics& diagnostics);

// "unknown key 'x' (did you mean 'y'?)" or with all known words when none is near; `what` is the
// kind of word: "key", "pass".
std::string unknown_word(const std::string& what, const std::string& word,
                         const std::vector<std::string>& known);

}  // namespace postchain
