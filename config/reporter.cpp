#include "config/reporter.h"

#include <algorithm>
#include <tuple>

#include "config/scalar.h"

namespace postchain {

void Reporter::add(Severity severity, int line, int column, const std::string& path,
                   const std::string& message) {
    if (out_.size() > kMaxDiagnostics) return;
    if (out_.size() == kMaxDiagnostics) {
        out_.push_back({file_, line, column, Severity::error, "",
                        "too many errors; the others are not shown", code_});
        return;
    }
    out_.push_back({file_, line, column, severity, path, message, code_});
}

void Reporter::check_version(const TextNode& node, const std::string& path, int version) {
    const Result<ParameterValue> value = value_of(node);
    if (!value.ok() || *value != ParameterValue(int64_t(version)))
        error(node, path,
              concat(node.describe(), " is not supported; this program reads version ", version));
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
