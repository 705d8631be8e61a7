#include "tools/service/http/route.h"

#include <algorithm>
#include <optional>
#include <regex>

#include "tools/service/http/problem.h"

namespace postchain::service {
namespace {

std::vector<std::string> segments_of(const std::string& path) {
    std::vector<std::string> segments;
    for (size_t at = 1; at <= path.size();) {
        const size_t end = std::min(path.find('/', at), path.size());
        segments.push_back(path.substr(at, end - at));
        at = end + 1;
    }
    return segments;
}

std::optional<std::vector<std::string>> match(const std::string& path,
                                              const std::vector<std::string>& given) {
    const auto wanted = segments_of(path);
    std::vector<std::string> values;
    for (size_t i = 0; i < wanted.size(); ++i) {
        if (i >= given.size()) return std::nullopt;
        const std::string& word = wanted[i];
        if (word.ends_with("...}")) {
            std::string rest;
            for (size_t k = i; k < given.size(); ++k) {
                if (given[k].empty()) return std::nullopt;
                rest += (k == i ? "" : "/") + given[k];
            }
            values.push_back(std::move(rest));
            return values;
        }
        if (word.starts_with("{")) {
            if (given[i].empty()) return std::nullopt;
            values.push_back(given[i]);
        } else if (word != given[i]) {
            return std::nullopt;
        }
    }
    if (given.size() != wanted.size()) return std::nullopt;
    return values;
}

// Why a query is refused; empty = it is not.
std::string fault_of(const Route& route, const std::string& name, const std::string& value) {
    const auto found = std::ranges::find(route.queries, name, &QueryParameter::name);
    if (found == route.queries.end()) return "unknown query parameter '" + name + "'";
    if (!found->words.empty() && std::ranges::find(found->words, value) == found->words.end())
        return name + " is not one of " + joined(found->words, ", ");
    if (!found->pattern.empty() && !std::regex_match(value, std::regex(found->pattern)))
        return name + " is not valid; expected: " + found->description;
    if (const auto& range = found->integer) {
        const auto number = number_of<int64_t>(value);
        if (!number || *number < range->least || *number > range->most)
            return concat(name, " is not an integer in ", range->least, "..", range->most);
    }
    return "";
}

bool takes(const Route& route, const std::string& method) {
    return route.method == method || (method == "HEAD" && route.method == "GET" && !route.streams);
}

}  // namespace

std::string Call::query(const std::string& name) const {
    const auto found = target.query.find(name);
    return found == target.query.end() ? "" : found->second;
}

Handler replies(std::function<Reply(const Call&)> reply) {
    return [reply = std::move(reply)](const Call& call, const Respond& respond) {
        respond(reply(call));
    };
}

bool is_open(const std::vector<Route>& routes, const std::string& method, const Target& target) {
    return std::ranges::any_of(routes, [&](const Route& route) {
        return route.open && takes(route, method) && match(route.path, target.segments);
    });
}

std::variant<Match, Reply> find_route(const std::vector<Route>& routes, const std::string& method,
                                      const Target& target) {
    std::vector<std::string> allowed;
    for (const Route& route : routes) {
        auto values = match(route.path, target.segments);
        if (!values) continue;
        if (takes(route, method)) {
            for (const auto& [key, value] : target.query)
                if (const std::string fault = fault_of(route, key, value); !fault.empty())
                    return problem(400, fault);
            for (const QueryParameter& query : route.queries)
                if (query.required && !target.query.contains(query.name))
                    return problem(400, query.name + " is not given");
            return Match{&route, std::move(*values)};
        }
        allowed.push_back(route.method);
        if (route.method == "GET" && !route.streams) allowed.push_back("HEAD");
    }
    if (allowed.empty()) return problem(404, "unknown address");
    std::string list;
    for (const auto& one : allowed) list += (list.empty() ? "" : ", ") + one;
    Reply reply = problem(405, "this address allows " + list);
    reply.headers.emplace_back("Allow", list);
    return reply;
}

}  // namespace postchain::service
