#include "tools/service/http/shared.h"

namespace postchain::service {
namespace {

constexpr size_t kStoreThreads = 2, kDiskThreads = 4;
constexpr auto kPatience = std::chrono::seconds(20);

}  // namespace

Shared::Shared(const ServerSettings& given, Service& what)
    : settings(given),
      service(what),
      pool(kStoreThreads, given.max_waiting + given.max_connections, kPatience),
      disk_pool(kDiskThreads, given.max_waiting + given.max_connections, kPatience),
      api(what, given.guard, given.version, [this] { return metrics(); }),
      events(newest_event(what), given.kept_events) {}

std::string Shared::metrics() const {
    const std::lock_guard lock(traffic_mutex);
    std::string text;
    const auto add = [&](const char* name, const char* type, const char* help, auto value) {
        text += concat("# HELP postchain_http_", name, " ", help, "\n# TYPE postchain_http_", name,
                       " ", type, "\npostchain_http_", name, " ", value, "\n");
    };
    add("connections", "gauge", "Open connections.", traffic.connections);
    add("listeners", "gauge", "Connections that listen to events.", traffic.listeners);
    add("waiting_requests", "gauge", "Requests that wait for an answer.", traffic.waiting);
    add("accepted_total", "counter", "Connections accepted.", traffic.accepted);
    add("turned_away_total", "counter", "Connections over a limit.", traffic.turned_away);
    add("cut_off_total", "counter", "Clients cut off at a deadline.", traffic.cut_off);
    text +=
        "# HELP postchain_http_replies_total Replies by status.\n"
        "# TYPE postchain_http_replies_total counter\n";
    for (const auto& [status, count] : traffic.replies)
        text += concat("postchain_http_replies_total{status=\"", status, "\"} ", count, "\n");
    return text;
}

}  // namespace postchain::service
