#include "tools/service/http/route.h"

#include <algorithm>
#include <optional>
#include <regex>
#include <set>

#include "tools/service/http/job_json.h"

namespace postchain::service {
namespace {

using io::Json;

// clang-format off
// "queries" names rows of the list at the end: "limit.jobs" is the query `limit`. "replies": a
// schema, or media types; "refuses": statuses besides those that any operation has. "is":
//   open     requires no user            audited  a line of the log for each request
//   at_once  needs no other thread       files    may wait for a disk: runs on Shared::disk_pool
//   streams  HEAD is not possible
constexpr const char* kInterface = R"json({
"operations": {
"POST /v1/jobs": {"id": "submitJob", "about": "Submits a job", "body": "JobRequest", "replies": "Job", "status": 202,
    "refuses": [403, 409, 422], "is": ["audited", "files"], "headers": {"Idempotency-Key":
        "the same key and body again return the same job; another body is refused"}},
"GET /v1/jobs": {"id": "listJobs", "about": "Jobs, newest first", "replies": "Jobs",
    "queries": ["state", "owner", "search", "before", "limit.jobs"]},
"GET /v1/jobs/{id}": {"id": "getJob", "about": "A job", "replies": "Job"},
"PATCH /v1/jobs/{id}": {"id": "changeJob", "about": "Changes the priority of an unfinished job", "body": "JobChange",
    "replies": "Job", "refuses": [403, 409, 422], "is": ["audited"]},
"DELETE /v1/jobs/{id}": {"id": "cancelJob", "about": "Cancels a job", "replies": "Job", "refuses": [403, 409],
    "is": ["audited"]},
"POST /v1/jobs/{id}/retry": {"id": "retryJob", "about": "Runs the unfinished frames of a failed or canceled job",
    "replies": "Job", "refuses": [403, 409], "is": ["audited", "files"]},
"DELETE /v1/jobs/{id}/record": {"id": "forgetJob", "about": "Removes an ended job from the store; its outputs stay",
    "replies": "Job", "refuses": [403, 409], "is": ["audited"]},
"GET /v1/jobs/{id}/frames": {"id": "listFrames", "about": "Frames of a job, in its order", "replies": "Frames",
    "queries": ["from", "limit.frames"]},
"GET /v1/jobs/{id}/frames/{n}": {"id": "getFrame", "about": "A frame of a job, with its sidecar",
    "replies": "FrameDetail", "is": ["files"]},
"GET /v1/jobs/{id}/events": {"id": "followJob", "about": "Events of a job until it ends; 204 after the last one",
    "replies": ["text/event-stream"], "queries": ["after"], "is": ["streams"],
    "headers": {"Last-Event-ID": "continues after this event"}},
"GET /v1/events": {"id": "followJobs", "about": "Events of all jobs", "replies": ["text/event-stream"],
    "queries": ["after"], "is": ["streams"], "headers": {"Last-Event-ID": "continues after this event"}},
"GET /v1/jobs/{id}/frames/{n}/before.png": {"id": "getThumbnailBefore", "about": "An input frame, reduced",
    "replies": ["image/png", "image/vnd.postchain"], "queries": ["type", "side"], "refuses": [403, 422], "is": ["files"]},
"GET /v1/jobs/{id}/frames/{n}/after.png": {"id": "getThumbnailAfter", "about": "A filtered frame, reduced",
    "replies": ["image/png", "image/vnd.postchain"], "queries": ["type", "side"], "refuses": [403, 422], "is": ["files"]},
"GET /v1/jobs/{id}/thumbnail.png": {"id": "getJobThumbnail",
    "about": "The last finished frame of a job, otherwise its first input frame",
    "replies": ["image/png", "image/vnd.postchain"], "queries": ["type", "side"], "refuses": [403, 422], "is": ["files"]},
"GET /v1/jobs/{id}/frames/{n}/output": {"id": "getOutput", "about": "The output of a finished frame",
    "replies": ["image/*"], "refuses": [403], "is": ["files"]},
"GET /v1/jobs/{id}/report/{name...}": {"id": "getReport", "about": "A file of the report of an ab, bench or study job",
    "replies": ["*/*"], "queries": ["pictures", "picture"], "refuses": [422], "is": ["files"]},
"GET /v1/browse": {"id": "browseFolder", "about": "Folders, sequences, cameras, chains and studies in a folder",
    "replies": "Folder", "queries": ["folder"], "refuses": [403, 404], "is": ["files"]},
"GET /v1/chains": {"id": "listChains", "about": "The shipped chains, or one chain file", "replies": "Chains",
    "queries": ["file"], "refuses": [403, 404, 422], "is": ["files"]},
"GET /v1/image": {"id": "getInputFrame", "about": "A frame of an input, reduced",
    "replies": ["image/png", "image/vnd.postchain"], "queries": ["type", "side", "input", "frame"],
    "refuses": [403, 404, 422], "is": ["files"]},
"POST /v1/plan": {"id": "planFrames", "about": "Plans frames: steps, elided steps with reasons", "body": "PlanRequest",
    "refuses": [403, 422], "is": ["files"]},
"POST /v1/preview": {"id": "previewFrame", "body": "PreviewRequest",
    "about": "Filters one frame. A later preview with the same header Preview-Session ends an earlier one",
    "replies": ["image/png", "image/x-exr", "image/vnd.postchain"], "refuses": [403, 409, 422], "is": ["files"],
    "headers": {"Preview-Session": "a later preview of the session ends this one"}},
"POST /v1/chain/check": {"id": "checkChain", "about": "Checks the text of a chain file", "body": "ChainText",
    "replies": "CheckedChain", "refuses": [422]},
"GET /v1/user": {"id": "getUser", "about": "Whose requests these are", "is": ["at_once"]},
"GET /v1/passes": {"id": "listPasses", "about": "Passes and parameters"},
"GET /v1/schema": {"id": "getChainSchema", "about": "JSON Schema of a chain file"},
"GET /v1/schema/job": {"id": "getJobSchema", "about": "JSON Schema of a job"},
"GET /openapi.json": {"id": "getOpenApi", "about": "This interface as OpenAPI"},
"GET /healthz": {"id": "getHealth", "about": "200 while the process runs", "is": ["open", "at_once"]},
"GET /readyz": {"id": "getReadiness", "is": ["open", "at_once"],
    "about": "200 if the service accepts jobs and they make progress, otherwise 503"},
"GET /metrics": {"id": "getMetrics", "about": "Prometheus text format", "replies": ["text/plain"]},
"GET /": {"id": "getPage", "about": "The page", "replies": ["text/html"], "is": ["open", "at_once"]},
"GET /page/style.css": {"id": "getPageStyle", "about": "Its style", "replies": ["text/css"], "is": ["open", "at_once"]},
"GET /page/icon.svg": {"id": "getPageIcon", "about": "Its icon", "replies": ["image/svg+xml"],
    "is": ["open", "at_once"]},
"GET /page/main.js": {"id": "getPageScript", "about": "Its script", "replies": ["text/javascript"],
    "is": ["open", "at_once"]}
},
"queries": {
"state": {"description": "only jobs in this state", "enum": ["queued", "running", "done", "failed", "canceled"]},
"owner": {"description": "only jobs of this user"},
"search": {"description":
    "words that all occur in a job's id, kind, state, owner, message, input, output, camera, chains or study; case does not matter"},
"before": {"description": "a job's id: only older jobs", "pattern": "^[1-9][0-9]{0,18}$"},
"limit.jobs": {"description": "maximum number of jobs", "type": "integer", "minimum": 1, "maximum": 500, "default": 50},
"from": {"description": "how many frames to leave out before", "type": "integer", "minimum": 0, "maximum": 999999999,
    "default": 0},
"limit.frames": {"description": "maximum number of frames", "type": "integer", "minimum": 1, "maximum": 5000,
    "default": 1000},
"after": {"description": "an event's id, instead of the header Last-Event-ID"},
"type": {"description": "png: 8 bits; values: half floats for a page", "enum": ["png", "values"], "default": "png"},
"side": {"description": "largest width and height", "type": "integer", "minimum": 1, "maximum": 4096, "default": 320},
"pictures": {"description": "apart: a page without its pictures", "enum": ["apart"]},
"picture": {"description": "the text of one picture of a page, by its id", "pattern": "^image-[0-9]{1,9}$"},
"folder": {"description": "a folder of the roots; default: the root, or a list of them"},
"file": {"description": "a chain file of the roots"},
"input": {"description": "frames, as in a job", "required": true},
"frame": {"description": "a frame number", "pattern": "^-?[0-9]{1,9}$", "required": true}
},
"schemas": {
"JobChange": {"type": "object", "properties": {"priority": {"type": "integer", "minimum": -100, "maximum": 100}},
    "required": ["priority"], "additionalProperties": false},
"PlanRequest": {"type": "object",
    "description": "chain or chain_text, set, and every key of a job's input and plan"},
"PreviewRequest": {"type": "object",
    "description": "chain or chain_text, set, every key of a job's input and plan, and these",
    "properties": {"frame": {"type": "integer", "description": "frame number"},
        "scale": {"type": "number", "minimum": 0.05, "maximum": 1, "description": "scale of width and height"}}},
"ChainText": {"type": "object", "properties": {"text": {"type": "string", "description": "text of a chain file"}},
    "required": ["text"]},
"Folder": {"type": "object", "properties": {
        "folder": {"type": "string", "description": "this folder"},
        "parent": {"type": ["string", "null"], "description": "value of `folder` for the one above"},
        "folders": {"type": "array", "items": {"type": "object", "properties": {
                "name": {"type": "string", "description": "without folders"},
                "path": {"type": "string", "description": "its path"}},
            "required": ["name", "path"]}},
        "sequences": {"type": "array", "items": {"type": "object", "properties": {
                "name": {"type": "string", "description": "without folders"},
                "path": {"type": "string", "description": "as `input` of a job"},
                "frames": {"type": "string", "description": "on disk, such as 1-24"},
                "count": {"type": "integer", "description": "number of frames"}},
            "required": ["name", "path", "frames", "count"]}},
        "cameras": {"type": "array", "items": {"type": "string"}, "description": "camera files"},
        "chains": {"type": "array", "items": {"type": "string"}, "description": "chain files"},
        "studies": {"type": "array", "items": {"type": "string"}, "description": "study files"}},
    "required": ["folder", "parent", "folders", "sequences", "cameras", "chains", "studies"]},
"Chains": {"type": "object", "properties": {"chains": {"type": "array", "items": {"type": "object", "properties": {
            "name": {"type": "string", "description": "a shipped name, or the file"},
            "text": {"type": "string", "description": "of the chain file"}},
        "required": ["name", "text"]}}}, "required": ["chains"]},
"Jobs": {"type": "object", "properties": {
        "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/ListedJob"}},
        "next": {"type": ["string", "null"], "description": "value of `before` for the next jobs"}},
    "required": ["jobs"]},
"Frames": {"type": "object", "properties": {
        "frames": {"type": "array", "items": {"$ref": "#/components/schemas/Frame"}},
        "next": {"type": ["integer", "null"], "description": "value of `from` for the next frames"}},
    "required": ["frames"]},
"CheckedChain": {"type": "object", "properties": {
        "diagnostics": {"type": "array", "items": {"$ref": "#/components/schemas/Diagnostic"}}},
    "required": ["diagnostics"]},
"Problem": {"type": "object", "properties": {
        "type": {"type": "string", "description": "about:blank"},
        "title": {"type": "string", "description": "name of the status"},
        "status": {"type": "integer", "description": "status of the reply"},
        "detail": {"type": "string", "description": "the fault and its remedy"},
        "request_id": {"type": "string", "description": "X-Request-Id of the reply, as in the log"},
        "errors": {"type": "array", "items": {"$ref": "#/components/schemas/Diagnostic"}}},
    "required": ["type", "title", "status"]}
}
})json";
// clang-format on

