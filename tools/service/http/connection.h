// One client connection: consecutive requests, or a stream of events. And what the connections of a
// server share, and the bytes of requests and replies.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/service/http/event_log.h"
#include "tools/service/http/routes.h"
#include "tools/service/http/server.h"
#include "tools/service/work/helper_threads.h"

namespace postchain::service {

class Connection;

using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;

// The request without its body, from the header that the parser has read.
Request request_of(const Parser& parser);
// The refusal of a request that the parser could not read; nothing if the client has left.
std::optional<Reply> refusal_of(const boost::system::error_code& error, uint64_t max_body);
// Status line and headers. `keep`: the connection stays open.
std::string head_of(const Reply& reply, bool keep);

// Counters for /metrics. Thread-safe.
struct Traffic {
    prometheus::Registry registry;
    prometheus::Family<prometheus::Counter>& counters(const char* name, const char* help) {
        return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
    }
    prometheus::Gauge& gauge(const char* name, const char* help) {
        return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
    }
    prometheus::Gauge& connections = gauge("postchain_http_connections", "Open connections.");
    prometheus::Gauge& listeners =
        gauge("postchain_http_listeners", "Connections that listen to events.");
    prometheus::Gauge& waiting =
        gauge("postchain_http_waiting_requests", "Requests that wait for an answer.");
    prometheus::Gauge& unsent =
        gauge("postchain_http_unsent_bytes", "Bytes of replies that clients have not read.");
    prometheus::Gauge& hanging =
        gauge("postchain_http_stuck_threads", "Threads of requests that hang in a disk.");
    prometheus::Counter& accepted =
        counters("postchain_http_accepted_total", "Connections accepted.").Add({});
    prometheus::Counter& turned_away =
        counters("postchain_http_turned_away_total", "Connections over a limit.").Add({});
    prometheus::Counter& cut_off =
        counters("postchain_http_cut_off_total", "Clients cut off at a deadline.").Add({});
    prometheus::Family<prometheus::Counter>& replies =
        counters("postchain_http_replies_total", "Replies by status.");
};

// State shared by the connections of a server. Only the I/O thread uses it, except the pools.
struct Shared {
    Shared(const ServerSettings& settings, Service& service);
    size_t hanging() const { return pool.hanging() + disk_pool.hanging() + event_pool.hanging(); }
    bool alive() const { return pool.alive() && disk_pool.alive() && event_pool.alive(); }

    ServerSettings settings;
    Service& service;
    boost::asio::io_context io{1};
    boost::asio::ip::tcp::acceptor acceptor{io};
    HelperThreads pool;        // calls of the service that read its store only
    HelperThreads disk_pool;   // calls that read files: a slow disk does not delay the others
    HelperThreads event_pool;  // reads events from the store: one thread, which takes one core
    Api api;
    EventLog events;
    std::map<uint64_t, std::shared_ptr<Connection>> connections;  // in the order of their coming
    // Requests that wait for an answer, by their shares; the oldest first.
    std::map<std::string, std::vector<Connection*>> waiting;
    bool closing = false;
    const std::string request_ids;  // how the ids of its requests begin
    uint64_t requests = 0;
    std::atomic<uint64_t> beats = 0;
    Traffic traffic;
};

class Connection : public std::enable_shared_from_this<Connection> {
  public:
    using Clock = std::chrono::steady_clock;

    // `number`: its key in Shared::connections.
    Connection(Shared& shared, boost::asio::ip::tcp::socket socket, std::string address,
               uint64_t number);

    // `over_limit`: the server is full. Then it closes after the first reply, which is a refusal
    // unless the request has a token, or is one that is answered at once, such as /healthz.
    void start(bool over_limit);
    // Sends one reply and closes.
    void turn_away(Reply reply);
    // Closes a connection past its deadline, and sends heartbeats to listeners.
    void tick(Clock::time_point now);
    void wake();     // after new events
    void finish();   // closes after the current reply, or at once if there is none
    void abandon();  // closes at once
    const std::string& place() const { return place_; }
    size_t unsent() const { return held_; }
    // Whether no request with a token has come or, if none is needed, no request at all.
    bool is_unproven() const { return state_ != State::closed && !proven_; }
    // Another user's request takes the place of the one that waits.
    void make_way();

  private:
    enum class State { header, body, working, writing, sending, listening, lingering, closed };

    void read_header();
    void on_header(const boost::system::error_code& error);
    void read_body();
    void on_body(const boost::system::error_code& error);
    void refuse_read(const boost::system::error_code& error);
    void work();
    bool find_place();
    void leave_queue();
    void watch_client();
    void reply(Reply reply);
    void send_file();
    void on_written(const boost::system::error_code& error);
    void listen(const EventsWanted& wanted);
    void watch_listener();
    void send_events();
    void send_batch(EventBatch batch);
    void linger();
    // Replaces content_, whose bytes count as unsent.
    void hold(std::string content);
    void count_unsent(size_t bytes);
    bool is_over_budget(size_t bytes) const;
    void audit(const Reply& answer) const;
    void deadline_in(std::chrono::milliseconds time) { deadline_ = Clock::now() + time; }

    Shared& shared_;
    boost::asio::ip::tcp::socket socket_;
    std::string address_;
    const uint64_t number_;
    std::string place_;  // place_of() the address
    State state_ = State::header;
    Clock::time_point deadline_;
    boost::beast::flat_buffer buffer_;
    std::optional<Parser> parser_;
    Request request_;
    std::optional<Admitted> admitted_;
    Sender sender_;                   // of the request
    uint64_t requests_ = 0;           // so far; a reply to an earlier one is dropped
    std::shared_ptr<FileBody> file_;  // of the current reply
    bool proven_ = false;             // is_unproven()
    bool waits_ = false;              // is in Shared::waiting
    bool keep_ = false;               // keep the connection open after this reply
    bool finish_ = false;             // finish() was called
    bool over_limit_ = false;         // of start()
    std::string head_;                // of the current reply
    std::string content_;
    size_t held_ = 0;  // bytes of content_, of an open connection
    // Listeners only.
    std::string share_;  // of the request
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
