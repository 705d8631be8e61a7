// Reporter: collects the diagnostics of one text, up to kMaxDiagnostics.
#pragma once

#include <string>

#include "chain/base/text.h"
#include "config/diagnostic.h"
#include "config/text_tree.h"

namespace postchain {

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
    // Whether further ones are not shown.
    bool full() const { return out_.size() > kMaxDiagnostics; }
    // An error unless `node` is the version of the format that this program reads.
    void check_version(const TextNode& node, const std::string& path, int version);

  private:
    std::string file_;
    StatusCode code_;
    Diagnostics& out_;
};

// Sorts by place in the text; the note about too many errors stays last.
void sort_by_place(Diagnostics& diagnostics);

// "unknown key 'x' (did you mean 'y'?)", or with all known words if none is close. `what`: the kind
// of word, such as "key" or "pass".
std::string unknown_word(const std::string& what, const std::string& word,
                         const std::vector<std::string>& known);

}  // namespace postchain
