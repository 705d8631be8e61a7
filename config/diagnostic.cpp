#include "config/diagnostic.h"

#include <algorithm>
#include <tuple>

#include "chain/parameter.h"
#include "config/reporter.h"

namespace postchain {

const char* name_of(Severity severity) {
    switch (severity) {
        case Severity::note:
            return "note";
        case Severity::warning:
            return "warning";
        case Severity::error:
            return "error";
    }
    return "error";
}

std::string Diagnostic::text() const {
    std::string text = file;
    if (line > 0) text += ":" + std::to_string(line) + ":" + std::to_string(column);
    text += concat(": ", name_of(severity), ": ");
    if (!path.empty()) text += path + ": ";
    return text + message;
}

bool has_errors(const Diagnostics& diagnostics) {
    for (const auto& d : diagnostics)
        if (d.severity == Severity::error) return true;
    return false;
}

std::string text_of(const Diagnostics& diagnostics) {
    std::string text;
    for (const auto& d : diagnostics) text += d.text() + "\n";
    return text;
}

Status status_of(const Diagnostics& diagnostics) {
    StatusCode code = StatusCode::ok;
    std::string text;
    for (const auto& d : diagnostics) {
        if (d.severity != Severity::error) continue;
        if (code == StatusCode::ok || code == StatusCode::usage) code = d.code;
        text += (text.empty() ? "" : "\n") + d.text();
    }
    return code == StatusCode::ok ? Status() : Status(code, text);
}

void Reporter::add(Severity severity, int line, int column, const std::string& path,
                   const std::string& message) {
    if (out_.size() > kMaxDiagnostics) return;
    if (out_.size() == kMaxDiagnostics) {
        out_.push_back({file_, line, column, Severity::error, "",
                        "too many errors; the rest is not shown", code_});
        return;
    }
    out_.push_back({file_, line, column, severity, path, message, code_});
}

void sort_by_place(Diagnostics& diagnostics) {
    const size_t count = std::min(diagnostics.size(), kMaxDiagnostics);
    std::stable_sort(diagnostics.begin(), diagnostics.begin() + std::ptrdiff_t(count),
                     [](const Diagnostic& a, const Diagnostic& b) {
                         return std::tie(a.line, a.column) < std::tie(b.line, b.column);
                     });
}

std::string unknown_word(const std::string& what, const std::string& word,
                         const std::vector<std::string>& known) {
    const std::string near = nearest_word(word, known);
    return "unknown " + what + " '" + word + "'" +
           (near.empty() ? "; known are " + joined(known) : " (did you mean '" + near + "'?)");
}

}  // namespace postchain
