// The text of a request: a JSON object, with the place of each of its members, so that a fault is
// said with line and column.
#pragma once

#include <string>
#include <vector>

#include "config/diagnostic.h"
#include "tools/sequence/files/json.h"

namespace postchain::service {

inline constexpr size_t kMaxBodyBytes = 1 << 20;
inline constexpr int kMaxBodyDepth = 32;

struct JsonMember {
    std::string key;
    io::Json value;
    size_t key_at = 0;    // bytes from the beginning of the body
    size_t value_at = 0;  // the value's first byte
    size_t value_end = 0;
};

struct JsonBody {
    std::string text;
    std::vector<JsonMember> members;  // in their order

    const JsonMember* find(const std::string& key) const;
    // An error at this byte of the body.
    Diagnostic fault(size_t at, const std::string& path, const std::string& message) const;
    // The value alone where it stands in the body: what is before it is blank, line feeds stay.
    std::string alone(const JsonMember& member) const;
};

// File of the diagnostics of a body.
inline constexpr const char* kBodyFile = "job";

// `faults` gets: no JSON (with its place), no object, longer or deeper than allowed, a key that is
// there twice.
JsonBody read_json_body(const std::string& text, Diagnostics& faults);

}  // namespace postchain::service
