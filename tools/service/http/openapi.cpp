#include "tools/service/http/openapi.h"

#include <set>

#include "tools/service/http/job_json.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

using io::Json;

Json ref(const std::string& schema) {
    return {{"$ref", "#/components/schemas/" + schema}};
}

Json list_of(const std::string& name, const std::string& schema) {
    return {{"type", "object"},
            {"properties", {{name, {{"type", "array"}, {"items", ref(schema)}}}}},
            {"required", {name}}};
}

Json text(const char* description) {
    return {{"type", "string"}, {"description", description}};
}

Json integer(const char* description) {
    return {{"type", "integer"}, {"description", description}};
}

Json schemas(Json job) {
    job.erase("$schema");  // for documents of their own
    Json jobs = list_of("jobs", "ListedJob");
    jobs["properties"]["next"] = {{"type", {"string", "null"}},
                                  {"description", "value of `before` for the next jobs"}};
    Json frames = list_of("frames", "Frame");
    frames["properties"]["next"] = {{"type", {"integer", "null"}},
                                    {"description", "value of `from` for the next frames"}};
    const Json problem = {{"type", "object"},
                          {"properties",
                           {{"type", text("about:blank")},
                            {"title", text("name of the status")},
                            {"status", integer("status of the reply")},
                            {"detail", text("the fault and its remedy")},
                            {"request_id", text("X-Request-Id of the reply, as in the log")},
                            {"errors", {{"type", "array"}, {"items", ref("Diagnostic")}}}}},
                          {"required", {"type", "title", "status"}}};
    const Json plan = {
        {"type", "object"},
        {"description", "chain or chain_text, set, and every key of a job's input and plan"}};
    const Json preview = {
        {"type", "object"},
        {"description", "chain or chain_text, set, every key of a job's input and plan, and these"},
        {"properties",
         {{"frame", integer("frame number")},
          {"scale",
           {{"type", "number"},
            {"minimum", kMinPreviewScale},
            {"maximum", 1},
            {"description", "scale of width and height"}}},
          {"plane",
           {{"enum", {"color", "depth"}},
            {"description", "depth: the distances of the surfaces, not filtered"}}}}}};
    const auto strings = [](const char* description) {
        return Json{
            {"type", "array"}, {"items", {{"type", "string"}}}, {"description", description}};
    };
    const auto named = [](std::initializer_list<std::pair<const char*, Json>> values) {
        Json properties = Json::object(), required = Json::array();
        for (const auto& [name, schema] : values) {
            properties[name] = schema;
            required.push_back(name);
        }
        return Json{{"type", "object"}, {"properties", properties}, {"required", required}};
    };
    const auto items = [](const Json& item) { return Json{{"type", "array"}, {"items", item}}; };
    const Json folder = named(
        {{"folder", text("this folder")},
         {"parent",
          {{"type", {"string", "null"}}, {"description", "value of `folder` for the one above"}}},
         {"folders", items(named({{"name", text("without folders")}, {"path", text("its path")}}))},
         {"sequences", items(named({{"name", text("without folders")},
                                    {"path", text("as `input` of a job")},
                                    {"frames", text("on disk, such as 1-24")},
                                    {"count", integer("number of frames")}}))},
         {"cameras", strings("camera files")},
         {"chains", strings("chain files")},
         {"studies", strings("study files")}});
    const Json chain = named({{"name", text("a shipped name, or the file")},
                              {"text", text("of the chain file")},
                              {"chain", {{"description", "its values as JSON"}}}});
    const Json change = {
        {"type", "object"},
        {"properties",
         {{"priority",
           {{"type", "integer"}, {"minimum", -kMaxPriority}, {"maximum", kMaxPriority}}}}},
        {"required", {"priority"}},
        {"additionalProperties", false}};
    Json checked = list_of("diagnostics", "Diagnostic");
    checked["properties"]["chain"] = {
        {"type", {"object", "null"}},
        {"description", "values of the text; null if it is not an object with a list of passes"}};
    const Json chain_text = {{"type", "object"},
                             {"properties", {{"text", text("text of a chain file")}}},
                             {"required", {"text"}}};
    return {{"JobRequest", job},
            {"JobChange", change},
            {"PlanRequest", plan},
            {"PreviewRequest", preview},
            {"ChainText", chain_text},
            {"Folder", folder},
            {"Chains", named({{"chains", items(chain)}})},
            {"Job", schema_of(job_fields())},
            {"ListedJob", schema_of(listed_job_fields())},
            {"Jobs", jobs},
            {"Frame", schema_of(frame_fields())},
            {"Frames", frames},
            {"FrameDetail", schema_of(frame_detail_fields())},
            {"Diagnostic", schema_of(diagnostic_fields())},
            {"CheckedChain", checked},
            {"Problem", problem}};
}

