// Diagnostics: errors, warnings and notes of a configuration reader, with their places.
//
// Readers continue after an error, so that one run shows every mistake of a file.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain {

enum class Severity { note, warning, error };
const char* name_of(Severity severity);  // "note", "warning", "error"

struct Diagnostic {
    std::string file;  // name of the text: a path, or "--set passes[0].samples=24"
    int line = 0;      // from 1; 0 = the whole file, or a text without lines (--set)
    int column = 0;    // from 1, in characters (not bytes)
    Severity severity = Severity::error;
    std::string path;  // "passes[1].samples"; empty = the whole file
    std::string message;
    StatusCode code = StatusCode::chain;  // errors only: selects the exit code of a tool

    // "file:line:col: error: passes[1].samples: 24 is even; ...", one printable() line.
    std::string text() const;
    bool operator==(const Diagnostic&) const = default;
};

using Diagnostics = std::vector<Diagnostic>;

bool has_errors(const Diagnostics& diagnostics);
// One line each, in order.
std::string text_of(const Diagnostics& diagnostics);
// One error (StatusCode::memory) for a text that does not fit into memory.
Diagnostics out_of_memory_in(const std::string& file);
// Success, or all errors (no notes, no warnings) as one Status, one line each. Its code is that of
// the first error other than `usage`, otherwise `usage`.
Status status_of(const Diagnostics& diagnostics);

}  // namespace postchain
