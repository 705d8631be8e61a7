// HTTP without sockets: who a client is, users, events in memory, files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/io/exr_files.h"
#include "tests/support/status.h"
#include "tools/service/http/event_log.h"
#include "tools/service/http/guard.h"
#include "tools/service/http/job_json.h"
#include "tools/service/http/message.h"
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
        const char *peer, *value, *address;
    };
    for (const auto& [peer, value, address] :
         std::vector<Case>{{"192.0.2.9", "198.51.100.1", "192.0.2.9"},
                           {"127.0.0.1", "198.51.100.1", "198.51.100.1"},
                           {"127.0.0.1", "6.6.6.6, 198.51.100.1", "198.51.100.1"},
                           {"127.0.0.1", "6.6.6.6, 198.51.100.1, 10.1.1.1", "198.51.100.1"},
                           {"127.0.0.1", "6.6.6.6,\t198.51.100.1\t", "198.51.100.1"},
                           {"127.0.0.1", "198.51.100.1:4711", "198.51.100.1"},
                           {"127.0.0.1", "[2001:470::17]:4711", "2001:470::17"},
                           {"127.0.0.1", "nonsense", "127.0.0.1"},
                           {"127.0.0.1", "", "127.0.0.1"},
                           {"127.0.0.1", " , ", "127.0.0.1"},
                           {"2001:db8::5", "198.51.100.1", "198.51.100.1"},
                           {"11.0.0.1", "198.51.100.1", "11.0.0.1"}})
        EXPECT_EQ(client_of(from(peer, {{"X-Forwarded-For", value}}), proxies), address) << value;
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

// Readers that believe the one and readers that believe the other would see two requests. The
// parser takes equal lengths.
TEST(Guards, RefuseHeadersThatAreGivenTwice) {
    const Guard guard({.user_header = "X-User"});
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
                                                          {"Idempotency-Key", "a"},
                                                          {"X-User", "ann"}}) {
        EXPECT_EQ(status({host, {name, value}}), 200) << name;
        EXPECT_EQ(status({host, {name, value}, {name, value}}), 400) << name;
    }
    EXPECT_EQ(status({host, host}), 400);
    EXPECT_EQ(status({host, {"Transfer-Encoding", "chunked"}}), 200);
    EXPECT_EQ(status({host, {"Transfer-Encoding", "chunked"}, {"Transfer-Encoding", "chunked"}}),
              501);
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
    // The name of the user of a request, or the status of its refusal.
    static std::string who(const Guard& guard, const std::string& peer, const Headers& headers) {
        const auto found = guard.identify(from(peer, headers));
        if (const Reply* reply = std::get_if<Reply>(&found)) return std::to_string(reply->status);
        return std::get<Sender>(found).user->name;
    }
    test::TempFolder folder_;
};

constexpr const char* kHash =
    "blake2b-c783baf5fb1427e7d924c9fe93ee161169324bb139d9cd8d8b9602c412ec6cda";

TEST_F(Files, UsersAreKnownByTheirTokenOrBySomeProxies) {
    const Guard guard(
        {.users = two_users(), .trusted = {*Network::parse("127.0.0.1")}, .user_header = "X-User"});
    const std::pair<std::string, std::string> token = {"Authorization", "Bearer bbbbbbbbbbbbbbbb"},
                                              wrong = {"Authorization", "Bearer x"},
                                              password = {"Authorization", "Basic YW5uOng="};
    for (const char* peer : {"127.0.0.1", "192.0.2.1"}) {
        EXPECT_EQ(who(guard, peer, {}), "401");
        EXPECT_EQ(who(guard, peer, {token}), "bob");
        EXPECT_EQ(who(guard, peer, {wrong}), "401");
        EXPECT_EQ(who(guard, peer, {password}), "401");
        EXPECT_EQ(who(guard, peer, {{"X-User", ""}, token}), "bob");
    }
    EXPECT_EQ(who(guard, "192.0.2.1", {{"X-User", "ann"}}), "401");
    EXPECT_EQ(who(guard, "192.0.2.1", {{"X-User", "ann"}, token}), "bob");
    EXPECT_EQ(who(guard, "127.0.0.1", {{"X-User", "ann"}}), "ann");
    EXPECT_EQ(who(guard, "127.0.0.1", {{"x-user", "ann"}, password}), "ann");
    EXPECT_EQ(who(guard, "127.0.0.1", {{"X-User", "ann"}, token}), "ann");
    for (const char* name : {"eve", "Ann", " ", "\n"})
        EXPECT_EQ(who(guard, "127.0.0.1", {{"X-User", name}}), "403") << name;
    const auto refused = guard.identify(from("127.0.0.1", {{"X-User", "eve\x1b"}}));
    EXPECT_THAT(std::get<Reply>(refused).body,
                testing::HasSubstr("'eve\\\\x1b', who is not in the file of users"));
    // A proxy that is trusted only for addresses names nobody.
    EXPECT_EQ(who(Guard({.users = two_users(), .trusted = {*Network::parse("127.0.0.1")}}),
                  "127.0.0.1", {{"X-User", "ann"}}),
              "401");
    EXPECT_EQ(who(Guard({}), "127.0.0.1", {{"X-User", "ann"}, wrong}), "") << "everyone";
}

