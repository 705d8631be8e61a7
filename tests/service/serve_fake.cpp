// The server over a fake service, for tests of sockets: prints its port, serves until SIGTERM.
//
//   serve_fake [KEY=NUMBER ...] [users=FILE] [user_header=NAME]: members of ServerSettings and
//   FakeSettings, times in milliseconds; a file of users, which SIGHUP reads again
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "tests/service/fake_service.h"
#include "tools/service/http/server.h"

namespace {

std::atomic<bool> g_stop = false, g_reload = false;

}  // namespace

int main(int argc, char** argv) {
    using namespace postchain::service;
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGTERM, [](int) { g_stop = true; });
    std::signal(SIGHUP, [](int) { g_reload = true; });
    auto users = std::make_shared<Users>();
    ServerSettings settings;
    settings.port = 0;
    settings.version = "test";
    settings.audit = [](const LogLine& line) {
        std::fprintf(stderr, "%s %s\n", postchain::io::json_text(line.fields).c_str(),
                     line.message.c_str());
    };
    test::FakeSettings fake;
    using ms = std::chrono::milliseconds;
    const std::map<std::string, std::function<void(long)>> keys = {
        {"max_connections", [&](long v) { settings.max_connections = size_t(v); }},
        {"max_connections_per_address",
         [&](long v) { settings.max_connections_per_address = size_t(v); }},
        {"max_unsent", [&](long v) { settings.max_unsent = size_t(v); }},
        {"max_waiting", [&](long v) { settings.max_waiting = size_t(v); }},
        {"kept_events", [&](long v) { settings.kept_events = size_t(v); }},
        {"header", [&](long v) { settings.header = ms(v); }},
        {"body", [&](long v) { settings.body = ms(v); }},
        {"write", [&](long v) { settings.write = ms(v); }},
        {"heartbeat", [&](long v) { settings.heartbeat = ms(v); }},
        {"frame", [&](long v) { fake.frame = ms(v); }},
        {"past_events", [&](long v) { fake.past_events = size_t(v); }},
        {"picture", [&](long v) { fake.picture = ms(v); }},
        {"picture_bytes", [&](long v) { fake.picture_bytes = size_t(v); }},
        {"event_bytes", [&](long v) { fake.event_bytes = size_t(v); }},
        {"max_queue", [&](long v) { fake.max_queue = size_t(v); }},
        {"closing", [&](long v) { settings.closing = ms(v); }},
        {"working", [&](long v) { settings.working = ms(v); }},
        {"trust_own", [&](long) { settings.guard.trusted = {*Network::parse("127.0.0.0/8")}; }},
    };
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const size_t equals = word.find('=');
        if (word.starts_with("users=")) {
            users = *Users::of_file(word.substr(equals + 1),
                                    [](const std::string&) { return postchain::Status(); });
            settings.guard.users = users;
            continue;
        }
        if (word.starts_with("user_header=")) {
            settings.guard.user_header = word.substr(equals + 1);
            continue;
        }
        const auto key = keys.find(word.substr(0, equals));
        if (key == keys.end() || equals == std::string::npos) {
            std::fprintf(stderr, "serve_fake: %s?\n", argv[i]);
            return 2;
        }
        key->second(std::atol(word.c_str() + equals + 1));
    }
    const auto service = test::fake_service(fake);
    auto server = Server::open(settings, *service);
    if (!server.ok()) {
        std::fprintf(stderr, "%s\n", server.status().message().c_str());
        return 1;
    }
    std::printf("%d\n", int((*server)->port()));
    std::fflush(stdout);
    std::thread reloads([&] {
        for (; !g_stop; std::this_thread::sleep_for(ms(10)))
            if (g_reload.exchange(false)) (void)users->reload();
    });
    (*server)->run(g_stop);
    reloads.join();
    return 0;
}