Json parameters_of(const Route& route) {
    Json parameters = Json::array();
    for (size_t at = route.path.find('{'); at != std::string::npos;
         at = route.path.find('{', at + 1)) {
        std::string name = route.path.substr(at + 1, route.path.find('}', at) - at - 1);
        const bool number = name == "n";
        if (name.ends_with("...")) name.resize(name.size() - 3);
        parameters.push_back({{"name", name},
                              {"in", "path"},
                              {"required", true},
                              {"schema", {{"type", number ? "integer" : "string"}}}});
    }
    for (const auto& query : route.queries) {
        Json schema = {{"type", "string"}};
        if (!query.words.empty()) schema["enum"] = query.words;
        if (!query.pattern.empty()) schema["pattern"] = "^" + query.pattern + "$";
        if (const auto& range = query.integer)
            schema = {{"type", "integer"}, {"minimum", range->least}, {"maximum", range->most}};
        parameters.push_back({{"name", query.name},
                              {"in", "query"},
                              {"required", query.required},
                              {"description", query.description},
                              {"schema", schema}});
    }
    const auto header = [&](const char* name, const char* description) {
        parameters.push_back({{"name", name},
                              {"in", "header"},
                              {"description", description},
                              {"schema", {{"type", "string"}, {"maxLength", 255}}}});
    };
    if (route.operation == "submitJob")
        header("Idempotency-Key",
               "the same key and body again return the same job; another body is refused");
    if (route.operation == "previewFrame")
        header("Preview-Session", "a later preview of the session ends this one");
    if (route.streams) header("Last-Event-ID", "continues after this event");
    return parameters;
}

// Statuses of problems: those of any route, and the route's own.
std::set<int> refusals_of(const Route& route) {
    std::set<int> statuses = {400, 403, 413, 421, 429, 431, 500, 501, 503};
    if (!route.open) statuses.insert(401);
    if (route.path.find('{') != std::string::npos) statuses.insert(404);
    if (!route.body.empty()) statuses.insert({408, 415});
    statuses.insert(route.refusals.begin(), route.refusals.end());
    return statuses;
}

Json operation_of(const Route& route) {
    Json operation = {{"operationId", route.operation}, {"summary", route.summary}};
    if (Json parameters = parameters_of(route); !parameters.empty())
        operation["parameters"] = parameters;
    if (!route.body.empty())
        operation["requestBody"] = {
            {"required", true}, {"content", {{"application/json", {{"schema", ref(route.body)}}}}}};
    Json success = {{"description", route.status == 204 ? "Done" : "Success"}};
    if (route.status != 204)
        success["content"] = {{route.type, route.schema.empty()
                                               ? Json::object()
                                               : Json{{"schema", ref(route.schema)}}}};
    for (const std::string& type : route.other_types) success["content"][type] = Json::object();
    const Json retry_after = {
        {"Retry-After", {{"description", "seconds"}, {"schema", {{"type", "integer"}}}}}};
    Json& responses = operation["responses"] = {{std::to_string(route.status), success}};
    if (route.operation == "submitJob") {
        responses["202"]["headers"]["Location"] = {
            {"description", "the job, relative to this address"}, {"schema", {{"type", "string"}}}};
        responses["200"] = responses["202"];
        responses["200"]["description"] = "The job that already has this Idempotency-Key";
    }
    if (route.operation == "followJob")
        responses["204"] = {{"description", "The job has ended, and has no later event"}};
    if (route.operation == "getReadiness") {
        responses["503"] = success;
        responses["503"]["description"] = "Not ready";
        responses["503"]["headers"] = retry_after;
    }
    for (const int status : refusals_of(route)) {
        Json refusal = {{"description", reason_of(status)},
                        {"content", {{"application/problem+json", {{"schema", ref("Problem")}}}}}};
        if (status == 429 || status == 503) refusal["headers"] = retry_after;
        responses.emplace(std::to_string(status), std::move(refusal));
    }
    if (route.open) operation["security"] = Json::array();
    return operation;
}

}  // namespace

std::string openapi_of(const std::vector<Route>& routes, Json job_schema,
                       const std::string& version, bool asks_for_token) {
    Json paths = Json::object();
    for (const Route& route : routes) {
        std::string path = route.path, method = route.method;
        if (const size_t dots = path.find("...}"); dots != std::string::npos) path.erase(dots, 3);
        for (char& c : method) c = char(c - 'A' + 'a');
        paths[path][method] = operation_of(route);
    }
    Json document = {
        {"openapi", "3.1.0"},
        {"info", {{"title", "postchain"}, {"version", version}}},
        {"paths", paths},
        {"components",
         {{"schemas", schemas(std::move(job_schema))},
          {"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}}}};
    if (asks_for_token) document["security"] = Json::array({{{"token", Json::array()}}});
    return io::json_text(document, 2);
}

}  // namespace postchain::service