TEST(Tokens, AreLongAndPlain) {
    // Python: hashlib.blake2b(b"0123456789abcdef", digest_size=32).hexdigest()
    EXPECT_EQ(*hash_of_token("0123456789abcdef"), kHash);
    for (const size_t length : {16, 512})
        EXPECT_TRUE(hash_of_token(std::string(length, 'a')).ok()) << length;
    for (const auto& [token, why] : std::vector<std::pair<std::string, const char*>>{
             {std::string(15, 'a'), "16 to 512 characters"},
             {std::string(513, 'a'), "16 to 512 characters"},
             {"0123456789 0123456789", "printable ASCII"},
             {"0123456789abcdef\x7f", "printable ASCII"}})
        EXPECT_THAT(hash_of_token(token).status().message(), testing::HasSubstr(why));
}

TEST_F(Files, AUsersFileSaysWhatIsWrongAndWhere) {
    const std::string ann = concat("  ann: {tokens: [", kHash, "]");
    write("users", concat("postchain_users: 1\nusers:\n  ", std::string(64, 'a'), ": {tokens: [",
                          kHash, "]}\n  bob: {}\n"));
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
             {"  bob: {tokens: []}", "users.bob.tokens: expected a list of hashes"},
             {concat("  bob: {tokens: ", kHash, "}"),
              "users.bob.tokens: expected a list of hashes"},
             {"  bob: {tokens: [[]]}", "users.bob.tokens: expected a string"},
             {"  bob: {tokens: [x]}", "users.bob.tokens: expected the hash of a token"},
             {ann + "}\n  bob: {tokens: [" + kHash + "]}", "bob.tokens: one is also that of ann"},
             {ann + ", roots: in}", "users.ann.roots: expected a list of folders"},
             {ann + ", roots: []}", "users.ann.roots: expected a list of folders"},
             {ann + ", roots: [in, [in]]}", "users.ann.roots: expected a string"},
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

TEST_F(Files, ATokenIsOfOneUser) {
    const auto users = two_users();
    const std::string hash = *hash_of_token(token_of("bob"));
    write("users", concat("postchain_users: 1\nusers:\n  ann: {tokens: [", hash,
                          "]}\n  bob: {tokens: [", hash, "]}\n"));
    EXPECT_THAT(users->reload().message(), testing::HasSubstr("one is also that of ann"));
    EXPECT_EQ(users->with_token(token_of("bob")).user->name, "bob") << "the users stay";
    write("users", concat("postchain_users: 1\nusers:\n  ann: {tokens: [", hash, "]}\n"));
    ASSERT_TRUE(users->reload().ok());
    EXPECT_EQ(users->with_token(token_of("bob")).user->name, "ann");
    EXPECT_TRUE(Users().reload().ok()) << "it has no file";
}

TEST_F(Files, ASenderIsAUserUntilTheFileChanges) {
    const auto users = two_users();
    const Sender by_token = users->with_token(token_of("ann")), by_proxy = {users->named("ann")};
    const auto write_ann = [&](const std::string& token) {
        write("users",
              concat("postchain_users: 1\nusers:\n  bob: {}\n  ann: {tokens: [",
                     *hash_of_token(token_of("new")), ", ", *hash_of_token(token), "]}\n"));
        ASSERT_TRUE(users->reload().ok());
    };
    write_ann(token_of("ann"));
    EXPECT_TRUE(users->still_have(by_token));
    EXPECT_TRUE(users->with_token(token_of("new")).user) << "both for a while";
    write_ann(token_of("other"));
    EXPECT_FALSE(users->with_token(token_of("ann")).user);
    EXPECT_FALSE(users->still_have(by_token));
    EXPECT_TRUE(users->still_have(by_proxy));
    write("users", "postchain_users: 1\nusers:\n  bob: {}\n");
    ASSERT_TRUE(users->reload().ok());
    EXPECT_FALSE(users->still_have(by_proxy));
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
    for (const size_t left : {size_t(0), size_t(100'000), bytes.size() - 1, bytes.size()}) {
        write("a.exr", bytes);
        const ResultFile file = {folder_.path("a.exr"), "a.exr", "image/x-exr", bytes.size()};
        const Reply reply = download_reply(file);
        std::filesystem::resize_file(file.path, left);
        uint64_t sent = 0;
        Status error;
        for (bool ends = false; !ends && error.ok();) {
            auto part = reply.file->next();
            error = part.status();
            ends = error.ok() && part->empty();
            if (error.ok()) sent += part->size();
        }
        EXPECT_EQ(error.ok(), left == bytes.size()) << left;
        EXPECT_EQ(sent == reply.file->bytes(), error.ok()) << sent;
    }
}

}  // namespace
}  // namespace postchain::service
