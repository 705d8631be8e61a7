#include "tools/service/http/guard.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "tools/service/http/problem.h"

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

std::string trimmed(std::string text) {
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '"'; };
    while (!text.empty() && is_blank(text.back())) text.pop_back();
    text.erase(0, size_t(std::ranges::find_if_not(text, is_blank) - text.begin()));
    return text;
}

std::vector<std::string> parts_of(const std::string& text, char between) {
    std::vector<std::string> parts;
    for (size_t at = 0; at <= text.size();) {
        const size_t end = std::min(text.find(between, at), text.size());
        parts.push_back(trimmed(text.substr(at, end - at)));
        at = end + 1;
    }
    return parts;
}

// Without port and brackets: "[2001:db8::1]:80", "192.0.2.1:80".
std::string address_of(const std::string& node) {
    if (node.starts_with("[")) return node.substr(1, node.find(']') - 1);
    const bool four = std::ranges::count(node, ':') == 1;
    return four ? node.substr(0, node.find(':')) : node;
}

// One proxy's entry: whom it served, and how.
struct Hop {
    std::string address, proto;
};

// The entries of all proxies, the nearest last. A proxy that writes X-Forwarded-For often lets a
// client's Forwarded through, so the one does not count beside the other.
std::vector<Hop> hops_of(const Request& request) {
    std::vector<Hop> hops;
    for (const auto& [name, value] : request.headers)
        if (same_word(name, "X-Forwarded-For"))
            for (const std::string& part : parts_of(value, ',')) hops.push_back({part, ""});
    if (!hops.empty()) {
        // Proxies replace this header, or add to it as to the other one.
        if (const std::string* proto = request.header("X-Forwarded-Proto"))
            hops.back().proto = parts_of(*proto, ',').back();
        return hops;
    }
    for (const auto& [name, value] : request.headers) {
        if (!same_word(name, "Forwarded")) continue;
        for (const std::string& entry : parts_of(value, ',')) {
            Hop hop;
            for (const std::string& pair : parts_of(entry, ';')) {
                const std::string text =
                    trimmed(pair.substr(std::min(pair.find('=') + 1, pair.size())));
                if (same_word(pair.substr(0, 4), "for=")) hop.address = text;
                if (same_word(pair.substr(0, 6), "proto=")) hop.proto = text;
            }
            hops.push_back(std::move(hop));
        }
    }
    return hops;
}

// ------------------------------------------------------------------------------------ the checks
constexpr const char* kCookie = "postchain_session";

