// Errors as application/problem+json (RFC 9457).
#pragma once

#include <string>

#include "tools/service/http/message.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// {"type": "about:blank", "title", "status", "detail"}. `detail` must not contain local paths.
Reply problem(int status, const std::string& detail);
// With the diagnostics as "errors", and Retry-After for busy and unavailable.
Reply problem(const Problem& what);

// Adds "request_id" to a problem; other replies stay.
void name_request(Reply& reply, const std::string& id);

// [{"file", "line", "column", "severity", "path", "message"}], as text.
std::string json_of(const Diagnostics& diagnostics);

}  // namespace postchain::service
