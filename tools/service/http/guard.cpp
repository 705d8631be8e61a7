#include "tools/service/http/guard.h"

#include <arpa/inet.h>

#include <algorithm>
#include <boost/algorithm/string/trim.hpp>

#include "chain/base/printable.h"

namespace postchain::service {
namespace {

// ------------------------------------------------------------------------------------ the client
using Bytes = std::array<unsigned char, 16>;

std::optional<Bytes> bytes_of(const std::string& text) {
    Bytes bytes = {};
    if (inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1) return bytes;
    if (inet_pton(AF_INET, text.c_str(), bytes.data() + 12) != 1) return std::nullopt;
    bytes[10] = bytes[11] = 0xff;
    return bytes;
}

// "[::1]:8080" -> "::1", "name:8080" -> "name". Nothing for other forms.
std::optional<std::string> name_of_host(const std::string& host) {
    const bool six = host.starts_with('[');
    const size_t end = six ? host.find(']') : std::min(host.find(':'), host.size());
    if (end == std::string::npos) return std::nullopt;
    const std::string name = host.substr(six, end - six), port = host.substr(end + six);
    const bool is_port = port.starts_with(':') && port.size() <= 6 &&
                         port.find_first_not_of("0123456789", 1) == std::string::npos;
    if (name.empty() || !(port.empty() || is_port)) return std::nullopt;
    return name;
}

// The token of Authorization; empty if it is of another scheme.
std::string token_of(const std::string& authorization) {
    constexpr std::string_view kScheme = "Bearer ";
    const bool bearer =
        authorization.size() > kScheme.size() &&
        same_word(std::string_view(authorization).substr(0, kScheme.size()), kScheme);
    return bearer ? authorization.substr(kScheme.size()) : "";
}

}  // namespace

Result<Network> Network::parse(const std::string& text) {
    const Status fault(StatusCode::usage, "'" + text +
                                              "' is not an address or a network; expected a form "
                                              "like 10.0.0.0/8 or ::1");
    const size_t slash = text.find('/');
    const std::string address = text.substr(0, slash);
    const auto bytes = bytes_of(address);
    if (!bytes) return fault;
    Network network;
    network.bytes_ = *bytes;
    if (slash == std::string::npos) return network;
    const int first = address.find(':') == std::string::npos ? 96 : 0;
    const auto bits = number_of<int>(text.substr(slash + 1));
    if (!bits || *bits < 0 || first + *bits > 128) return fault;
    network.bits_ = first + *bits;
    return network;
}

bool Network::has(const std::string& address) const {
    const auto bytes = bytes_of(address);
    if (!bytes) return false;
    for (int bit = 0; bit < bits_; ++bit) {
        const int mask = 0x80 >> (bit % 8);
        if (((*bytes)[size_t(bit / 8)] ^ bytes_[size_t(bit / 8)]) & mask) return false;
    }
    return true;
}

bool has_address(const Networks& networks, const std::string& address) {
    return std::ranges::any_of(networks, [&](const Network& one) { return one.has(address); });
}

std::string client_of(const Request& request, const Networks& trusted) {
    std::vector<std::string> hops;  // the nearest last
    for (const auto& [name, value] : request.headers)
        if (same_word(name, "X-Forwarded-For"))
            for (const std::string& part : parts_of(value, ','))
                hops.push_back(boost::trim_copy(part));
    std::string client = request.peer;
    for (auto hop = hops.rbegin(); hop != hops.rend() && has_address(trusted, client); ++hop) {
        const std::string address = is_address(*hop) ? *hop : name_of_host(*hop).value_or("");
        if (!is_address(address)) break;
        client = address;
    }
    return client;
}

bool is_address(const std::string& text) {
    return bytes_of(text).has_value();
}

std::string place_of(const std::string& address) {
    auto bytes = bytes_of(address);
    if (!bytes) return address;
    static const Network four = *Network::parse("::ffff:0:0/96");
    std::array<char, INET6_ADDRSTRLEN> text = {};
    if (four.has(address)) {
        inet_ntop(AF_INET, bytes->data() + 12, text.data(), text.size());
        return text.data();
    }
    std::fill(bytes->begin() + 8, bytes->end(), static_cast<unsigned char>(0));
    inet_ntop(AF_INET6, bytes->data(), text.data(), text.size());
    return std::string(text.data()) + "/64";
}

bool is_loopback(const std::string& address) {
    static const Networks own = {*Network::parse("127.0.0.0/8"), *Network::parse("::1")};
    return has_address(own, address);
}

std::optional<Reply> Guard::refuse_shape(const Request& request) const {
    // RFC 9112, 6.3 and 11.2: framing that a proxy in between might read differently.
    if (request.count("Transfer-Encoding") > 0) {
        if (request.count("Content-Length") > 0 || request.http_1_0)
            return problem(400,
                           "Transfer-Encoding is not allowed with Content-Length or in HTTP/1.0");
        if (request.count("Transfer-Encoding") > 1 ||
            !same_word(*request.header("Transfer-Encoding"), "chunked"))
            return problem(501, "Transfer-Encoding allows only chunked");
    }
    const std::string* length = request.header("Content-Length");
    if (length && length->find_first_not_of("0123456789") != std::string::npos)
        return problem(400, "Content-Length is not a number");
    if (request.count("Content-Length") > 1) return problem(400, "Content-Length is given twice");
    if (request.count("Host") != 1) return problem(400, "the request needs one Host header");
    for (const std::string& once :
         {std::string("Authorization"), std::string("Content-Type"), std::string("Origin"),
          std::string("Idempotency-Key"), settings_.user_header})
        if (request.count(once) > 1) return problem(400, once + " is given twice");

    const std::string& host = *request.header("Host");
    const auto name = name_of_host(host);
    if (!name) return problem(400, "Host is not a name or address");
    const bool ours = is_address(*name) || same_word(*name, "localhost") ||
                      std::ranges::any_of(settings_.hosts, [&](const std::string& one) {
                          return same_word(*name, one);
                      });
    if (!ours) return problem(421, "this name is not one of the service; add it with serve --host");
    if (const std::string* origin = request.header("Origin")) {
        const bool same =
            same_word(*origin, "http://" + host) || same_word(*origin, "https://" + host);
        if (!same) return problem(403, "pages of other sites may not use this service");
    }
    // Browsers send the kind of origin even without Origin. Links from other sites are allowed.
    const std::string* site = request.header("Sec-Fetch-Site");
    const std::string* mode = request.header("Sec-Fetch-Mode");
    if (site && (*site == "cross-site" || *site == "same-site") &&
        !(request.method == "GET" && mode && *mode == "navigate"))
        return problem(403, "pages of other sites may not use this service");
    return std::nullopt;
}

std::variant<Sender, Reply> Guard::identify(const Request& request) const {
    const Users& users = *settings_.users;
    if (users.are_everyone()) return Sender{users.named("")};
    // A proxy that asks for passwords passes them on in Authorization.
    const std::string* name =
        trusts(request.peer) ? request.header(settings_.user_header) : nullptr;
    if (name && !name->empty()) {
        if (KnownUser user = users.named(*name)) return Sender{user};
        return problem(403, concat("the proxy names '", printable(*name),
                                   "', who is not in the file of users (serve --users)"));
    }
    if (const std::string* given = request.header("Authorization"))
        if (Sender sender = users.with_token(token_of(*given)); sender.user) return sender;
    Reply reply = problem(401, "this address requires a token: Authorization: Bearer TOKEN");
    reply.headers.emplace_back("WWW-Authenticate", "Bearer");
    return reply;
}

std::string Guard::share_of(const Request& request, const KnownUser& user) const {
    if (user && !user->name.empty()) return user->name;
    // No user of a file has a line feed in the name.
    return "\n" + place_of(address_of(request));
}

}  // namespace postchain::service
