#include "tools/service/http/connection.h"

#include <sys/socket.h>

#include <prometheus/text_serializer.h>
#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/read.hpp>
#include <cerrno>
#include <ctime>
#include <random>

#include "chain/base/parameter.h"

namespace postchain::service {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

constexpr size_t kBatch = 100;            // events per write
constexpr size_t kLongestTarget = 4096;   // bytes
constexpr size_t kReadAhead = 64 * 1024;  // buffered bytes in addition to a header
constexpr size_t kSmall = 64 * 1024;      // bytes of a reply that is always sent
constexpr std::chrono::milliseconds kLinger{2000};
constexpr const char* kRequestId = "X-Request-Id";
constexpr size_t kLongestRequestId = 64;

// Different for each process.
std::string new_request_ids() {
    std::random_device random;
    return hex_of(random()).substr(8) + "-";
}

bool is_request_id(const std::string& text) {
    constexpr const char* kPlain =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-_.";
    return !text.empty() && text.size() <= kLongestRequestId &&
           text.find_first_not_of(kPlain) == std::string::npos;
}
constexpr size_t kStoreThreads = 2, kDiskThreads = 4;
constexpr auto kPatience = std::chrono::seconds(20);

Reply too_many() {
    return problem(429, "too many requests are waiting; try again soon", 1);
}

std::string date() {
    const std::time_t now = std::time(nullptr);
    std::tm parts = {};
    gmtime_r(&now, &parts);
    char text[64];
    std::strftime(text, sizeof(text), "%a, %d %b %Y %H:%M:%S GMT", &parts);
    return text;
}

// RFC 9112, 3.2.2: the address of a target such as http://host/v1/jobs takes the place of Host.
void take_address(Request& request) {
    for (const std::string_view scheme : {"http://", "https://"}) {
        if (!same_word(std::string_view(request.target).substr(0, scheme.size()), scheme)) continue;
        const size_t end =
            std::min(request.target.find_first_of("/?", scheme.size()), request.target.size());
        for (auto& [name, value] : request.headers)
            if (same_word(name, "Host"))
                value = request.target.substr(scheme.size(), end - scheme.size());
        request.target.erase(0, end);
        if (!request.target.starts_with('/')) request.target.insert(0, "/");
        return;
    }
}

// Headers of every reply: nosniff, no-referrer, and a policy for frames and scripts.
Headers security_headers(const Reply& reply) {
    Headers headers = {{"X-Content-Type-Options", "nosniff"},
                       {"Referrer-Policy", "no-referrer"},
                       {"Cross-Origin-Resource-Policy", "same-origin"},
                       {"Cache-Control", "no-store"}};
    bool has_policy = false;
    for (const auto& [name, value] : reply.headers) has_policy |= name == kPolicy;
    if (!has_policy) headers.emplace_back(kPolicy, "default-src 'none'; frame-ancestors 'none'");
    return headers;
}

}  // namespace

// ------------------------------------------------------------------------------------- the bytes
Request request_of(const Parser& parser) {
    const auto& message = parser.get();
    Request request;
    request.method = std::string(message.method_string());
    request.target = std::string(message.target());
    request.http_1_0 = message.version() < 11;
    for (const auto& field : message)
        request.headers.emplace_back(std::string(field.name_string()), std::string(field.value()));
    take_address(request);
    return request;
}

std::optional<Reply> refusal_of(const boost::system::error_code& error, uint64_t max_body) {
    if (error == http::error::header_limit) return problem(431, "the header is too long");
    if (error == http::error::body_limit)
        return problem(413, concat("the body is longer than ", max_body, " bytes"));
    if (error == http::error::bad_version)
        return problem(505, "this service supports only HTTP/1.1");
    const bool malformed =
        error.category() == http::make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message;
    if (malformed) return problem(400, "the request is not well formed");
    return std::nullopt;
}

// No header value contains a line break.
std::string head_of(const Reply& reply, bool keep) {
    std::string head = "HTTP/1.1 " + std::to_string(reply.status) + " " + reason_of(reply.status);
    const auto add = [&](const std::string& name, const std::string& value) {
        head += "\r\n" + name + ": " + value;
    };
    add("Date", date());
    for (const auto& [name, value] : security_headers(reply)) add(name, value);
    for (const auto& [name, value] : reply.headers) add(name, value);
    if (reply.status != 204) add("Content-Type", reply.type);
    // nginx would keep events until its buffer is full.
    if (reply.events) add("X-Accel-Buffering", "no");
    if (!reply.events && reply.status != 204)
        add("Content-Length", std::to_string(reply.file ? reply.file->bytes() : reply.body.size()));
    if (!keep) add("Connection", "close");
    return head + "\r\n\r\n";
}

