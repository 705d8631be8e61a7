#include "tools/service/http/problem.h"

#include <algorithm>

#include "tools/service/http/job_json.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr const char* kProblemType = "application/problem+json";

int status_of_kind(Problem::Kind kind) {
    constexpr int kStatuses[] = {422, 404, 409, 403, 429, 503, 500};
    return kStatuses[size_t(kind)];
}

Json array_of(const Diagnostics& diagnostics) {
    Json array = Json::array();
    for (const Diagnostic& one : diagnostics) array.push_back(json_of(one, diagnostic_fields()));
    return array;
}

Reply reply_of(int status, const std::string& detail, Json errors) {
    Json body = {{"type", "about:blank"}, {"title", reason_of(status)}, {"status", status}};
    body["detail"] = detail;
    if (!errors.empty()) body["errors"] = std::move(errors);
    Reply reply;
    reply.status = status;
    reply.type = kProblemType;
    reply.body = io::json_text(body) + "\n";
    return reply;
}

}  // namespace

Reply problem(int status, const std::string& detail) {
    return reply_of(status, detail, Json::array());
}

Reply problem(const Problem& what) {
    Reply reply = reply_of(status_of_kind(what.kind), what.detail, array_of(what.diagnostics));
    if (what.kind == Problem::Kind::busy || what.kind == Problem::Kind::unavailable)
        reply.headers.emplace_back("Retry-After", std::to_string(std::max(1, what.retry_after_s)));
    return reply;
}

void name_request(Reply& reply, const std::string& id) {
    if (reply.type != kProblemType) return;
    Json body = Json::parse(reply.body);
    body["request_id"] = id;
    reply.body = io::json_text(body) + "\n";
}

std::string json_of(const Diagnostics& diagnostics) {
    return io::json_text(array_of(diagnostics));
}

}  // namespace postchain::service
