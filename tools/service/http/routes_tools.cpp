#include "tools/service/http/routes_tools.h"

#include "tools/service/http/replies.h"

namespace postchain::service {
namespace {

constexpr const char* kExr = "image/x-exr";
constexpr size_t kLongestSession = 128;

void preview(Service& service, const Call& call, const Respond& respond) {
    PreviewWanted wanted;
    // EXR only if Accept names it; a wildcard gets PNG.
    const std::string* accept = call.request.header("Accept");
    if (accept && accept->find(kExr) != std::string::npos) wanted.type = kExr;
    if (const std::string* session = call.request.header("Preview-Session"))
        wanted.session = session->substr(0, kLongestSession);
    wanted.left = call.request.left;
    service.preview(call.user, call.request.body, wanted,
                    [respond](Answer<Picture> picture) { respond(image_reply(picture)); });
}

}  // namespace

void add_tool_routes(std::vector<Route>& routes, Service& service) {
    routes.push_back({.method = "POST",
                      .path = "/v1/plan",
                      .operation = "planFrames",
                      .summary = "Plans frames: steps, elided steps with reasons",
                      .handle = replies([&](const Call& call) {
                          return reply_to(
                              service.plan(call.user, call.request.body),
                              [](const std::string& text) { return json_reply(200, text); });
                      }),
                      .body = "PlanRequest",
                      .refusals = {403, 422}});
    routes.push_back({.method = "POST",
                      .path = "/v1/preview",
                      .operation = "previewFrame",
                      .summary = "Filters one frame. A later preview with the same header "
                                 "Preview-Session ends an earlier one",
                      .handle = [&](const Call& call,
                                    const Respond& respond) { preview(service, call, respond); },
                      .body = "PreviewRequest",
                      .refusals = {403, 409, 422},
                      .type = "image/png"});
    routes.push_back(
        {.method = "POST",
         .path = "/v1/chain/check",
         .operation = "checkChain",
         .summary = "Checks the text of a chain file",
         .handle = replies([&](const Call& call) {
             return reply_to(service.check_chain(call.request.body), [](const Diagnostics& found) {
                 return json_reply(200, "{\"diagnostics\": " + json_of(found) + "}");
             });
         }),
         .body = "ChainText",
         .refusals = {422},
         .schema = "Diagnostics"});
}

}  // namespace postchain::service