// -------------------------------------------------------------------------------- the connection

Shared::Shared(const ServerSettings& given, Service& what)
    : settings(given),
      service(what),
      pool(kStoreThreads, given.max_waiting + given.max_connections, kPatience),
      disk_pool(kDiskThreads, given.max_waiting + given.max_connections, kPatience),
      event_pool(1, given.max_connections + 1, kPatience),
      api(what, given.guard, given.version,
          {[this] { return hanging(); }, [this] { return alive(); },
           [this] { return std::max(pool.stalled(), disk_pool.stalled()); },
           [this] {
               traffic.hanging.Set(double(hanging()));
               return prometheus::TextSerializer().Serialize(traffic.registry.Collect());
           }}),
      events(what.newest_event(), given.kept_events),
      request_ids(new_request_ids()) {}

Connection::Connection(Shared& shared, asio::ip::tcp::socket socket, std::string address,
                       uint64_t number)
    : shared_(shared),
      socket_(std::move(socket)),
      address_(std::move(address)),
      number_(number),
      place_(place_of(address_)),
      buffer_(shared.settings.max_header + kReadAhead) {
    error_code ignored;
    socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
}

void Connection::start(bool over_limit) {
    over_limit_ = over_limit;
    read_header();
}

void Connection::turn_away(Reply reason) {
    keep_ = false;
    reply(std::move(reason));
}

void Connection::read_header() {
    state_ = State::header;
    deadline_in(shared_.settings.header);
    admitted_.reset();
    sender_ = {};
    request_ = {};
    parser_.emplace();
    parser_->header_limit(shared_.settings.max_header);
    parser_->body_limit(shared_.settings.max_body);
    http::async_read_header(
        socket_, buffer_, *parser_,
        [self = shared_from_this()](const error_code& error, size_t) { self->on_header(error); });
}

void Connection::refuse_read(const error_code& error) {
    keep_ = false;
    auto refusal = refusal_of(error, shared_.settings.max_body);
    if (!refusal) return abandon();  // the client left, or missed its deadline
    reply(std::move(*refusal));
}

void Connection::on_header(const error_code& error) {
    if (state_ == State::closed) return;
    if (error) return refuse_read(error);
    request_ = request_of(*parser_);
    request_.peer = address_;
    request_.id = concat(shared_.request_ids, ++shared_.requests);
    // A proxy's name for it is in the proxy's log. Another client could name two alike.
    if (const std::string* given = request_.header(kRequestId);
        given && is_request_id(*given) && shared_.api.guard().trusts(address_))
        request_.id = *given;
    request_.left = std::make_shared<std::atomic<bool>>(false);
    keep_ = parser_->keep_alive() && !over_limit_;
    if (request_.target.size() > kLongestTarget) {
        keep_ = false;
        return reply(problem(414, "the address is too long"));
    }
    auto admitted = shared_.api.admit(request_);
    if (auto* refused = std::get_if<Reply>(&admitted)) {
        // Bytes after a refused header are not read, so that they are never parsed as a request.
        if (!parser_->is_done()) keep_ = false;
        if (refused->status == 400 || refused->status == 501) keep_ = false;
        return reply(std::move(*refused));
    }
    admitted_ = std::move(std::get<Admitted>(admitted));
    sender_ = admitted_->sender;
    const bool has_token = !shared_.api.guard().users().are_everyone() && sender_.user;
    if (over_limit_ && !has_token && !admitted_->match.route->is("at_once"))
        return reply(problem(503, "too many connections; try again soon", 5));
    proven_ |= sender_.user != nullptr;
    request_.share = shared_.api.guard().share_of(request_, sender_.user);
    if (parser_->is_done()) return work();
    state_ = State::body;
    deadline_in(shared_.settings.body);
    const std::string* expect = request_.header("Expect");
    if (!expect) return read_body();
    if (!same_word(*expect, "100-continue")) {
        keep_ = false;
        return reply(problem(400, "Expect allows only 100-continue"));
    }
    head_ = "HTTP/1.1 100 Continue\r\n\r\n";
    asio::async_write(socket_, asio::buffer(head_),
                      [self = shared_from_this()](const error_code& failed, size_t) {
                          if (self->state_ == State::closed) return;
                          if (failed) return self->abandon();
                          self->read_body();
                      });
}

