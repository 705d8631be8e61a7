#include "tools/service/http/openapi.h"

#include <set>

#include "tools/service/http/interface.h"
#include "tools/service/http/job_json.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {
namespace {

using io::Json;

Json reference_to(const std::string& schema) {
    return {{"$ref", "#/components/schemas/" + schema}};
}

Json schemas(Json job) {
    job.erase("$schema");  // for documents of their own
    Json all = service_interface()["schemas"];
    all["JobRequest"] = std::move(job);
    all["Job"] = schema_of(job_fields());
    all["ListedJob"] = schema_of(listed_job_fields());
    all["Frame"] = schema_of(frame_fields());
    all["FrameDetail"] = schema_of(frame_detail_fields());
    all["Diagnostic"] = schema_of(diagnostic_fields());
    return all;
}

Json parameters_of(const Route& route) {
    Json parameters = Json::array();
    for (size_t at = route.path.find('{'); at != std::string::npos;
         at = route.path.find('{', at + 1)) {
        std::string name = route.path.substr(at + 1, route.path.find('}', at) - at - 1);
        const char* type = name == "n" ? "integer" : "string";
        if (name.ends_with("...")) name.resize(name.size() - 3);
        parameters.push_back(
            {{"name", name}, {"in", "path"}, {"required", true}, {"schema", {{"type", type}}}});
    }
    for (const auto& [name, row] : route.queries.items()) {
        Json schema = row;
        if (!schema.contains("type")) schema["type"] = "string";
        for (const char* key : {"description", "required"}) schema.erase(key);
        parameters.push_back({{"name", name},
                              {"in", "query"},
                              {"required", row.contains("required")},
                              {"description", row["description"]},
                              {"schema", schema}});
    }
    const Json headers = route.about.value("headers", Json::object());
    for (const auto& [name, description] : headers.items())
        parameters.push_back({{"name", name},
                              {"in", "header"},
                              {"description", description},
                              {"schema", {{"type", "string"}, {"maxLength", 255}}}});
    return parameters;
}

// Statuses of problems: those of any route, and the route's own.
std::set<int> refusals_of(const Route& route) {
    std::set<int> statuses = {400, 403, 413, 421, 429, 431, 500, 501, 503};
    if (!route.is("open")) statuses.insert(401);
    if (route.path.find('{') != std::string::npos) statuses.insert(404);
    if (route.has_body()) statuses.insert({408, 415});
    for (const int status : route.about.value("refuses", Json::array())) statuses.insert(status);
    return statuses;
}

Json operation_of(const Route& route) {
    const std::string id = route.operation();
    Json operation = {{"operationId", id}, {"summary", route.about["about"]}};
    if (Json parameters = parameters_of(route); !parameters.empty())
        operation["parameters"] = parameters;
    if (route.has_body())
        operation["requestBody"] = {
            {"required", true},
            {"content",
             {{"application/json",
               {{"schema", reference_to(route.about["body"].get<std::string>())}}}}}};
    Json success = {{"description", "Success"}};
    const Json replies = route.about.value("replies", Json::array({"application/json"}));
    if (replies.is_string())
        success["content"]["application/json"]["schema"] = reference_to(replies.get<std::string>());
    else
        for (const std::string type : replies) success["content"][type] = Json::object();
    const Json retry_after = {
        {"Retry-After", {{"description", "seconds"}, {"schema", {{"type", "integer"}}}}}};
    Json& responses =
        operation["responses"] = {{std::to_string(route.about.value("status", 200)), success}};
    if (id == "submitJob") {
        responses["202"]["headers"]["Location"] = {
            {"description", "the job, relative to this address"}, {"schema", {{"type", "string"}}}};
        responses["200"] = responses["202"];
        responses["200"]["description"] = "The job that already has this Idempotency-Key";
    }
    if (id == "followJob")
        responses["204"] = {{"description", "The job has ended, and has no later event"}};
    if (id == "getReadiness") {
        responses["503"] = success;
        responses["503"]["description"] = "Not ready";
        responses["503"]["headers"] = retry_after;
    }
    for (const int status : refusals_of(route)) {
        Json refusal = {
            {"description", reason_of(status)},
            {"content", {{"application/problem+json", {{"schema", reference_to("Problem")}}}}}};
        if (status == 429 || status == 503) refusal["headers"] = retry_after;
        responses.emplace(std::to_string(status), std::move(refusal));
    }
    if (route.is("open")) operation["security"] = Json::array();
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
