#include "tools/service/http/routes_about.h"

#include "tools/service/http/openapi.h"
#include "tools/service/http/replies.h"
#include "tools/service/page/page.h"

namespace postchain::service {
namespace {

using io::Json;

constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src "
    "'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

Reply readiness(Service& service, const Call& call) {
    const Health health = service.health();
    const bool ready =
        health.gl && health.disk && health.queue && health.progress && !health.draining;
    Json body = {{"ready", ready},
                 {"gl", health.gl},
                 {"disk", health.disk},
                 {"queue", health.queue},
                 {"progress", health.progress},
                 {"draining", health.draining}};
    // Details of the machine need the token.
    if (call.user.name != kStranger) {
        body["renderer"] = health.renderer;
        body["why"] = health.why;
    }
    Reply reply = json_reply(ready ? 200 : 503, io::json_text(body));
    if (!ready) reply.headers.emplace_back("Retry-After", "5");
    return reply;
}

Reply page_file(const PageFile& file) {
    Reply reply;
    reply.type = file.type;
    reply.body = std::string(file.text);
    reply.headers.emplace_back(kPolicy, kPagePolicy);
    return reply;
}

void add_session(std::vector<Route>& routes, const Guard& guard, const std::string& version) {
    routes.push_back({.path = "/v1/session",
                      .operation = "getSession",
                      .summary = "Whether a token is required, and whose the request has",
                      .handle = replies([&guard, version](const Call& call) {
                          const bool known = call.user.name != kStranger;
                          const Json body = {{"token", guard.asks_for_token()},
                                             {"known", known},
                                             {"user", known ? call.user.name : ""},
                                             {"admin", known && call.user.admin},
                                             {"version", version}};
                          return json_reply(200, io::json_text(body));
                      }),
                      .open = true});
    const auto cookie = [&guard](bool begins) {
        return replies([&guard, begins](const Call& call) {
            Reply reply;
            reply.status = 204;
            const std::string value = begins ? call.user.session : "";
            if (!begins || !value.empty())
                reply.headers.emplace_back("Set-Cookie", guard.cookie(call.request, value));
            return reply;
        });
    };
    routes.push_back({.method = "POST",
                      .path = "/v1/session",
                      .operation = "beginSession",
                      .summary = "Sets a session cookie for a page that sends the token",
                      .handle = cookie(true),
                      .status = 204});
    routes.push_back({.method = "DELETE",
                      .path = "/v1/session",
                      .operation = "endSession",
                      .summary = "Removes the session cookie",
                      .handle = cookie(false),
                      .status = 204});
}

}  // namespace

void add_about_routes(std::vector<Route>& routes, Service& service, const Guard& guard,
                      const std::string& version, std::function<std::string()> more_metrics) {
    const auto text = [&](const char* path, const char* operation, const char* summary,
                          std::function<std::string()> get) {
        routes.push_back({.path = path,
                          .operation = operation,
                          .summary = summary,
                          .handle = replies([get = std::move(get)](const Call&) {
                              return json_reply(200, get());
                          })});
    };
    text("/v1/passes", "listPasses", "Passes and parameters", [&] { return service.passes(); });
    text("/v1/schema", "getChainSchema", "JSON Schema of a chain file",
         [&] { return service.chain_schema(); });
    text("/v1/schema/job", "getJobSchema", "JSON Schema of a job",
         [&] { return io::json_text(service.job_schema(), 2); });
    text("/openapi.json", "getOpenApi", "This interface as OpenAPI", [&, version] {
        return openapi_of(routes, service.job_schema(), version, guard.asks_for_token());
    });
    routes.push_back(
        {.path = "/healthz",
         .operation = "getHealth",
         .summary = "200 while the process runs",
         .handle = replies([](const Call&) { return json_reply(200, "{\"status\": \"ok\"}"); }),
         .open = true,
         .at_once = true});
    routes.push_back(
        {.path = "/readyz",
         .operation = "getReadiness",
         .summary = "200 if the service accepts jobs and they make progress, otherwise 503",
         .handle = replies([&](const Call& call) { return readiness(service, call); }),
         .open = true});
    routes.push_back({.path = "/metrics",
                      .operation = "getMetrics",
                      .summary = "Prometheus text format",
                      .handle = replies([&service, more_metrics](const Call&) {
                          Reply reply;
                          reply.type = "text/plain; version=0.0.4; charset=utf-8";
                          reply.body = service.metrics();
                          if (more_metrics) reply.body += more_metrics();
                          return reply;
                      }),
                      .type = "text/plain"});
    for (const PageFile& file : page_files())
        routes.push_back({.path = file.address,
                          .operation = file.operation,
                          .summary = file.what,
                          .handle = replies([file](const Call&) { return page_file(file); }),
                          .open = true,
                          .type = file.type.substr(0, file.type.find(';')),
                          .at_once = true});
    add_session(routes, guard, version);
}

}  // namespace postchain::service
