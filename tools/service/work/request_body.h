// The body of a request, read key by key: values into settings, paths held under the roots, and
// every fault that was met, at its place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "chain/parameter.h"
#include "config/diagnostic.h"
#include "tools/sequence/files/sequence.h"
#include "tools/service/work/json_body.h"
#include "tools/service/work/problem.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

class RequestBody {
  public:
    // `roots` outlives this. What is wrong with the text as a whole is among the faults.
    RequestBody(const std::string& text, const Roots& roots);

    const std::vector<JsonMember>& members() const { return body_.members; }
    const JsonMember* find(const std::string& key) const { return body_.find(key); }
    std::string alone(const JsonMember& member) const { return body_.alone(member); }
    // Where the body begins: the place of what is missing.
    size_t start() const { return body_.text.find('{'); }

    void fault(size_t at, const std::string& path, const std::string& message);
    void fault(const std::string& key, const std::string& message);
    // What Roots has to say.
    void outside(const std::string& key, const std::string& message);
    // Of a text that the body holds or names. `is_outside`: the roots refused a path of it.
    void add(Diagnostic diagnostic, bool is_outside = false);
    const Diagnostics& faults() const { return faults_; }
    // Of all faults; forbidden, where each is a path outside the roots.
    Problem problem() const;

    static bool has_zero(const std::string& text);
    // What the body has no key for stays as it is; a value of another kind is a fault.
    void integer(const char* key, int least, int most, int& value);
    std::vector<std::string> list(const char* key);
    void read_rows(const ParameterTable& table, const char* group, ParameterRef settings);

    // Paths become those under the roots, by their real names; one outside is a fault.
    void hold_file(const Parameter& row, ParameterRef settings);
    void hold_rows(const ParameterTable& table, ParameterRef settings);
    std::optional<io::InputSpec> hold_input(const std::string& key, const std::string& text);
    bool hold_picture(const std::string& key, Camera& camera);

  private:
    void read_row(const Parameter& row, const ParameterTable& table, ParameterRef settings);
    // The tables that a configuration of OpenColorIO names are under the roots too.
    void hold_tables(const std::string& key, const std::string& config);

    const Roots& roots_;
    Diagnostics faults_;
    const JsonBody body_;
    bool met_outside_ = false;
    bool only_outside_ = true;
};

}  // namespace postchain::service