void Connection::read_body() {
    http::async_read(
        socket_, buffer_, *parser_,
        [self = shared_from_this()](const error_code& error, size_t) { self->on_body(error); });
}

void Connection::on_body(const error_code& error) {
    if (state_ == State::closed) return;
    if (error) return refuse_read(error);
    request_.body = std::move(parser_->get().body());
    work();
}

void Connection::work() {
    state_ = State::working;
    deadline_in(shared_.settings.working);
    // One reply per request, even if a handler fails after its reply.
    const auto respond = [self = shared_from_this(), &io = shared_.io,
                          request = ++requests_](Reply answer) {
        asio::post(io, [self, request, answer = std::move(answer)]() mutable {
            if (self->state_ != State::working || self->requests_ != request) return;
            self->reply(std::move(answer));
        });
    };
    if (admitted_->match.route->is("at_once"))
        return shared_.api.run(*admitted_, request_, respond);
    if (!find_place()) return respond(too_many());
    waits_ = true;
    shared_.traffic.waiting.Increment();
    shared_.waiting[request_.share].push_back(this);
    watch_client();
    // The task has its own copies: after a deadline the connection may go on to another request.
    HelperThreads& pool = admitted_->match.route->is("files") ? shared_.disk_pool : shared_.pool;
    const bool taken = pool.run(
        [&shared = shared_, respond, admitted = *admitted_, request = request_] {
            // Nobody waits for the work of a client that has left.
            if (*request.left) return respond(problem(503, "the client has left"));
            try {
                shared.api.run(admitted, request, respond);
            } catch (const std::bad_alloc&) {
                respond(problem(503, "not enough memory for this request"));
            } catch (const std::exception&) {
                respond(problem(500, "the request failed"));
            }
        },
        {request_.share, {}, request_.left});
    if (!taken) respond(problem(503, "the service is shutting down"));
}

// If too many requests wait, the newest of the share with the most makes way for one of a share
// that has fewer.
bool Connection::find_place() {
    if (shared_.traffic.waiting.Value() < double(shared_.settings.max_waiting)) return true;
    std::vector<Connection*>* most = nullptr;
    for (auto& [share, waiting] : shared_.waiting)
        if (!most || waiting.size() > most->size()) most = &waiting;
    const auto own = shared_.waiting.find(request_.share);
    const size_t mine = own == shared_.waiting.end() ? 0 : own->second.size();
    if (!most || most->size() <= mine + 1) return false;
    most->back()->make_way();
    return true;
}

void Connection::make_way() {
    *request_.left = true;
    reply(too_many());
}

void Connection::leave_queue() {
    if (!waits_) return;
    waits_ = false;
    shared_.traffic.waiting.Decrement();
    const auto waiting = shared_.waiting.find(request_.share);
    std::erase(waiting->second, this);
    if (waiting->second.empty()) shared_.waiting.erase(waiting);
}

