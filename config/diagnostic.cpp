#include "config/diagnostic.h"

#include "chain/base/printable.h"

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
    return printable(text + message);
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

Diagnostics out_of_memory_in(const std::string& file) {
    Diagnostic diagnostic;
    diagnostic.file = file;
    diagnostic.message = "not enough memory";
    diagnostic.code = StatusCode::memory;
    return {diagnostic};
}

Status status_of(const Diagnostics& diagnostics) try {
    StatusCode code = StatusCode::ok;
    std::string text;
    for (const auto& d : diagnostics) {
        if (d.severity != Severity::error) continue;
        if (code == StatusCode::ok || code == StatusCode::usage) code = d.code;
        text += (text.empty() ? "" : "\n") + d.text();
    }
    return code == StatusCode::ok ? Status() : Status(code, text);
} catch (...) {
    return status_of_exception("diagnostics");
}

}  // namespace postchain