double seconds(std::chrono::steady_clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

// "[::1]:8080" -> "::1", "name:8080" -> "name". Nothing for other forms.
std::optional<std::string> name_of_host(const std::string& host) {
    std::string name = host, port;
    if (!host.empty() && host[0] == '[') {
        const size_t end = host.find(']');
        if (end == std::string::npos) return std::nullopt;
        name = host.substr(1, end - 1);
        port = host.substr(end + 1);
    } else if (const size_t colon = host.find(':'); colon != std::string::npos) {
        name = host.substr(0, colon);
        port = host.substr(colon);
    }
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    if (!port.empty() &&
        (port[0] != ':' || port.size() > 6 || !std::all_of(port.begin() + 1, port.end(), is_digit)))
        return std::nullopt;
    if (name.empty()) return std::nullopt;
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

// The value of a cookie; empty if it is missing.
std::string cookie_of(const Request& request) {
    const std::string key = std::string(kCookie) + "=";
    for (const auto& [name, value] : request.headers) {
        if (!same_word(name, "Cookie")) continue;
        for (size_t at = 0; at < value.size();) {
            const size_t end = std::min(value.find(';', at), value.size());
            size_t begin = at;
            while (begin < end && value[begin] == ' ') ++begin;
            if (value.compare(begin, key.size(), key) == 0)
                return value.substr(begin + key.size(), end - begin - key.size());
            at = end + 1;
        }
    }
    return "";
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
    int bits = 0;
    const char* end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data() + slash + 1, end, bits);
    if (parsed.ec != std::errc() || parsed.ptr != end || bits < 0 || first + bits > 128)
        return fault;
    network.bits_ = first + bits;
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

Client client_of(const Request& request, const Networks& trusted) {
    Client client{request.peer, false};
    if (!has_address(trusted, request.peer)) return client;
    const std::vector<Hop> hops = hops_of(request);
    // From the nearest proxy outward, as far as proxies are trusted.
    for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) {
        if (hop == hops.rbegin()) client.secure = same_word(hop->proto, "https");
        const std::string address = address_of(hop->address);
        if (!is_address(address)) break;
        client.address = address;
        if (!has_address(trusted, address)) break;
        if (const auto next = std::next(hop); next != hops.rend() && !next->proto.empty())
            client.secure = same_word(next->proto, "https");
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

int WrongTokens::wait_s(const std::string& address, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    const auto found = tries_.find(address);
    if (found == tries_.end() || found->second.until <= now) return 0;
    return int(std::ceil(seconds(found->second.until - now)));
}

void WrongTokens::enter(const std::string& address, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (tries_.size() >= kMaxAddresses)
        std::erase_if(tries_, [&](const auto& one) {
            return seconds(now - one.second.last) > one.second.count * kForgivenS;
        });
    if (tries_.size() >= kMaxAddresses) tries_.clear();
    Tries& tries = tries_[address];
    if (tries.count > 0)
        tries.count = std::max(0.0, tries.count - seconds(now - tries.last) / kForgivenS);
    tries.last = now;
    if (++tries.count <= kFree) return;
    const double wait = std::exp2(std::min(tries.count - kFree, 10.0));
    tries.until =
        now + std::chrono::milliseconds(int64_t(1000 * std::min<double>(wait, kLongestWaitS)));
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
    for (const char* once : {"Authorization", "Content-Type", "Origin", "Idempotency-Key"})
        if (request.count(once) > 1) return problem(400, std::string(once) + " is given twice");

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

std::variant<KnownUser, Reply> Guard::identify(const Request& request) const {
    const Users& users = *settings_.users;
    if (!users.asks_for_token()) return users.named("");
    const std::string* given = request.header("Authorization");
    if (!given)
        if (KnownUser user = users.in_session(cookie_of(request))) return user;
    const std::string address = place_of(client_of(request, settings_.trusted).address);
    if (given) {
        // A right token never waits for others of its address. It has too many bits to be guessed.
        if (const std::string token = token_of(*given); !token.empty())
            if (KnownUser user = users.with_token(token)) return user;
        if (const int wait = wrong_.wait_s(address)) {
            Reply reply = problem(429, "too many wrong tokens from this address; try again later");
            reply.headers.emplace_back("Retry-After", std::to_string(wait));
            return reply;
        }
        wrong_.enter(address);
    }
    Reply reply = problem(401, "this address requires a token: Authorization: Bearer TOKEN");
    reply.headers.emplace_back("WWW-Authenticate", "Bearer");
    return reply;
}

std::function<bool()> Guard::validity_of(const Request& request) const {
    const std::shared_ptr<const Users> users = settings_.users;
    if (!users->asks_for_token()) return [] { return true; };
    if (const std::string* given = request.header("Authorization"))
        return [users, token = token_of(*given)] { return users->with_token(token) != nullptr; };
    return [users, session = cookie_of(request)] { return users->has_session(session); };
}

std::string Guard::begin_session(const Request& request) const {
    const std::string* given = request.header("Authorization");
    return given ? settings_.users->begin_session(token_of(*given)) : "";
}

void Guard::end_session(const Request& request) const {
    settings_.users->end_session(cookie_of(request));
}

std::string Guard::address_of(const Request& request) const {
    return client_of(request, settings_.trusted).address;
}

std::string Guard::share_of(const Request& request, const KnownUser& user) const {
    if (user && !user->name.empty()) return user->name;
    // No user of a file has a line feed in the name.
    return "\n" + place_of(client_of(request, settings_.trusted).address);
}

std::string Guard::cookie(const Request& request, const std::string& session) const {
    std::string text =
        concat(kCookie, "=", session, "; Path=", settings_.base, "/; HttpOnly; SameSite=Strict");
    if (client_of(request, settings_.trusted).secure) text += "; Secure";
    return session.empty() ? text + "; Max-Age=0" : text;
}

std::string Guard::without_base(const std::string& target) const {
    const std::string& base = settings_.base;
    if (base.empty() || !target.starts_with(base)) return target;
    const std::string rest = target.substr(base.size());
    return rest.starts_with("/") ? rest : target;
}

}  // namespace postchain::service
