// One client connection: consecutive requests, or a stream of events. And what the connections of a
// server share.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/service/http/api.h"
#include "tools/service/http/event_log.h"
#include "tools/service/http/server.h"
#include "tools/service/http/wire.h"
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

// State shared by the connections of a server. Only the I/O thread uses it, except the pools.
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

class Connection : public std::enable_shared_from_this<Connection> {
  public:
    using Clock = std::chrono::steady_clock;

    Connection(Shared& shared, boost::asio::ip::tcp::socket socket, std::string address);

    void start();
    // Sends one reply and closes: for connections over a limit.
    void turn_away(Reply reply);
    // Closes a connection past its deadline, and sends heartbeats to listeners.
    void tick(Clock::time_point now);
    void wake();     // after new events
    void finish();   // closes after the current reply, or at once if there is none
    void abandon();  // closes at once
    const std::string& address() const { return address_; }

  private:
    enum class State { header, body, working, writing, sending, listening, lingering, closed };

    void read_header();
    void on_header(const boost::system::error_code& error);
    void read_body();
    void on_body(const boost::system::error_code& error);
    void refuse_read(const boost::system::error_code& error);
    void work();
    void watch_client();
    void reply(Reply reply);
    void send_source();
    void on_written(const boost::system::error_code& error);
    void listen(const EventsWanted& wanted);
    void watch_listener();
    void send_events();
    void send_batch(EventBatch batch);
    void linger();
    void count_listener(int change);
    void deadline_in(std::chrono::milliseconds time) { deadline_ = Clock::now() + time; }

    Shared& shared_;
    boost::asio::ip::tcp::socket socket_;
    std::string address_;
    State state_ = State::header;
    Clock::time_point deadline_;
    boost::beast::flat_buffer buffer_;
    std::optional<Parser> parser_;
    Request request_;
    std::optional<Admitted> admitted_;
    uint64_t requests_ = 0;               // so far; a reply to an earlier one is dropped
    std::shared_ptr<BodySource> source_;  // of the current reply
    bool keep_ = false;                   // keep the connection open after this reply
    bool finish_ = false;                 // finish() was called
    std::string head_;                    // of the current reply
    std::string content_;
    // Listeners only.
    std::string job_;
    int64_t sent_ = 0;       // id of the last event sent
    bool sending_ = false;   // a write has not completed
    bool fetching_ = false;  // a query of the store has not completed
    bool ends_ = false;      // the last event sent ends the job
    std::vector<EventText> batch_;
    Clock::time_point spoke_;
    char scrap_[64] = {};
};

}  // namespace postchain::service
