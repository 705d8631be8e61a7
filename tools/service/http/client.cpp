#include "tools/service/http/client.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <optional>

namespace postchain::service {
namespace {

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
    text.erase(0, size_t(std::find_if_not(text.begin(), text.end(), is_blank) - text.begin()));
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
    const bool four = std::count(node.begin(), node.end(), ':') == 1;
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
                if (pair.size() > 4 && same_word(pair.substr(0, 4), "for=")) hop.address = text;
                if (pair.size() > 6 && same_word(pair.substr(0, 6), "proto=")) hop.proto = text;
            }
            hops.push_back(std::move(hop));
        }
    }
    return hops;
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
    return std::any_of(networks.begin(), networks.end(),
                       [&](const Network& one) { return one.has(address); });
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

bool is_loopback(const std::string& address) {
    static const Networks own = {*Network::parse("127.0.0.0/8"), *Network::parse("::1")};
    return has_address(own, address);
}

}  // namespace postchain::service
