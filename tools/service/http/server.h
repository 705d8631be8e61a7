// The listening socket, and the thread that serves all connections.
//
//   accept --> Connection --> Api (quick calls: a small pool; previews: the worker) --> Connection
//   Service::on_event --> one query of the store --> EventLog --> every Connection that listens
//
// All sockets belong to the thread of run(); it never waits for a file, the store or GL. Every
// wait for a client has a deadline, and every queue a limit.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "chain/status.h"
#include "tools/service/http/guard.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct ServerSettings {
    std::string address = "127.0.0.1";
    uint16_t port = 8080;  // 0: a free one
    std::string version;
    GuardSettings guard;
    size_t max_connections = 4096;
    size_t max_connections_per_address = 2048;
    size_t max_waiting = 256;                  // requests that wait for a thread or for the worker
    uint32_t max_header = 16 * 1024;           // bytes
    uint64_t max_body = 1024 * 1024;           // bytes
    size_t kept_events = 4096;                 // in memory, for all who listen
    std::chrono::milliseconds header{20'000};  // from connecting, or the last reply, to a header
    std::chrono::milliseconds body{30'000};    // from there to the end of the body
    std::chrono::milliseconds write{30'000};   // of one reply or batch of events
    std::chrono::milliseconds heartbeat{15'000};  // between comments to who listens
    std::chrono::milliseconds closing{5'000};     // for replies under way, after draining
    std::function<void(const std::string&)> log;  // one line for each request
};

struct Shared;

class Server {
  public:
    // Listens from here on. Errors: (usage) no address, or one that is not this machine's; (output)
    // the port is taken, or not allowed.
    static Result<std::unique_ptr<Server>> open(const ServerSettings& settings, Service& service);
    ~Server();

    uint16_t port() const;
    // Serves until `stop` is set; then drains the service, ends what listens, and returns.
    void run(const std::atomic<bool>& stop);

  private:
    explicit Server(std::unique_ptr<Shared> shared);
    std::unique_ptr<Shared> shared_;
};

}  // namespace postchain::service
