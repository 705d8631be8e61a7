#include "tools/service/http/guard.h"

#include <arpa/inet.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "tools/service/http/problem.h"

namespace postchain::service {
namespace {

constexpr const char* kCookie = "postchain_session";
constexpr size_t kShortestToken = 16, kLongestToken = 512;

bool is_address(const std::string& text) {
    std::array<unsigned char, 16> bytes = {};
    return inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
           inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
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

bool is_token_character(unsigned char c) {
    return c > 0x20 && c < 0x7f;
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

Guard::Guard(const GuardSettings& settings) : settings_(settings) {
    std::array<unsigned char, 32> bytes = {};
    // Fails only without randomness from the kernel; then no cookie is accepted.
    if (getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size())) return;
    constexpr char kDigits[] = "0123456789abcdef";
    for (const unsigned char byte : bytes) {
        session_ += kDigits[byte >> 4];
        session_ += kDigits[byte & 15];
    }
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
                      std::any_of(settings_.hosts.begin(), settings_.hosts.end(),
                                  [&](const std::string& one) { return same_word(*name, one); });
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

bool Guard::knows(const Request& request) const {
    if (settings_.token.empty()) return true;
    if (const std::string* given = request.header("Authorization")) {
        constexpr std::string_view kScheme = "Bearer ";
        return given->size() > kScheme.size() &&
               same_word(std::string_view(*given).substr(0, kScheme.size()), kScheme) &&
               same_secret(given->substr(kScheme.size()), settings_.token);
    }
    return !session_.empty() && same_secret(cookie_of(request), session_);
}

std::string Guard::session_cookie() const {
    return std::string(kCookie) + "=" + session_ + "; Path=/; HttpOnly; SameSite=Strict";
}

std::string Guard::no_session_cookie() {
    return std::string(kCookie) + "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0";
}

bool same_secret(const std::string& given, const std::string& secret) {
    if (secret.empty()) return false;
    volatile unsigned char difference = given.size() == secret.size() ? 0 : 1;
    for (size_t i = 0; i < given.size(); ++i)
        difference = static_cast<unsigned char>(
            difference | (static_cast<unsigned char>(given[i]) ^
                          static_cast<unsigned char>(secret[i % secret.size()])));
    return difference == 0;
}

Result<std::string> read_token(const std::string& path) {
    std::ifstream in(path);
    std::string token(kLongestToken + 2, '\0');
    if (!in) return Status(StatusCode::usage, "--token-file " + path + ": cannot be read");
    in.read(token.data(), std::streamsize(token.size()));
    token.resize(size_t(in.gcount()));
    token.resize(std::min(token.find_first_of("\r\n"), token.size()));
    if (token.size() < kShortestToken || token.size() > kLongestToken)
        return Status(
            StatusCode::usage,
            concat("--token-file ", path, ": the first line must have ", kShortestToken, " to ",
                   kLongestToken, " characters; `openssl rand -hex 32` makes one"));
    if (!std::all_of(token.begin(), token.end(), is_token_character))
        return Status(StatusCode::usage, "--token-file " + path +
                                             ": the token may have printable ASCII characters "
                                             "without spaces only");
    return token;
}

bool is_loopback(const std::string& address) {
    std::array<unsigned char, 16> bytes = {};
    if (inet_pton(AF_INET, address.c_str(), bytes.data()) == 1) return bytes[0] == 127;
    if (inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1) return false;
    return std::all_of(bytes.begin(), bytes.end() - 1, [](auto b) { return b == 0; }) &&
           bytes[15] == 1;
}

}  // namespace postchain::service
