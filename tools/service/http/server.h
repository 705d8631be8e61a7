// The listening socket, and the thread that serves all connections.
//
//   accept --> Connection --> Api (small pools; the service's threads for images) --> Connection
//   Service::on_event --> one query of the store --> EventLog --> every Connection that listens
//
// All sockets belong to the thread of run(), which never waits for a file, the store or GL. Every
// wait for a client has a deadline, and every queue has a limit.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "chain/base/status.h"
#include "tools/service/http/guard.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct ServerSettings {
    std::string address = "127.0.0.1";
    uint16_t port = 8080;  // 0 = any free port
    std::string version;
    GuardSettings guard;
    size_t max_connections = 4096;
    size_t max_connections_per_address = 2048;
    size_t max_waiting = 256;                     // requests waiting for a thread
    size_t max_unsent = 512 << 20;                // bytes of replies that clients have not read yet
    uint32_t max_header = 16 * 1024;              // bytes
    uint64_t max_body = 1024 * 1024;              // bytes
    size_t kept_events = 4096;                    // in memory, for all listeners
    std::chrono::milliseconds header{20'000};     // from connecting, or the last reply, to a header
    std::chrono::milliseconds body{30'000};       // from the header to the end of the body
    std::chrono::milliseconds working{120'000};   // until a reply, and for each part of a file
    std::chrono::milliseconds write{30'000};      // per reply or batch of events
    std::chrono::milliseconds heartbeat{15'000};  // between comments to listeners
    std::chrono::milliseconds closing{3'000};     // for unfinished replies, after draining
    std::function<void(const std::string&)> log;  // one line per request
    std::function<void(const LogLine&)> audit;    // changes of jobs, and log-ins that failed
};

struct Shared;

class Server {
  public:
    // Starts to listen. Errors: (usage) not an address of this machine; (output) the port is in use
    // or not allowed.
    static Result<std::unique_ptr<Server>> open(const ServerSettings& settings, Service& service);
    ~Server();

    uint16_t port() const;
    // Serves until `stop` is set. Then drains the service, closes all connections, and returns the
    // number of threads that hang in a request: the process should end without them.
    size_t run(const std::atomic<bool>& stop);
    // False if only a restart helps: too many threads of requests hang.
    bool alive() const;
    // Increases while the thread of run() works.
    uint64_t beats() const;

  private:
    explicit Server(std::unique_ptr<Shared> shared);
    std::unique_ptr<Shared> shared_;
    size_t lost_ = 0;  // threads that hang
};

}  // namespace postchain::service
