// HTTP without sockets: who a client is, users, and tries of tokens.
#include <gtest/gtest.h>

#include "tools/service/http/client.h"
#include "tools/service/http/guard.h"
#include "tools/service/http/wrong_tokens.h"

namespace postchain::service {
namespace {

Request from(const std::string& peer, Headers headers = {}) {
    Request request;
    request.peer = peer;
    request.headers = std::move(headers);
    return request;
}

TEST(Clients, AreTakenFromProxiesThatAreTrusted) {
    const Networks proxies = {*Network::parse("127.0.0.1"), *Network::parse("10.0.0.0/8"),
                              *Network::parse("2001:db8::/32")};
    struct Case {
        const char *peer, *name, *value, *address;
    };
    for (const auto& [peer, name, value, address] : std::vector<Case>{
             {"192.0.2.9", "X-Forwarded-For", "198.51.100.1", "192.0.2.9"},
             {"127.0.0.1", "X-Forwarded-For", "198.51.100.1", "198.51.100.1"},
             {"127.0.0.1", "X-Forwarded-For", "6.6.6.6, 198.51.100.1", "198.51.100.1"},
             {"127.0.0.1", "X-Forwarded-For", "6.6.6.6, 198.51.100.1, 10.1.1.1", "198.51.100.1"},
             {"127.0.0.1", "X-Forwarded-For", "nonsense", "127.0.0.1"},
             {"127.0.0.1", "Forwarded", "for=6.6.6.6, for=198.51.100.1;proto=http", "198.51.100.1"},
             {"127.0.0.1", "forwarded", "For=\"[2001:470::17]:4711\"", "2001:470::17"},
             {"2001:db8::5", "X-Forwarded-For", "198.51.100.1", "198.51.100.1"},
             {"11.0.0.1", "X-Forwarded-For", "198.51.100.1", "11.0.0.1"}})
        EXPECT_EQ(client_of(from(peer, {{name, value}}), proxies).address, address) << value;
    for (const auto& [peer, secure] :
         std::vector<std::pair<std::string, bool>>{{"127.0.0.1", true}, {"192.0.2.9", false}}) {
        EXPECT_EQ(client_of(from(peer, {{"X-Forwarded-For", "198.51.100.1"},
                                        {"X-Forwarded-Proto", "https"}}),
                            proxies)
                      .secure,
                  secure);
        EXPECT_EQ(
            client_of(from(peer, {{"Forwarded", "for=198.51.100.1;proto=https"}}), proxies).secure,
            secure);
    }
    EXPECT_FALSE(
        client_of(from("127.0.0.1", {{"X-Forwarded-For", "198.51.100.1"}}), proxies).secure);
    // The proxy writes one of the headers, and lets the client's other one through.
    const Client both = client_of(from("127.0.0.1", {{"Forwarded", "for=6.6.6.6;proto=https"},
                                                     {"X-Forwarded-For", "198.51.100.1"},
                                                     {"X-Forwarded-Proto", "http"}}),
                                  proxies);
    EXPECT_EQ(both.address, "198.51.100.1");
    EXPECT_FALSE(both.secure);
    for (const char* text : {"", "10.0.0.0/33", "10.0.0.0/", "x", "10.0.0.0/8x", "::1/129", "/8"})
        EXPECT_FALSE(Network::parse(text).ok()) << text;
}

TEST(WrongTokens, AreSlowedPerAddressAndForgiven) {
    using namespace std::chrono_literals;
    WrongTokens wrong;
    const auto start = WrongTokens::Clock::now();
    for (int i = 0; i < int(WrongTokens::kFree); ++i) wrong.enter("a", start);
    EXPECT_EQ(wrong.wait_s("a", start), 0);
    wrong.enter("a", start);
    EXPECT_EQ(wrong.wait_s("a", start), 2);
    EXPECT_EQ(wrong.wait_s("b", start), 0);
    EXPECT_EQ(wrong.wait_s("a", start + 3s), 0);
    for (int i = 0; i < 30; ++i) wrong.enter("a", start);
    EXPECT_EQ(wrong.wait_s("a", start), WrongTokens::kLongestWaitS);
    wrong.enter("a", start + 3600s);
    EXPECT_EQ(wrong.wait_s("a", start + 3600s), 0) << "an hour later";
}

TEST(Guards, KnowUsersByTokenAndSession) {
    GuardSettings settings;
    settings.users = Users::of_token("0123456789abcdef");
    settings.trusted = {*Network::parse("127.0.0.1")};
    settings.base = "/post";
    const Guard guard(settings);
    const auto known = [&](const Request& request) {
        const auto user = guard.identify(request);
        return std::holds_alternative<KnownUser>(user);
    };
    EXPECT_FALSE(known(from("192.0.2.1")));
    EXPECT_TRUE(known(from("192.0.2.1", {{"Authorization", "Bearer 0123456789abcdef"}})));
    const std::string session = settings.users->named("")->session;
    EXPECT_EQ(session.size(), 64u);
    EXPECT_TRUE(known(from("192.0.2.1", {{"Cookie", "postchain_session=" + session}})));
    for (int i = 0; i < 30; ++i)
        (void)guard.identify(from("192.0.2.1", {{"Authorization", "Bearer wrong"}}));
    // The right token tells nothing now; another address and a session are served.
    const auto slowed =
        guard.identify(from("192.0.2.1", {{"Authorization", "Bearer 0123456789abcdef"}}));
    ASSERT_TRUE(std::holds_alternative<Reply>(slowed));
    EXPECT_EQ(std::get<Reply>(slowed).status, 429);
    EXPECT_TRUE(known(from("192.0.2.1", {{"Cookie", "postchain_session=" + session}})));
    EXPECT_TRUE(known(from("192.0.2.2", {{"Authorization", "Bearer 0123456789abcdef"}})));
    // Behind a proxy the clients are apart.
    EXPECT_TRUE(known(from("127.0.0.1", {{"Authorization", "Bearer 0123456789abcdef"},
                                         {"X-Forwarded-For", "192.0.2.3"}})));
    const std::string plain = guard.cookie(from("192.0.2.1"), "x");
    EXPECT_EQ(plain, "postchain_session=x; Path=/post/; HttpOnly; SameSite=Strict");
    EXPECT_NE(guard.cookie(from("127.0.0.1", {{"Forwarded", "for=192.0.2.3;proto=https"}}), "x")
                  .find("; Secure"),
              std::string::npos);
    EXPECT_EQ(guard.without_base("/post/v1/jobs?a=b"), "/v1/jobs?a=b");
    EXPECT_TRUE(guard.is_base("/post"));
    EXPECT_EQ(guard.without_base("/poster"), "/poster");
    EXPECT_EQ(guard.without_base("/v1/jobs"), "/v1/jobs");
}

}  // namespace
}  // namespace postchain::service
