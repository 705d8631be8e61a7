#include "tools/service/http/routes_tools.h"

#include "tools/measure/report/page/encode.h"
#include "tools/service/http/replies.h"

namespace postchain::service {
namespace {

constexpr size_t kLongestSession = 128;

Reply as_json(const std::string& text) {
    return json_reply(200, text);
}

void preview(Service& service, const Call& call, const Respond& respond) {
    PreviewWanted wanted;
    // Another type only if Accept names it; a wildcard gets PNG.
    const std::string* accept = call.request.header("Accept");
    for (const char* type : {kExrType, report::kPictureType})
        if (accept && accept->find(type) != std::string::npos) wanted.type = type;
    if (const std::string* session = call.request.header("Preview-Session"))
        wanted.session = session->substr(0, kLongestSession);
    wanted.left = call.request.left;
    service.preview(call.user, call.request.body, wanted, image_to(respond));
}

}  // namespace

void add_tool_routes(std::vector<Route>& routes, Service& service) {
    routes.push_back(
        {.path = "/v1/browse",
         .operation = "browseFolder",
         .summary = "Folders, sequences, cameras, chains and studies in a folder",
         .handle = replies([&](const Call& call) {
             return reply_to(service.browse(call.user, call.query("folder")), as_json);
         }),
         .queries = {{"folder", "a folder of the roots; default: the root, or a list of them"}},
         .refusals = {403, 404},
         .schema = "Folder",
         .reads_files = true});
    routes.push_back({.path = "/v1/chains",
                      .operation = "listChains",
                      .summary = "The shipped chains, or one chain file",
                      .handle = replies([&](const Call& call) {
                          return reply_to(service.chains(call.user, call.query("file")), as_json);
                      }),
                      .queries = {{"file", "a chain file of the roots"}},
                      .refusals = {403, 404, 422},
                      .schema = "Chains",
                      .reads_files = true});
    routes.push_back({.path = "/v1/image",
                      .operation = "getInputFrame",
                      .summary = "A frame of an input, reduced",
                      .handle =
                          [&](const Call& call, const Respond& respond) {
                              const auto frame = number_of<int>(call.query("frame"));
                              if (!frame) return respond(problem(400, "frame is not given"));
                              service.input_image(call.user, call.query("input"), *frame,
                                                  image_wanted(call), image_to(respond));
                          },
                      .queries =
                          [] {
                              auto queries = image_queries();
                              queries.push_back({"input", "frames, as in a job"});
                              queries.push_back({"frame", "a frame number", {}, "-?[0-9]{1,9}"});
                              return queries;
                          }(),
                      .refusals = {403, 404, 422},
                      .type = "image/png",
                      .other_types = {report::kPictureType},
                      .reads_files = true});
    routes.push_back({.method = "POST",
                      .path = "/v1/plan",
                      .operation = "planFrames",
                      .summary = "Plans frames: steps, elided steps with reasons",
                      .handle = replies([&](const Call& call) {
                          return reply_to(service.plan(call.user, call.request.body), as_json);
                      }),
                      .body = "PlanRequest",
                      .refusals = {403, 422},
                      .reads_files = true});
    routes.push_back({.method = "POST",
                      .path = "/v1/preview",
                      .operation = "previewFrame",
                      .summary = "Filters one frame. A later preview with the same header "
                                 "Preview-Session ends an earlier one",
                      .handle = [&](const Call& call,
                                    const Respond& respond) { preview(service, call, respond); },
                      .body = "PreviewRequest",
                      .refusals = {403, 409, 422},
                      .type = "image/png",
                      .other_types = {kExrType, report::kPictureType},
                      .reads_files = true});
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
