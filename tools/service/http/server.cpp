#include "tools/service/http/server.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <vector>

#include "tools/service/http/connection.h"

namespace postchain::service {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kTick{200};
constexpr size_t kPump = 500;  // events per query of the store

// One run of a server: accepts, checks deadlines, and moves events from the store to listeners.
class Loop {
  public:
    Loop(Shared& shared, const std::atomic<bool>& stop)
        : shared_(shared), stop_(stop), timer_(shared.io), retry_(shared.io) {}

    size_t run() {
        shared_.service.on_event([this](const Event&) { poke(); });
        accept();
        tick();
        shared_.io.run();
        shared_.service.on_event([](const Event&) {});
        return shared_.pool.end() + shared_.disk_pool.end() + shared_.event_pool.end() +
               drainer_.end();
    }

  private:
    // Called from any thread after new events.
    void poke() {
        if (!poked_.exchange(true)) asio::post(shared_.io, [this] { pump(); });
    }

    void pump() {
        if (pumping_) return;
        pumping_ = true;
        poked_ = false;
        (void)shared_.event_pool.run([this, after = shared_.events.newest()] {
            auto found = shared_.service.events("", after, kPump);
            asio::post(shared_.io, [this, found = std::move(found)] {
                pumping_ = false;
                if (found.ok() && !found->empty()) {
                    shared_.events.add(*found);
                    each([](Connection& one) { one.wake(); });
                }
                if (poked_ || (found.ok() && found->size() == kPump)) pump();
            });
        });
    }

    void accept() {
        shared_.acceptor.async_accept([this](const error_code& error, tcp::socket socket) {
            if (!shared_.acceptor.is_open()) return;
            if (!error) {
                admit(std::move(socket));
                return accept();
            }
            // No free file descriptor, or the client left: the other connections continue.
            retry_.expires_after(kTick);
            retry_.async_wait([this](const error_code& canceled) {
                if (!canceled && shared_.acceptor.is_open()) accept();
            });
        });
    }

    void admit(tcp::socket socket) {
        error_code error;
        const auto peer = socket.remote_endpoint(error);
        if (error) return;
        const std::string address = peer.address().to_string();
        const std::string place = place_of(address);
        const ServerSettings& settings = shared_.settings;
        const auto is_full = [&] { return shared_.connections.size() >= settings.max_connections; };
        const bool trusted = shared_.api.guard().trusts(address);
        const auto is_many = [&] {
            const auto of_place = std::ranges::count_if(
                shared_.connections, [&](const auto& one) { return one.second->place() == place; });
            return !trusted && size_t(of_place) >= settings.max_connections_per_address;
        };
        shared_.traffic.accepted.Increment();
        // Connections that have not sent a request yet make way for new ones, so that nobody keeps
        // others out by opening them.
        if (is_many()) make_way(place);
        if (is_full()) make_way(most_unproven());
        const bool full = is_full(), many = is_many();
        if (full || many) shared_.traffic.turned_away.Increment();
        // Over kOverLimit, clients are closed without a reply.
        if (shared_.connections.size() >= settings.max_connections + kOverLimit) return;
        shared_.traffic.connections.Increment();
        const auto connection =
            std::make_shared<Connection>(shared_, std::move(socket), address, ++accepted_);
        shared_.connections.emplace(accepted_, connection);
        if (!many) return connection->start(full);
        connection->turn_away(problem(429, "this address has too many connections", 5));
    }

    // The address with the most connections that have not sent a request; empty = none has.
    std::string most_unproven() {
        std::map<std::string, size_t> counts;
        for (const auto& [number, one] : shared_.connections)
            if (one->is_unproven()) ++counts[one->place()];
        const auto most =
            std::ranges::max_element(counts, {}, [](const auto& one) { return one.second; });
        return most == counts.end() ? "" : most->first;
    }

