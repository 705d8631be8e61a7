#include "tools/service/http/route.h"

#include <algorithm>
#include <optional>
#include <regex>

#include "tools/service/http/interface.h"
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
    if (!route.queries.contains(name)) return "unknown query parameter '" + name + "'";
    const io::Json& schema = route.queries[name];
    if (const auto words = schema.find("enum"); words != schema.end()) {
        const auto list = words->get<std::vector<std::string>>();
        if (std::ranges::count(list, value) == 0) return name + " is not one of " + joined(list);
    }
    if (const auto pattern = schema.find("pattern");
        pattern != schema.end() &&
        !std::regex_match(value, std::regex(pattern->get<std::string>())))
        return name + " is not valid; expected: " + schema["description"].get<std::string>();
    if (schema.value("type", "") == "integer") {
        const int64_t least = schema["minimum"], most = schema["maximum"];
        const auto number = number_of<int64_t>(value);
        if (!number || *number < least || *number > most)
            return concat(name, " is not an integer in ", least, "..", most);
    }
    return "";
}

bool takes(const Route& route, const std::string& method) {
    return route.method == method ||
           (method == "HEAD" && route.method == "GET" && !route.is("streams"));
}

}  // namespace

std::string Call::query(const std::string& name) const {
    if (const auto given = target.query.find(name); given != target.query.end())
        return given->second;
    const io::Json schema = route.queries.value(name, io::Json::object());
    const auto preset = schema.find("default");
    if (preset == schema.end()) return "";
    return preset->is_string() ? preset->get<std::string>() : preset->dump();
}

bool Route::is(const char* word) const {
    const auto words = about.find("is");
    return words != about.end() && std::ranges::count(*words, word) > 0;
}

std::vector<Route> routes_of(const std::map<std::string, Handler>& handlers) {
    const io::Json& interface = service_interface();
    std::vector<Route> routes;
    for (const auto& [key, about] : interface["operations"].items()) {
        const size_t space = key.find(' ');
        Route& route = routes.emplace_back();
        route.method = key.substr(0, space);
        route.path = key.substr(space + 1);
        route.about = about;
        route.handle = handlers.at(route.operation());
        for (const std::string row : about.value("queries", io::Json::array()))
            route.queries[row.substr(0, row.find('.'))] = interface["queries"][row];
    }
    return routes;
}

Handler replies(std::function<Reply(const Call&)> reply) {
    return [reply = std::move(reply)](const Call& call, const Respond& respond) {
        respond(reply(call));
    };
}

bool is_open(const std::vector<Route>& routes, const std::string& method, const Target& target) {
    return std::ranges::any_of(routes, [&](const Route& route) {
        return takes(route, method) && match(route.path, target.segments) && route.is("open");
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
            for (const auto& [name, schema] : route.queries.items())
                if (schema.contains("required") && !target.query.contains(name))
                    return problem(400, name + " is not given");
            return Match{&route, std::move(*values)};
        }
        allowed.push_back(route.method);
        if (route.method == "GET" && !route.is("streams")) allowed.push_back("HEAD");
    }
    if (allowed.empty()) return problem(404, "unknown address");
    std::string list;
    for (const auto& one : allowed) list += (list.empty() ? "" : ", ") + one;
    Reply reply = problem(405, "this address allows " + list);
    reply.headers.emplace_back("Allow", list);
    return reply;
}

}  // namespace postchain::service
