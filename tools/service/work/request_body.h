// The body of a request, read key by key: values into settings, paths checked against the roots,
// and every fault with its place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/diagnostic.h"
#include "config/text_tree.h"
#include "tools/sequence/files/sequence.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

// File name in the diagnostics of a body.
inline constexpr const char* kBodyFile = "job";

// The body as a tree, so that each fault has its line and column: a JSON object within the default
// limits of TextLimits. YAML that is not JSON is an error too.
TextTree read_json_body(const std::string& text);

bool is_string(const TextNode& node);

class RequestBody {
  public:
    // `roots` outlives this object. Faults of the whole text are among faults().
    RequestBody(const std::string& text, const Roots& roots)
        : roots_(roots), tree_(read_json_body(text)), faults_(tree_.diagnostics) {}

    const TextNode& root() const { return tree_.root; }
    const TextNode* find(const std::string& key) const { return tree_.root.find(key); }

    void fault(const TextNode& at, const std::string& path, const std::string& message);
    // At the value of the key that the message begins with, or of `key`; else at the body's start.
    void fault(const std::string& key, const std::string& message);
    // A fault of a text inside the body or named by it.
    void add(Diagnostic diagnostic) { faults_.push_back(std::move(diagnostic)); }
    const Diagnostics& faults() const { return faults_; }
    // All faults, the first one as its detail; forbidden if every one is a path outside the roots.
    Problem problem() const;

    static bool has_zero(const std::string& text);
    // Settings without a key in the body keep their values; a value of the wrong type is a fault.
    void integer(const char* key, int least, int most, int& value);
    std::vector<std::string> list(const char* key);

    // Replace paths by their real paths under the roots; a path outside is a fault.
    std::optional<std::string> confine(const std::string& key, const std::string& path);
    std::optional<io::PathPattern> confine(const std::string& key, const io::PathPattern& pattern);
    std::optional<io::InputSpec> confine_input(const std::string& key, const std::string& text);

  private:
    // The path, or the fault of a path with this error of Roots::resolve().
    template <class T>
    std::optional<T> confined(const std::string& key, Result<T> resolved);

    const Roots& roots_;
    const TextTree tree_;
    Diagnostics faults_;
    size_t outside_ = 0;  // faults that are paths outside the roots
};

}  // namespace postchain::service