// Notices that the client has left during its request, and ends its preview. Bytes of a next
// request stay where they are.
void Connection::watch_client() {
    socket_.async_wait(
        asio::ip::tcp::socket::wait_read,
        [self = shared_from_this(), request = requests_](const error_code& error) {
            if (error || self->state_ != State::working || self->requests_ != request) return;
            char byte = 0;
            const ssize_t got =
                ::recv(self->socket_.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
            if (got > 0 || (got < 0 && errno == EAGAIN)) return;
            *self->request_.left = true;
            self->abandon();
        });
}

void Connection::hold(std::string content) {
    content_ = std::move(content);
    count_unsent(content_.size());
}

void Connection::count_unsent(size_t bytes) {
    prometheus::Gauge& unsent = shared_.traffic.unsent;
    unsent.Set(unsent.Value() + double(bytes) - double(held_));
    held_ = bytes;
}

// One address may take half of the budget, unless it is a proxy's, and always one reply.
bool Connection::is_over_budget(size_t bytes) const {
    const size_t most = shared_.settings.max_unsent;
    if (bytes <= kSmall) return false;
    size_t all = 0, own = 0;  // unsent by now
    for (const auto& [number, one] : shared_.connections) {
        all += one->unsent();
        if (one->place() == place_) own += one->unsent();
    }
    if (all > 0 && all + bytes > most) return true;
    return own > 0 && own + bytes > most / 2 && !shared_.api.guard().trusts(address_);
}

void Connection::audit(const Reply& answer) const {
    if (!shared_.settings.audit || request_.method.empty()) return;
    const bool wrong = !admitted_ && answer.status == 401 && request_.header("Authorization");
    const bool changes = admitted_ && admitted_->match.route->is("audited");
    if (!wrong && !changes) return;
    const std::string address = shared_.api.guard().address_of(request_);
    const std::string action = wrong ? "logIn" : admitted_->match.route->operation();
    const std::string user = changes && sender_.user ? sender_.user->name : "";
    const std::string job =
        changes && !admitted_->match.values.empty() ? admitted_->match.values[0].substr(0, 40) : "";
    LogLine line;
    line.level = wrong ? LogLine::Level::warning : LogLine::Level::info;
    line.fields = {{"event", "audit"},
                   {"action", action},
                   {"address", address},
                   {"status", answer.status},
                   {"request", request_.id}};
    if (!user.empty()) line.fields["user"] = user;
    if (!job.empty()) line.fields["job"] = job;
    line.message = wrong ? concat("log-in failed: ", address, ", request ", request_.id)
                         : concat(user, user.empty() ? "" : " at ", address, ": ", action,
                                  job.empty() ? "" : " ", job, ", status ", answer.status,
                                  ", request ", request_.id);
    shared_.settings.audit(line);
}

void Connection::reply(Reply answer) {
    leave_queue();
    if (request_.method != "HEAD" && is_over_budget(answer.body.size()))
        answer = problem(503, "too many replies wait to be read; try again soon", 5);
    // A connection that is turned away, or a header that cannot be read, has none.
    if (!request_.id.empty()) {
        name_request(answer, request_.id);
        answer.headers.emplace_back(kRequestId, request_.id);
    }
    shared_.traffic.replies.Add({{"status", std::to_string(answer.status)}}).Increment();
    if (shared_.settings.log)
        shared_.settings.log(concat(address_, " ", request_.method, " ", request_.target, " ",
                                    answer.status, " ", answer.body.size(), " ", request_.id));
    audit(answer);
    if (shared_.closing || finish_) keep_ = false;
    if (answer.events) keep_ = false;
    boost::system::error_code ignored;
    socket_.cancel(ignored);  // watch_client()
    head_ = head_of(answer, keep_);
    file_ = request_.method == "HEAD" ? nullptr : answer.file;
    hold(request_.method == "HEAD" ? "" : std::move(answer.body));
    state_ = State::writing;
    // One more second per 64 KiB, for large images.
    deadline_in(shared_.settings.write + std::chrono::seconds(content_.size() >> 16));
    const std::array<asio::const_buffer, 2> buffers = {asio::buffer(head_), asio::buffer(content_)};
    asio::async_write(
        socket_, buffers,
        [self = shared_from_this(), wanted = answer.events](const error_code& error, size_t) {
            if (self->state_ == State::closed) return;
            if (!error && wanted) {
                self->hold({});
                return self->listen(*wanted);
            }
            if (!error && self->file_) return self->send_file();
            self->on_written(error);
        });
}

void Connection::on_written(const error_code& error) {
    if (error) return abandon();
    hold({});
    if (keep_ && !finish_) return read_header();
    linger();
}

// Reads a part of the body on another thread, and sends it.
void Connection::send_file() {
    state_ = State::sending;
    hold({});
    deadline_in(shared_.settings.working);
    const bool taken = shared_.disk_pool.run(
        [self = shared_from_this(), file = file_] {
            auto part = file->next();
            asio::post(self->shared_.io, [self, part = std::move(part)]() mutable {
                if (self->state_ != State::sending) return;
                // The length has been sent: only an early end tells the client of an error.
                if (!part.ok()) return self->abandon();
                if (part->empty()) {
                    self->file_.reset();
                    return self->on_written({});
                }
                self->hold(std::move(*part));
                self->deadline_in(self->shared_.settings.write);
                asio::async_write(self->socket_, asio::buffer(self->content_),
                                  [self](const error_code& error, size_t) {
                                      if (self->state_ != State::sending) return;
                                      if (error) return self->abandon();
                                      self->send_file();
                                  });
            });
        },
        {request_.share, {}, request_.left});
    if (!taken) abandon();
}

// Closing a socket with unread bytes resets the connection, and the client may lose the reply.
void Connection::linger() {
    if (state_ != State::lingering) {
        deadline_in(kLinger);
        if (state_ == State::listening) shared_.traffic.listeners.Decrement();
        error_code ignored;
        socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    }
    state_ = State::lingering;
    socket_.async_read_some(asio::buffer(scrap_),
                            [self = shared_from_this()](const error_code& error, size_t) {
                                if (self->state_ == State::closed) return;
                                if (error) return self->abandon();
                                self->linger();
                            });
}

void Connection::listen(const EventsWanted& wanted) {
    state_ = State::listening;
    share_ = request_.share;
    parser_.reset();
    buffer_.clear();
    buffer_.shrink_to_fit();
    request_ = {};
    admitted_.reset();
    job_ = wanted.job;
    // An id that the store has not given is of another store, such as an older copy of this one.
    sent_ = std::min(wanted.after.value_or(shared_.events.newest()), shared_.events.newest());
    spoke_ = Clock::now();
    shared_.traffic.listeners.Increment();
    watch_listener();
    send_events();
}

// Detects that the client has left. A listener that sends anything is disconnected.
void Connection::watch_listener() {
    socket_.async_read_some(asio::buffer(scrap_),
                            [self = shared_from_this()](const error_code&, size_t) {
                                if (self->state_ == State::listening) self->abandon();
                            });
}

void Connection::wake() {
    if (state_ == State::listening) send_events();
}

void Connection::send_events() {
    if (sending_ || fetching_) return;
    if (finish_) return linger();
    if (shared_.events.covers(sent_)) {
        EventBatch batch = shared_.events.after(sent_, job_, kBatch);
        if (!batch.texts.empty()) return send_batch(std::move(batch));
        sent_ = batch.last;
        if (ends_) linger();
        return;
    }
    fetching_ = true;
    const auto fetch = [self = shared_from_this(), after = sent_] {
        const auto found = self->shared_.service.events(self->job_, after, kBatch);
        std::optional<EventBatch> batch;
        if (found.ok()) batch = batch_of(*found, after);
        asio::post(self->shared_.io, [self, batch = std::move(batch)]() mutable {
            self->fetching_ = false;
            if (self->state_ != State::listening) return;
            if (!batch) return self->abandon();
            if (!batch->texts.empty()) return self->send_batch(std::move(*batch));
            // The job has no events before those in memory.
            self->sent_ = std::max(self->sent_, self->shared_.events.floor());
            self->send_events();
        });
    };
    if (!shared_.event_pool.run(fetch, {share_})) abandon();
}

void Connection::send_batch(EventBatch batch) {
    sending_ = true;
    batch_ = std::move(batch.texts);
    sent_ = batch.last;
    ends_ = batch.ends && !job_.empty();
    spoke_ = Clock::now();
    deadline_in(shared_.settings.write);
    std::vector<asio::const_buffer> buffers;
    buffers.reserve(batch_.size());
    for (const EventText& text : batch_) buffers.push_back(asio::buffer(*text));
    asio::async_write(socket_, buffers,
                      [self = shared_from_this()](const error_code& error, size_t) {
                          self->sending_ = false;
                          self->batch_.clear();
                          if (self->state_ != State::listening) return;
                          if (error) return self->abandon();
                          self->send_events();
                      });
}

void Connection::tick(Clock::time_point now) {
    if (state_ == State::closed) return;
    // A user who was removed, or whose token was, gets nothing more.
    const bool is_served = state_ != State::header && state_ != State::body;
    if (is_served && sender_.user && !shared_.api.guard().users().still_have(sender_))
        return abandon();
    if (state_ == State::listening && !sending_) {
        if (now - spoke_ < shared_.settings.heartbeat) return;
        static const EventText kComment = std::make_shared<const std::string>(":\n\n");
        EventBatch comment;
        comment.texts = {kComment};
        comment.last = sent_;
        comment.ends = ends_;
        return send_batch(std::move(comment));
    }
    if (now < deadline_) return;
    if (state_ == State::working) {
        *request_.left = true;
        return reply(
            problem(503,
                    concat("the request took longer than ", shared_.settings.working.count() / 1000,
                           " s; a disk may hang, see /readyz"),
                    60));
    }
    if (state_ != State::lingering && state_ != State::header) shared_.traffic.cut_off.Increment();
    abandon();
}

void Connection::finish() {
    finish_ = true;
    if (state_ == State::header) return abandon();
    if (state_ == State::listening) send_events();
}

void Connection::abandon() {
    if (state_ == State::closed) return;
    if (state_ == State::listening) shared_.traffic.listeners.Decrement();
    if (request_.left) *request_.left = true;
    leave_queue();
    count_unsent(0);  // but a write under way may still read content_
    state_ = State::closed;
    error_code ignored;
    socket_.close(ignored);
    shared_.traffic.connections.Decrement();
    shared_.connections.erase(number_);
}

}  // namespace postchain::service
