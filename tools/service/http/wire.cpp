#include "tools/service/http/wire.h"

#include <algorithm>
#include <ctime>

#include "tools/service/http/problem.h"

namespace postchain::service {
namespace {

namespace http = boost::beast::http;

std::string date() {
    const std::time_t now = std::time(nullptr);
    std::tm parts = {};
    gmtime_r(&now, &parts);
    char text[64];
    std::strftime(text, sizeof(text), "%a, %d %b %Y %H:%M:%S GMT", &parts);
    return text;
}

// RFC 9112, 3.2.2: the address of a target such as http://host/v1/jobs takes the place of Host.
void take_address(Request& request) {
    for (const std::string_view scheme : {"http://", "https://"}) {
        if (!same_word(std::string_view(request.target).substr(0, scheme.size()), scheme)) continue;
        const size_t end =
            std::min(request.target.find_first_of("/?", scheme.size()), request.target.size());
        for (auto& [name, value] : request.headers)
            if (same_word(name, "Host"))
                value = request.target.substr(scheme.size(), end - scheme.size());
        request.target.erase(0, end);
        if (!request.target.starts_with('/')) request.target.insert(0, "/");
        return;
    }
}

// Headers of every reply: nosniff, no-referrer, and a policy for frames and scripts.
Headers security_headers(const Reply& reply) {
    Headers headers = {{"X-Content-Type-Options", "nosniff"},
                       {"Referrer-Policy", "no-referrer"},
                       {"Cross-Origin-Resource-Policy", "same-origin"},
                       {"Cache-Control", "no-store"}};
    bool has_policy = false;
    for (const auto& [name, value] : reply.headers) has_policy |= name == kPolicy;
    if (!has_policy) headers.emplace_back(kPolicy, "default-src 'none'; frame-ancestors 'none'");
    return headers;
}

}  // namespace

Request request_of(const Parser& parser) {
    const auto& message = parser.get();
    Request request;
    request.method = std::string(message.method_string());
    request.target = std::string(message.target());
    request.http_1_0 = message.version() < 11;
    for (const auto& field : message)
        request.headers.emplace_back(std::string(field.name_string()), std::string(field.value()));
    take_address(request);
    return request;
}

std::optional<Reply> refusal_of(const boost::system::error_code& error, uint64_t max_body) {
    if (error == http::error::header_limit) return problem(431, "the header is too long");
    if (error == http::error::body_limit)
        return problem(413, concat("the body is longer than ", max_body, " bytes"));
    if (error == http::error::bad_version)
        return problem(505, "this service supports only HTTP/1.1");
    const bool malformed =
        error.category() == http::make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message;
    if (malformed) return problem(400, "the request is not well formed");
    return std::nullopt;
}

// No header value contains a line break.
std::string head_of(const Reply& reply, bool keep) {
    std::string head = "HTTP/1.1 " + std::to_string(reply.status) + " " + reason_of(reply.status);
    const auto add = [&](const std::string& name, const std::string& value) {
        head += "\r\n" + name + ": " + value;
    };
    add("Date", date());
    for (const auto& [name, value] : security_headers(reply)) add(name, value);
    for (const auto& [name, value] : reply.headers) add(name, value);
    if (reply.status != 204) add("Content-Type", reply.type);
    // nginx would keep events until its buffer is full.
    if (reply.events) add("X-Accel-Buffering", "no");
    if (!reply.events && reply.status != 204)
        add("Content-Length",
            std::to_string(reply.source ? reply.source->bytes() : reply.body.size()));
    if (!keep) add("Connection", "close");
    return head + "\r\n\r\n";
}

}  // namespace postchain::service
