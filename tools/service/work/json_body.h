// The body of a request as a tree (config/text_tree.h): each fault has its line and column.
#pragma once

#include <string>

#include "config/text_tree.h"

namespace postchain::service {

// File name in the diagnostics of a body.
inline constexpr const char* kBodyFile = "job";

// A JSON object within the default limits of TextLimits. YAML that is not JSON is an error too.
TextTree read_json_body(const std::string& text);

bool is_string(const TextNode& node);

}  // namespace postchain::service
