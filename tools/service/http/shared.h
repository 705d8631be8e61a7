// State shared by the connections of a server. Only the I/O thread uses it, except the pools.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include "tools/service/http/api.h"
#include "tools/service/http/event_log.h"
#include "tools/service/http/server.h"
#include "tools/service/work/helper_threads.h"

namespace postchain::service {

class Connection;

// Counters for /metrics.
struct Traffic {
    std::map<int, uint64_t> replies;  // by status
    uint64_t accepted = 0;
    uint64_t turned_away = 0;  // connections over a limit
    uint64_t cut_off = 0;      // connections past a deadline
    size_t connections = 0, listeners = 0, waiting = 0;
};

struct Shared {
    Shared(const ServerSettings& settings, Service& service);

    std::string metrics() const;  // Prometheus text; from any thread

    ServerSettings settings;
    Service& service;
    boost::asio::io_context io{1};
    boost::asio::ip::tcp::acceptor acceptor{io};
    HelperThreads pool;       // calls of the service that read its store only
    HelperThreads disk_pool;  // calls that read files: a slow disk does not delay the others
    boost::asio::thread_pool event_pool{2};  // reads events from the store, and drains the service
    Api api;
    EventLog events;
    std::set<std::shared_ptr<Connection>> connections;
    std::map<std::string, size_t> per_address;
    bool closing = false;
    std::atomic<uint64_t> beats = 0;

    mutable std::mutex traffic_mutex;
    Traffic traffic;
};

}  // namespace postchain::service
