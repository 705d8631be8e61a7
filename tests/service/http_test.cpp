// HTTP without sockets: who a client is, users, tries of tokens, events in memory, files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/service/http/event_log.h"
#include "tools/service/http/file_streams.h"
#include "tools/service/http/guard.h"
#include "tools/service/http/job_json.h"
#include "tools/service/http/route.h"

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
             {"127.0.0.1", "X-Forwarded-For", "6.6.6.6,\t198.51.100.1\t", "198.51.100.1"},
             {"127.0.0.1", "X-Forwarded-For", "198.51.100.1:4711", "198.51.100.1"},
             {"127.0.0.1", "X-Forwarded-For", "nonsense", "127.0.0.1"},
             {"127.0.0.1", "Forwarded", "for=;proto=http", "127.0.0.1"},
             {"127.0.0.1", "Forwarded", "for=6.6.6.6, for=198.51.100.1;proto=http", "198.51.100.1"},
             {"127.0.0.1", "forwarded", "For=\"[2001:470::17]:4711\"", "2001:470::17"},
             {"2001:db8::5", "X-Forwarded-For", "198.51.100.1", "198.51.100.1"},
             {"11.0.0.1", "X-Forwarded-For", "198.51.100.1", "11.0.0.1"}})
        EXPECT_EQ(client_of(from(peer, {{name, value}}), proxies).address, address) << value;
    const Headers by_word = {{"X-Forwarded-For", "198.51.100.1"}, {"X-Forwarded-Proto", "https"}};
    const Headers by_one = {{"Forwarded", "for=198.51.100.1;proto=https"}};
    for (const Headers& headers : {by_word, by_one}) {
        EXPECT_TRUE(client_of(from("127.0.0.1", headers), proxies).secure);
        EXPECT_FALSE(client_of(from("192.0.2.9", headers), proxies).secure);
    }
    // If there are two proxies, the outer one knows how the client came.
    for (const auto& [outer, inner] : {std::pair("https", "http"), std::pair("http", "https")}) {
        const Client client =
            client_of(from("127.0.0.1", {{"Forwarded", concat("for=198.51.100.1;proto=", outer,
                                                              ", for=10.1.1.1;proto=", inner)}}),
                      proxies);
        EXPECT_EQ(client.address, "198.51.100.1");
        EXPECT_EQ(client.secure, outer == std::string("https"));
    }
    // A proxy that adds to the header of a client does not believe what is before.
    for (const auto& [claimed, added] : {std::pair("https", "http"), std::pair("http", "https")}) {
        const Client client =
            client_of(from("127.0.0.1", {{"X-Forwarded-For", "198.51.100.1"},
                                         {"X-Forwarded-Proto", concat(claimed, ", ", added)}}),
                      proxies);
        EXPECT_EQ(client.secure, added == std::string("https"));
    }
    // The proxy writes one of the headers, and lets the client's other one through.
    const Client both = client_of(from("127.0.0.1", {{"Forwarded", "for=6.6.6.6;proto=https"},
                                                     {"X-Forwarded-For", "198.51.100.1"},
                                                     {"X-Forwarded-Proto", "http"}}),
                                  proxies);
    EXPECT_EQ(both.address, "198.51.100.1");
    EXPECT_FALSE(both.secure);
    for (const char* text :
         {"", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/", "x", "10.0.0.0/8x", "::1/129", "/8"})
        EXPECT_FALSE(Network::parse(text).ok()) << text;
}

TEST(Clients, NetworksEndWithinAByteToo) {
    for (const auto& [network, in, out] :
         std::vector<std::tuple<const char*, const char*, const char*>>{
             {"172.16.0.0/12", "172.31.255.255", "172.32.0.0"},
             {"172.16.0.0/12", "172.16.0.0", "172.15.255.255"},
             {"192.0.2.128/25", "192.0.2.129", "192.0.2.127"},
             {"192.0.2.4/31", "192.0.2.5", "192.0.2.6"},
             {"192.0.2.4/32", "192.0.2.4", "192.0.2.5"},
             {"128.0.0.0/1", "255.0.0.1", "127.0.0.1"},
             {"fe80::/10", "febf::1", "fec0::1"},
             {"2001:db8::/33", "2001:db8:7fff::1", "2001:db8:8000::1"}}) {
        EXPECT_TRUE(Network::parse(network)->has(in)) << network;
        EXPECT_FALSE(Network::parse(network)->has(out)) << network;
    }
    EXPECT_TRUE(Network::parse("0.0.0.0/0")->has("192.0.2.1"));
}

TEST(Clients, AreAnAddressOrANetwork) {
    for (const auto& [address, place] : std::vector<std::pair<const char*, const char*>>{
             {"192.0.2.1", "192.0.2.1"},
             {"::ffff:192.0.2.1", "192.0.2.1"},
             {"2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"},
             {"2001:db8:1:2::", "2001:db8:1:2::/64"},
             {"2001:db8:1:3::1", "2001:db8:1:3::/64"},
             {"::1", "::/64"},
             {"nonsense", "nonsense"}})
        EXPECT_EQ(place_of(address), place) << address;
    EXPECT_TRUE(is_loopback("127.0.0.2"));
    EXPECT_FALSE(is_loopback("localhost")) << "a name may be that of another machine";
    const Guard guard({});
    User ann;
    ann.name = "ann";
    EXPECT_EQ(guard.share_of(from("192.0.2.1"), std::make_shared<const User>(ann)), "ann");
    EXPECT_EQ(guard.share_of(from("2001:db8::1"), std::make_shared<const User>()),
              guard.share_of(from("2001:db8::2"), nullptr));
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

TEST(WrongTokens, AFullTableForgetsThoseThatAreForgiven) {
    using namespace std::chrono_literals;
    WrongTokens wrong;
    const auto start = WrongTokens::Clock::now(), later = start + 11s;
    // Others, as many as fit beside one more.
    const auto fill = [&](const auto& time) {
        for (size_t i = 1; i < WrongTokens::kMaxAddresses; ++i)
            wrong.enter(std::to_string(i), time);
    };
    for (int i = 0; i <= int(WrongTokens::kFree); ++i) wrong.enter("a", start);
    fill(start);
    wrong.enter("b", later);
    wrong.enter("a", later);
    EXPECT_EQ(wrong.wait_s("a", later), 2) << "20 of its 21 are not forgiven yet";
    fill(later);
    wrong.enter("a", later);
    EXPECT_EQ(wrong.wait_s("a", later), 0) << "all are recent, and the table is bounded";
}

Request with_token(const std::string& peer, const std::string& token) {
    return from(peer, {{"Authorization", "Bearer " + token}});
}

// The reply to a request with a wrong token.
Reply refusal_of(const Guard& guard, const std::string& peer, const std::string& token) {
    const auto found = guard.identify(with_token(peer, token));
    const Reply* reply = std::get_if<Reply>(&found);
    EXPECT_TRUE(reply) << token;
    return reply ? *reply : Reply();
}

// Readers that believe the one and readers that believe the other would see two requests. The
// parser takes equal lengths.
TEST(Guards, RefuseHeadersThatAreGivenTwice) {
    const Guard guard({});
    const auto status = [&](const Headers& headers) {
        const auto refused = guard.refuse_shape(from("192.0.2.1", headers));
        return refused ? refused->status : 200;
    };
    const std::pair<std::string, std::string> host = {"Host", "localhost"};
    for (const auto& [name, value] :
         std::vector<std::pair<std::string, std::string>>{{"Content-Length", "2"},
                                                          {"Authorization", "Bearer a"},
                                                          {"Content-Type", "application/json"},
                                                          {"Origin", "http://localhost"},
                                                          {"Idempotency-Key", "a"}}) {
        EXPECT_EQ(status({host, {name, value}}), 200) << name;
        EXPECT_EQ(status({host, {name, value}, {name, value}}), 400) << name;
    }
    EXPECT_EQ(status({host, host}), 400);
    EXPECT_EQ(status({host, {"Transfer-Encoding", "chunked"}}), 200);
    EXPECT_EQ(status({host, {"Transfer-Encoding", "chunked"}, {"Transfer-Encoding", "chunked"}}),
              501);
}

TEST(Guards, KnowUsersByTokenAndSession) {
    GuardSettings settings;
    settings.users = Users::of_token("0123456789abcdef");
    settings.trusted = {*Network::parse("127.0.0.1")};
    settings.base = "/post";
    const Guard guard(settings);
    const auto known = [&](const std::string& peer, const Headers& headers) {
        return std::holds_alternative<KnownUser>(guard.identify(from(peer, headers)));
    };
    Headers token = {{"Authorization", "Bearer 0123456789abcdef"}};
    const std::string address = "2001:db8::ff";
    const std::string session = guard.begin_session(from(address, token));
    EXPECT_EQ(session.size(), 64u);
    EXPECT_EQ(guard.begin_session(from(address)), "");
    const Headers cookie = {{"Cookie", "postchain_session=" + session}};
    EXPECT_FALSE(known(address, {}));
    EXPECT_TRUE(known(address, token));
    EXPECT_TRUE(known(address, cookie));
    EXPECT_FALSE(known(address, {cookie[0], {"Authorization", "Bearer wrong"}}));
    // A wrong token from each address of a network counts for the network.
    for (int i = 0; i < 30; ++i) (void)refusal_of(guard, concat("2001:db8::", i), "wrong");
    EXPECT_EQ(refusal_of(guard, address, "wrong").status, 429);
    EXPECT_EQ(refusal_of(guard, "192.0.2.2", "wrong").status, 401);
    EXPECT_TRUE(known(address, token));
    EXPECT_TRUE(known(address, cookie));
    guard.end_session(from(address, cookie));
    EXPECT_FALSE(known(address, cookie));
    // Behind a proxy the clients are apart.
    token.emplace_back("X-Forwarded-For", "192.0.2.3");
    EXPECT_TRUE(known("127.0.0.1", token));
    EXPECT_EQ(guard.cookie(from("192.0.2.1"), "x"),
              "postchain_session=x; Path=/post/; HttpOnly; SameSite=Strict");
    EXPECT_NE(guard.cookie(from("127.0.0.1", {{"Forwarded", "for=192.0.2.3;proto=https"}}), "x")
                  .find("; Secure"),
              std::string::npos);
    EXPECT_EQ(guard.cookie(from("192.0.2.1"), ""),
              "postchain_session=; Path=/post/; HttpOnly; SameSite=Strict; Max-Age=0");
    EXPECT_EQ(guard.without_base("/post/v1/jobs?a=b"), "/v1/jobs?a=b");
    EXPECT_TRUE(guard.is_base("/post"));
    EXPECT_EQ(guard.without_base("/poster"), "/poster");
    EXPECT_EQ(guard.without_base("/v1/jobs"), "/v1/jobs");
}

class Files : public testing::Test {
  protected:
    void write(const std::string& name, const std::string& text) {
        std::ofstream(folder_.path(name)) << text;
    }
    static std::string token_of(const std::string& user) { return std::string(16, user[0]); }
    std::shared_ptr<Users> two_users() {
        write("users", concat("postchain_users: 1\nusers:\n  ann: {tokens: [",
                              *hash_of_token(token_of("ann")), "]}\n  bob: {tokens: [",
                              *hash_of_token(token_of("bob")), "]}\n"));
        return *Users::of_file(folder_.path("users"), [](const std::string&) { return Status(); });
    }
    std::string token_refusal(const std::string& name) {
        return test::error_of(Users::of_token_file(folder_.path(name)));
    }
    test::TempFolder folder_;
};

// Python: hashlib.blake2b(b"0123456789abcdef", digest_size=32).hexdigest()
constexpr const char* kHash =
    "blake2b-c783baf5fb1427e7d924c9fe93ee161169324bb139d9cd8d8b9602c412ec6cda";

TEST_F(Files, ATokenFileHoldsHashes) {
    EXPECT_EQ(*hash_of_token("0123456789abcdef"), kHash);
    write("token", concat("# of the farm\n", kHash, " \r\n\n", *hash_of_token("fedcba9876543210")));
    EXPECT_EQ(token_refusal("token"), "");
    std::string eight, nine;
    for (int i = 0; i < 9; ++i) {
        eight = nine;
        nine += concat(*hash_of_token(std::string(20, char('a' + i))), "\n");
    }
    write("token", eight);
    EXPECT_EQ(token_refusal("token"), "");
    for (const size_t length : {16, 512})
        EXPECT_TRUE(hash_of_token(std::string(length, 'a')).ok()) << length;
    for (const auto& [text, why] : std::vector<std::pair<std::string, const char*>>{
             {"0123456789abcdef\n", "token:1: expected the hash"},
             {"blake2b-00\n", "token:1: expected the hash"},
             {"blake2b-G" + std::string(63, '0') + "\n", "token:1: expected the hash"},
             {"\n", "expected 1 to 8 hashes"},
             {nine, "expected 1 to 8 hashes"}}) {
        write("token", text);
        EXPECT_THAT(token_refusal("token"), testing::HasSubstr(why)) << text;
    }
    EXPECT_THAT(token_refusal("none"), testing::HasSubstr("cannot be read"));
    for (const auto& [token, why] : std::vector<std::pair<std::string, const char*>>{
             {std::string(15, 'a'), "16 to 512 characters"},
             {std::string(513, 'a'), "16 to 512 characters"},
             {"0123456789 0123456789", "printable ASCII"},
             {"0123456789abcdef\x7f", "printable ASCII"}})
        EXPECT_THAT(hash_of_token(token).status().message(), testing::HasSubstr(why));
}

TEST_F(Files, AStreamOfEventsEndsWithItsToken) {
    write("token", kHash);
    const auto users = *Users::of_token_file(folder_.path("token"));
    GuardSettings settings;
    settings.users = users;
    const Guard guard(settings);
    const auto is_valid =
        guard.validity_of(from("127.0.0.1", {{"Authorization", "Bearer 0123456789abcdef"}}));
    EXPECT_TRUE(is_valid());
    write("token", *hash_of_token("fedcba9876543210"));
    ASSERT_TRUE(users->reload().ok());
    EXPECT_FALSE(is_valid());
}

TEST_F(Files, AUsersFileSaysWhatIsWrongAndWhere) {
    const std::string ann = concat("  ann: {tokens: [", kHash, "]");
    const auto tokens = [](int count) {
        std::string list;
        for (int i = 0; i < count; ++i)
            list += concat(i > 0 ? ", " : "", *hash_of_token(std::string(20, char('a' + i))));
        return list;
    };
    write("users", concat("postchain_users: 1\nusers:\n  ", std::string(64, 'a'), ": {tokens: [",
                          tokens(8), "]}\n"));
    EXPECT_EQ(test::error_of(Users::of_file(folder_.path("users"),
                                            [](const std::string&) { return Status(); })),
              "");
    for (const auto& [text, why] : std::vector<std::pair<std::string, const char*>>{
             {"users:\n" + ann + "}", "users:1:1: error: expected postchain_users: 1, and"},
             {"postchain_users: 1\nusers: [ann]",
              "users:1:1: error: expected postchain_users: 1, and"},
             {"postchain_users: 1", "users:1:1: error: expected postchain_users: 1, and"},
             {ann + "}\n\t- ", "users:4:"},
             {"postchain_users: 2\nusers:\n" + ann + "}",
              "users:1:18: error: postchain_users: '2' is not supported"},
             {"postchain_users: 1\nusers: {}", "users:1:1: error: users: no user"},
             {ann + "}\nuser: 1",
              "users:4:1: error: user: unknown key 'user' (did you mean 'users'?)"},
             {"  " + std::string(65, 'a') + ": {}", "a name has 1 to 64 characters"},
             {"  \"\": {}", "a name has 1 to 64 characters"},
             {"  bob: 3", "users:3:8: error: users.bob: expected a map"},
             {"  bob: {}", "users.bob.tokens: is required"},
             {"  bob: {tokens: []}", "users.bob.tokens: expected a list of 1 to 8 hashes"},
             {concat("  bob: {tokens: ", kHash, "}"), "users.bob.tokens: expected a list of 1"},
             {"  bob: {tokens: [" + tokens(9) + "]}", "expected a list of 1 to 8 hashes"},
             {"  bob: {tokens: [[]]}", "users.bob.tokens: expected the hash of a token"},
             {ann + "}\n  bob: {tokens: [" + kHash + "]}", "bob.tokens: one is also that of ann"},
             {ann + ", roots: in}", "users.ann.roots: expected a list of folders"},
             {ann + ", roots: []}", "users.ann.roots: expected a list of folders"},
             {ann + ", roots: [in, [in]]}", "users.ann.roots: expected a folder"},
             {ann + ", roots: [in, out]}", "users.ann.roots: no folder out"},
             {ann + ", max_jobs: -1}", "users.ann.max_jobs: -1 is out of range"},
             {ann + ", max_disk: 5x}", "users.ann.max_disk: '5x' is not a valid size"}}) {
        const bool whole = text.starts_with("users:") || text.starts_with("postchain_users:");
        write("users", (whole ? "" : "postchain_users: 1\nusers:\n") + text + "\n");
        EXPECT_THAT(test::error_of(Users::of_file(folder_.path("users"),
                                                  [](const std::string& folder) {
                                                      return folder == "in"
                                                                 ? Status()
                                                                 : Status(StatusCode::usage,
                                                                          "no folder " + folder);
                                                  })),
                    testing::HasSubstr(why))
            << text;
    }
}

TEST(Sessions, EndOneByOneWithoutRequestsAndAfterDays) {
    const auto users = Users::of_token("0123456789abcdef");
    const auto start = Users::Clock::now();
    using namespace std::chrono_literals;
    EXPECT_EQ(users->begin_session("another token of 16"), "");
    const std::string a = users->begin_session("0123456789abcdef", start);
    const std::string b = users->begin_session("0123456789abcdef", start);
    EXPECT_NE(a, b);
    users->end_session(a);
    EXPECT_FALSE(users->in_session(a, start));
    EXPECT_FALSE(users->in_session("", start));
    for (auto now = start; now - start <= Users::kLongestSession; now += Users::kIdleSession)
        ASSERT_TRUE(users->in_session(b, now));
    EXPECT_FALSE(users->has_session(b, start + Users::kLongestSession + 1s)) << "streams end too";
    EXPECT_FALSE(users->in_session(b, start + Users::kLongestSession + 1s));
    const std::string idle = users->begin_session("0123456789abcdef", start);
    EXPECT_FALSE(users->has_session(idle, start + Users::kIdleSession + 1s));
    EXPECT_FALSE(users->in_session(idle, start + Users::kIdleSession + 1s));
    EXPECT_FALSE(users->in_session(idle, start)) << "it has ended";
    const std::string first = users->begin_session("0123456789abcdef", start);
    for (size_t i = 0; i < Users::kSessions; ++i)
        users->begin_session("0123456789abcdef", start + 1s);
    EXPECT_FALSE(users->in_session(first, start + 1s)) << "too many";
}

TEST_F(Files, ATokenIsOfOneUser) {
    const auto users = two_users();
    const std::string hash = *hash_of_token(token_of("bob"));
    write("users", concat("postchain_users: 1\nusers:\n  ann: {tokens: [", hash,
                          "]}\n  bob: {tokens: [", hash, "]}\n"));
    EXPECT_THAT(users->reload().message(), testing::HasSubstr("one is also that of ann"));
    EXPECT_EQ(users->with_token(token_of("bob"))->name, "bob") << "the users stay";
    // It becomes another user's: a session that began with it is not that user's.
    const std::string session = users->begin_session(token_of("bob"));
    write("users", concat("postchain_users: 1\nusers:\n  ann: {tokens: [", hash, "]}\n"));
    ASSERT_TRUE(users->reload().ok());
    EXPECT_EQ(users->with_token(token_of("bob"))->name, "ann");
    EXPECT_FALSE(users->has_session(session));
    // A service without such a file has nothing to read again.
    const auto one = Users::of_token("0123456789abcdef");
    EXPECT_TRUE(one->reload().ok());
    EXPECT_TRUE(one->with_token("0123456789abcdef"));
}

TEST_F(Files, TooManySessionsOfAUserEndTheUsersOwn) {
    using namespace std::chrono_literals;
    const auto start = Users::Clock::now();
    for (const auto& [name, other] : {std::pair("ann", "bob"), std::pair("bob", "ann")}) {
        const auto users = two_users();
        const std::string others = users->begin_session(token_of(other), start);
        const std::string first = users->begin_session(token_of(name), start + 1s);
        const std::string second = users->begin_session(token_of(name), start + 2s);
        EXPECT_TRUE(users->in_session(first, start + 3s));
        for (size_t i = 2; i < Users::kSessions; ++i)
            users->begin_session(token_of(name), start + 4s);
        EXPECT_TRUE(users->has_session(second, start + 4s)) << "as many as there may be";
        users->begin_session(token_of(name), start + 4s);
        EXPECT_FALSE(users->has_session(second, start + 4s)) << "without a request for longest";
        EXPECT_TRUE(users->has_session(first, start + 4s));
        const KnownUser found = users->in_session(others, start + 4s);
        ASSERT_TRUE(found);
        EXPECT_EQ(found->name, other);
    }
}

TEST_F(Files, ARotatedTokenAndItsSessionsEnd) {
    const auto write_hashes = [&](const std::string& first, const std::string& second) {
        write("token", concat(first, "\n", second, "\n"));
        write("users", concat("postchain_users: 1\nusers:\n  bob: {tokens: [",
                              *hash_of_token("bbbbbbbbbbbbbbbb"), "]}\n  ann: {tokens: [", first,
                              second.empty() ? "" : ", ", second, "]}\n"));
    };
    const auto write_both = [&](const std::string& token, const std::string& more = "") {
        write_hashes(*hash_of_token(token), more.empty() ? "" : *hash_of_token(more));
    };
    const std::string former = "0123456789abcdef", token = "fedcba9876543210";
    for (const bool several : {false, true}) {
        write_both(former);
        const auto users = several ? *Users::of_file(folder_.path("users"),
                                                     [](const std::string&) { return Status(); })
                                   : *Users::of_token_file(folder_.path("token"));
        const std::string session = users->begin_session(former);
        ASSERT_TRUE(users->reload().ok());
        EXPECT_TRUE(users->in_session(session)) << "the token has not changed";
        // Both for a while.
        write_both(token, former);
        ASSERT_TRUE(users->reload().ok());
        EXPECT_TRUE(users->with_token(former));
        EXPECT_TRUE(users->with_token(token));
        EXPECT_TRUE(users->in_session(session));
        write_both(token);
        ASSERT_TRUE(users->reload().ok());
        EXPECT_FALSE(users->with_token(former));
        EXPECT_FALSE(users->in_session(session));
        EXPECT_FALSE(users->has_session(session)) << "its streams of events end";
        ASSERT_TRUE(users->with_token(token));
        EXPECT_EQ(users->with_token(token)->name, several ? "ann" : "");
        write_hashes(token, "");
        EXPECT_THAT(users->reload().message(), testing::HasSubstr(several ? "users:4:" : "token"));
        EXPECT_TRUE(users->with_token(token)) << "the users stay";
        write_both(token, former);
        ASSERT_TRUE(users->reload().ok());
        EXPECT_FALSE(users->in_session(session)) << "it has ended";
    }
}

// The user with this token, "" for none.
std::string name_known_to(const Guard& guard, const Request& request) {
    const auto found = guard.identify(request);
    const KnownUser* user = std::get_if<KnownUser>(&found);
    return user ? (*user)->name : "";
}

TEST_F(Files, WrongTokensOfAnAddressDelayOnlyWrongOnes) {
    GuardSettings settings;
    settings.users = two_users();
    const Guard guard(settings);
    const std::string here = "192.0.2.1", there = "192.0.2.2";
    for (int i = 0; i <= int(WrongTokens::kFree); ++i)
        EXPECT_EQ(refusal_of(guard, here, "wrong").status, 401) << i;
    for (const std::string& address : {here, there})
        for (const char* name : {"ann", "bob"}) {
            const Request right = with_token(address, token_of(name));
            EXPECT_EQ(name_known_to(guard, right), name) << address;
            const std::string session = guard.begin_session(right);
            EXPECT_EQ(
                name_known_to(guard, from(address, {{"Cookie", "postchain_session=" + session}})),
                name);
        }
    for (int i = 0; i < 30; ++i) {
        const Reply late = refusal_of(guard, here, i % 2 == 0 ? "wrong" : token_of("ann") + "a");
        EXPECT_EQ(late.status, 429);
        ASSERT_EQ(late.headers.at(0).first, "Retry-After");
        // Those that wait do not prolong the wait.
        EXPECT_LT(std::stoi(late.headers[0].second), WrongTokens::kLongestWaitS);
    }
    EXPECT_EQ(refusal_of(guard, there, "wrong").status, 401);
}

TEST(Targets, AreDecodedAndCannotLeaveTheirPath) {
    const auto target = parse_target("/v1/jobs/a%20b?limit=5&search=a+%2f");
    ASSERT_TRUE(target);
    EXPECT_EQ(target->segments, (std::vector<std::string>{"v1", "jobs", "a b"}));
    EXPECT_EQ(target->query,
              (std::map<std::string, std::string>{{"limit", "5"}, {"search", "a /"}}));
    for (const char* text :
         {"", "*", "v1", "/v1/../jobs", "/v1/.", "/%2e%2e/x", "/a%2fb", "/a%5cb", "/a\\b", "/%00",
          "/%7f", "/%zz", "/%", "/%4", "/a#b", "/?a=1&a=2", "/?%00=1", "/?a=%0d"})
        EXPECT_FALSE(parse_target(text)) << text;
}

TEST(Routes, TakeWholeSegments) {
    const std::vector<Route> routes = {{.path = "/jobs/{id}"},
                                       {.path = "/jobs/{id}/report/{file...}"}};
    const auto values = [&](const char* text) {
        const auto found = find_route(routes, "GET", *parse_target(text));
        const auto* match = std::get_if<Match>(&found);
        return match ? match->values : std::vector<std::string>{"none"};
    };
    using Values = std::vector<std::string>;
    EXPECT_EQ(values("/jobs/1"), Values{"1"});
    EXPECT_EQ(values("/jobs/1/report/a"), (Values{"1", "a"}));
    EXPECT_EQ(values("/jobs/1/report/a/b"), (Values{"1", "a/b"}));
    for (const char* text :
         {"/jobs/", "/jobs", "/jobs/1/", "/jobs//report/a", "/jobs/1/report", "/jobs/1/report/",
          "/jobs/1/report//a", "/jobs/1/report/a//b", "/jobs/1/report/a/"})
        EXPECT_EQ(values(text), Values{"none"}) << text;
}

std::vector<Event> events_of(int64_t first,
                             const std::vector<std::pair<const char*, const char*>>& all) {
    std::vector<Event> events;
    for (const auto& [job, type] : all) events.push_back({first++, job, 0, type, "{}"});
    return events;
}

TEST(EventLogs, KeepTheNewestEventsForEveryListener) {
    EventLog log(10, 3);
    EXPECT_TRUE(log.covers(10));
    EXPECT_FALSE(log.covers(9)) << "it is in the store only";
    log.add(events_of(11, {{"1", "queued"}, {"2", "queued"}}));
    log.add(events_of(13, {{"1", "done"}, {"2", "frame"}}));
    EXPECT_EQ(log.newest(), 14);
    EXPECT_EQ(log.floor(), 11);
    EXPECT_TRUE(log.covers(11));
    EXPECT_FALSE(log.covers(10));
    struct Case {
        const char* job;
        size_t limit;
        int64_t last;
        bool ends;
    };
    for (const Case& one : {Case{"", 2, 13, true}, Case{"2", 9, 14, false}}) {
        const EventBatch batch = log.after(11, one.job, one.limit);
        ASSERT_EQ(batch.texts.size(), 2u) << one.job;
        EXPECT_EQ(batch.last, one.last);
        EXPECT_EQ(batch.ends, one.ends);
        EXPECT_THAT(*batch.texts[0], testing::HasSubstr("id: 12\n"));
    }
    EXPECT_EQ(log.after(14, "", 9).last, 14);
    // From the store. A job may go on after its end.
    EXPECT_TRUE(batch_of(events_of(5, {{"1", "canceled"}}), 4).ends);
    EXPECT_FALSE(batch_of(events_of(5, {{"1", "failed"}, {"1", "requeued"}}), 4).ends);
    EXPECT_EQ(batch_of({}, 4).last, 4);
}

TEST_F(Files, NamesStayWithinTheirHeader) {
    const Reply reply =
        download_reply({folder_.path("a"), "a\"b\\c\r\nd\xc3.exr", "image/x-exr", 0});
    ASSERT_EQ(reply.headers.size(), 1u);
    EXPECT_EQ(reply.headers[0].second, "attachment; filename=\"a_b_c__d_.exr\"");
}

TEST(Times, HaveMilliseconds) {
    EXPECT_EQ(time_of(86'400'000 + 1'005), "1970-01-02T00:00:01.005Z");
    EXPECT_TRUE(time_of(0).is_null());
}

// The length has been sent: an early end alone tells the client that the file has changed.
TEST_F(Files, AFileThatIsShortenedWhileItIsSentEndsWithAnError) {
    const std::string bytes(600'000, 'x');
    const auto file = [&](const char* name) {
        write(name, bytes);
        return ResultFile{folder_.path(name), name, "image/x-exr", bytes.size()};
    };
    for (const bool zip : {false, true})
        for (const size_t left : {size_t(0), size_t(100'000), bytes.size() - 1, bytes.size()}) {
            const ResultFile a = file("a.exr");
            const Reply reply = zip ? zip_reply({a, file("b.exr")}, "all.zip") : download_reply(a);
            std::filesystem::resize_file(a.path, left);
            uint64_t sent = 0;
            Status error;
            for (bool ends = false; !ends && error.ok();) {
                auto part = reply.source->next();
                error = part.status();
                ends = error.ok() && part->empty();
                if (error.ok()) sent += part->size();
            }
            EXPECT_EQ(error.ok(), left == bytes.size()) << zip << " " << left;
            EXPECT_EQ(sent == reply.source->bytes(), error.ok()) << sent;
        }
}

}  // namespace
}  // namespace postchain::service