// {"operations", "queries", "schemas"}: the schemas that no table of fields has.
const Json& service_interface() {
    static const Json interface = *io::read_json(kInterface, "interface");
    return interface;
}

std::optional<std::vector<std::string>> match(const std::string& path,
                                              const std::vector<std::string>& given) {
    const auto wanted = parts_of(std::string_view(path).substr(1), '/');
    std::vector<std::string> values;
    for (size_t i = 0; i < wanted.size(); ++i) {
        if (i >= given.size()) return std::nullopt;
        const std::string& word = wanted[i];
        if (word.ends_with("...}")) {
            const std::vector<std::string> rest(given.begin() + ptrdiff_t(i), given.end());
            if (std::ranges::count(rest, "") > 0) return std::nullopt;
            values.push_back(joined(rest, "/"));
            return values;
        }
        if (word.starts_with("{")) {
            if (given[i].empty() || (word == "{n}" && !number_of<int>(given[i])))
                return std::nullopt;
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

// ------------------------------------------------------------------------------------ the document
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

std::variant<Match, Reply> find_route(const std::vector<Route>& routes, const std::string& method,
                                      const Target& target) {
    std::vector<std::string> allowed;
    for (const Route& route : routes) {
        auto values = match(route.path, target.segments);
        if (!values) continue;
        if (takes(route, method)) return Match{&route, std::move(*values)};
        allowed.push_back(route.method);
        if (takes(route, "HEAD")) allowed.push_back("HEAD");
    }
    if (allowed.empty()) return problem(404, "unknown address");
    Reply reply = problem(405, "this address allows " + joined(allowed));
    reply.headers.emplace_back("Allow", joined(allowed));
    return reply;
}

std::optional<Reply> refuse_queries(const Route& route, const Target& target) {
    for (const auto& [key, value] : target.query)
        if (const std::string fault = fault_of(route, key, value); !fault.empty())
            return problem(400, fault);
    for (const auto& [name, schema] : route.queries.items())
        if (schema.contains("required") && !target.query.contains(name))
            return problem(400, name + " is not given");
    return std::nullopt;
}

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
