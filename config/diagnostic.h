// Diagnostics: what a reader of configuration text found, with its place.
//
// Readers collect all of them and go on, so that one run shows every mistake of a file.
#pragma once

#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain {

enum class Severity { note, warning, error };
const char* name_of(Severity severity);  // "note", "warning", "error"

struct Diagnostic {
    std::string file;  // name of the text: a path, or "--set passes[0].samples=24"
    int line = 0;      // from 1; 0 = the text has no lines (--set) or the whole file is meant
    int column = 0;    // from 1, in characters (not bytes)
    Severity severity = Severity::error;
    std::string path;  // "passes[1].samples"; empty = the file itself
    std::string message;
    StatusCode code = StatusCode::chain;  // of an error: what a tool's exit code comes from

    // "file:line:col: error: passes[1].samples: 24 is even; ..."
    std::string text() const;
    bool operator==(const Diagnostic&) const = default;
};

using Diagnostics = std::vector<Diagnostic>;

bool has_errors(const Diagnostics& diagnostics);
// One line each, in order.
std::string text_of(const Diagnostics& diagnostics);
// Of a text for which there was not enough memory (StatusCode::memory).
Diagnostics out_of_memory_in(const std::string& file);
// Success, or all errors (no notes, no warnings) as one Status, one line each. The code is that of
// the first error that is not `usage`, else `usage`.
Status status_of(const Diagnostics& diagnostics);

}  // namespace postchain