    // Closes the oldest connection of an address that has not sent a request.
    void make_way(const std::string& place) {
        const auto oldest = std::ranges::find_if(shared_.connections, [&](const auto& one) {
            return one.second->is_unproven() && one.second->place() == place;
        });
        if (oldest == shared_.connections.end()) return;
        shared_.traffic.cut_off.Increment();
        const auto connection = oldest->second;  // which erases itself
        connection->abandon();
    }

    template <class F>
    void each(const F& f) {
        const auto all = shared_.connections;  // f may close some
        for (const auto& [number, one] : all) f(*one);
    }

    void tick() {
        const auto now = Connection::Clock::now();
        ++shared_.beats;
        each([&](Connection& one) { one.tick(now); });
        if (stop_ && !draining_) drain();
        if (shared_.closing && (shared_.connections.empty() || now > closed_by_)) {
            each([](Connection& one) { one.abandon(); });
            return;  // run() ends
        }
        timer_.expires_after(kTick);
        timer_.async_wait([this](const error_code&) { tick(); });
    }

    // First the jobs, while clients can still query them; then the clients.
    void drain() {
        draining_ = true;
        const auto work = [this] {
            shared_.service.drain();
            asio::post(shared_.io, [this] {
                shared_.closing = true;
                closed_by_ = Connection::Clock::now() + shared_.settings.closing;
                error_code ignored;
                shared_.acceptor.close(ignored);
                retry_.cancel();
                each([](Connection& one) { one.finish(); });
            });
        };
        // Without a thread the clients wait too.
        if (!drainer_.begin().ok() || !drainer_.run(work)) work();
    }

    static constexpr size_t kOverLimit = 64;  // connections

    Shared& shared_;
    const std::atomic<bool>& stop_;
    asio::steady_timer timer_, retry_;
    HelperThreads drainer_{1, 1};
    std::atomic<bool> poked_ = false;
    uint64_t accepted_ = 0;  // connections
    bool pumping_ = false;
    bool draining_ = false;
    Connection::Clock::time_point closed_by_;
};

}  // namespace

Server::Server(std::unique_ptr<Shared> shared) : shared_(std::move(shared)) {}

Server::~Server() {
    // A request that hangs goes on using it when its disk answers.
    if (lost_ > 0) (void)shared_.release();
}

Result<std::unique_ptr<Server>> Server::open(const ServerSettings& settings, Service& service) {
    error_code error;
    const auto address = asio::ip::make_address(settings.address, error);
    if (error)
        return Status(StatusCode::usage,
                      "--bind: '" + settings.address +
                          "' is not an address; 0.0.0.0 and :: stand for all addresses");
    auto shared = std::make_unique<Shared>(settings, service);
    const tcp::endpoint endpoint(address, settings.port);
    shared->acceptor.open(endpoint.protocol(), error);
    if (!error) shared->acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) shared->acceptor.bind(endpoint, error);
    if (error == boost::system::errc::address_not_available)
        return Status(StatusCode::usage,
                      "--bind: " + settings.address +
                          " is not an address of this machine; `ip address` lists them");
    if (!error) shared->acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error)
        return Status(StatusCode::output, concat("--port ", settings.port, ": ", error.message(),
                                                 "; choose another port, or 0 for any free one"));
    for (HelperThreads* pool : {&shared->pool, &shared->disk_pool, &shared->event_pool})
        RETURN_IF_ERROR(pool->begin());
    return std::unique_ptr<Server>(new Server(std::move(shared)));
}

uint16_t Server::port() const {
    error_code ignored;
    return shared_->acceptor.local_endpoint(ignored).port();
}

size_t Server::run(const std::atomic<bool>& stop) {
    auto loop = std::make_unique<Loop>(*shared_, stop);
    lost_ = loop->run();
    if (lost_ > 0) (void)loop.release();  // as shared_
    return lost_;
}

bool Server::alive() const {
    return shared_->alive();
}

uint64_t Server::beats() const {
    return shared_->beats;
}

}  // namespace postchain::service
