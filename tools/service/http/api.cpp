#include "tools/service/http/api.h"

#include "tools/service/http/problem.h"
#include "tools/service/http/routes.h"

namespace postchain::service {

Api::Api(Service& service, const GuardSettings& guard, std::string version,
         std::function<std::string()> more_metrics)
    : guard_(guard) {
    add_routes(routes_, service, guard_, version, std::move(more_metrics));
}

std::variant<Admitted, Reply> Api::admit(const Request& header) const {
    if (auto refused = guard_.refuse_shape(header)) return std::move(*refused);
    // Addresses in the page are relative to a folder.
    if (guard_.is_base(header.target)) {
        Reply reply;
        reply.status = 308;
        reply.type = "text/plain";
        reply.headers.emplace_back("Location", header.target + "/");
        return reply;
    }
    auto target = parse_target(guard_.without_base(header.target));
    if (!target) return problem(400, "the address is malformed");
    auto found = find_route(routes_, header.method, *target);
    // A client without the token learns nothing about the routes.
    const bool open = is_open(routes_, header.method, *target);
    auto user = guard_.identify(header);
    if (auto* refused = std::get_if<Reply>(&user); refused && !open) return std::move(*refused);
    if (auto* refused = std::get_if<Reply>(&found)) return std::move(*refused);
    const Route& route = *std::get<Match>(found).route;
    const std::string* type = header.header("Content-Type");
    const std::string media = type ? type->substr(0, type->find(';')) : "";
    if (!route.body.empty() && !same_word(media.substr(0, media.find(' ')), "application/json"))
        return problem(415, "the body must be Content-Type: application/json");
    if (header.header("Content-Encoding")) return problem(415, "Content-Encoding is not allowed");
    if (route.body.empty()) {
        const std::string* length = header.header("Content-Length");
        if (header.header("Transfer-Encoding") || (length && *length != "0"))
            return problem(413, "this address does not take a body");
    }
    KnownUser known = std::holds_alternative<KnownUser>(user) ? std::get<KnownUser>(user) : nullptr;
    return Admitted{std::move(*target), std::move(std::get<Match>(found)), std::move(known)};
}

void Api::run(const Admitted& admitted, const Request& request, const Respond& respond) const {
    static const User stranger{.name = kStranger};
    const Match& match = admitted.match;
    match.route->handle(
        {request, admitted.target, match.values, admitted.user ? *admitted.user : stranger},
        respond);
}

}  // namespace postchain::service
