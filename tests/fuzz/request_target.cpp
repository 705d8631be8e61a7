// The target `request`: a client's bytes, through parser, guard and routes, to the reply's bytes,
// with a fake service and without sockets.
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "guarantees.h"
#include "targets.h"
#include "tests/service/fake_service.h"
#include "tools/service/http/connection.h"
#include "tools/service/http/routes.h"

namespace postchain::fuzz {
namespace {

using namespace postchain::service;

constexpr uint32_t kMaxHeader = 4096;
constexpr uint64_t kMaxBody = 8192;

std::shared_ptr<Users> one_user() {
    const auto path = std::filesystem::temp_directory_path() /
                      ("postchain-fuzz-users-" + std::to_string(getpid()));
    std::ofstream(path) << "postchain_users: 1\nusers: {ann: {tokens: ["
                        << *hash_of_token("0123456789abcdef") << "]}}\n";
    auto users = *Users::of_file(path.string(), [](const std::string&) { return Status(); });
    std::filesystem::remove(path);
    return users;
}

// With a token in half of the runs: the same request must not be answered without it.
struct Behind {
    std::unique_ptr<Service> service = test::fake_service({});
    RequestThreads threads = {[] { return size_t(0); }, [] { return true; },
                              [] { return std::chrono::milliseconds(0); },
                              [] { return std::string(); }};
    Api open{*service, {}, "0", threads};
    Api closed{*service, {.users = one_user(), .hosts = {"render.example"}}, "0", threads};
};

void check(const Reply& reply, const Request& request) {
    require(reason_of(reply.status) != "<unknown-status>", "a status has its reason");
    if (reply.status >= 400) {
        require(reply.type == "application/problem+json", "a refusal is a problem");
        const auto json = nlohmann::json::parse(reply.body, nullptr, false);
        require(json.is_object() && json["status"] == reply.status, "a problem has its status");
    }
    const std::string head = head_of(reply, true);
    require(head.ends_with("\r\n\r\n") && head.find("\r\n\r\n") == head.size() - 4,
            "a head has one end");
    for (size_t at = 0; (at = head.find_first_of("\r\n", at)) != std::string::npos; at += 2)
        require(head.compare(at, 2, "\r\n") == 0, "lines end as lines do");
    if (reply.events) require(request.method == "GET", "events are for GET");
}

Reply answer_of(const Api& api, const Request& request) {
    auto admitted = api.admit(request);
    if (auto* refused = std::get_if<Reply>(&admitted)) return std::move(*refused);
    int answers = 0;
    Reply reply;
    api.run(std::get<Admitted>(admitted), request, [&](Reply given) {
        ++answers;
        reply = std::move(given);
    });
    require(answers == 1, "one answer");
    return reply;
}

}  // namespace

bool request(std::string_view bytes) {
    static int runs = 0;
    static auto behind = std::make_unique<Behind>();
    if (++runs % 10000 == 0) behind = std::make_unique<Behind>();  // jobs were stored

    Parser parser;
    parser.header_limit(kMaxHeader);
    parser.body_limit(kMaxBody);
    parser.eager(true);
    boost::system::error_code error;
    size_t used = 0;
    while (!parser.is_done() && !error && used < bytes.size()) {
        const size_t more =
            parser.put(boost::asio::const_buffer(bytes.data() + used, bytes.size() - used), error);
        used += more;
        if (more == 0) break;
    }
    require(used <= bytes.size(), "no more is read than there is");
    if (error) {
        if (const auto refusal = refusal_of(error, kMaxBody)) check(*refusal, {});
        return false;
    }
    if (!parser.is_header_done()) return false;
    Request request = request_of(parser);
    if (!parser.is_done()) {  // the header decides whether the rest is read
        const auto admitted = behind->open.admit(request);
        if (const auto* refused = std::get_if<Reply>(&admitted)) check(*refused, request);
        return false;
    }
    request.body = parser.get().body();
    require(request.body.size() <= kMaxBody, "a body is within its limit");

    const Reply closed = answer_of(behind->closed, request);
    check(closed, request);
    // No seed has the token, and chance does not find it.
    if (request.target.starts_with("/v1/jobs"))
        require(closed.status >= 400, "jobs are for those who have the token");
    const Reply reply = answer_of(behind->open, request);
    check(reply, request);
    return reply.status < 400;
}

}  // namespace postchain::fuzz
