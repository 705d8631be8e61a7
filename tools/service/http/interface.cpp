// "queries" names rows of the list at the end: "limit.jobs" is the query `limit`. "replies": a
// schema, or media types; "refuses": statuses besides those that any operation has. "is":
//   open     requires no user            audited  a line of the log for each request
//   at_once  needs no other thread       files    may wait for a disk: runs on Shared::disk_pool
//   streams  HEAD is not possible
#include "tools/service/http/interface.h"

namespace postchain::service {
namespace {

// clang-format off
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
        "scale": {"type": "number", "minimum": 0.05, "maximum": 1, "description": "scale of width and height"},
        "plane": {"enum": ["color", "depth"],
            "description": "depth: the distances of the surfaces, not filtered"}}},
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
            "text": {"type": "string", "description": "of the chain file"},
            "chain": {"description": "its values as JSON"}},
        "required": ["name", "text", "chain"]}}}, "required": ["chains"]},
"Jobs": {"type": "object", "properties": {
        "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/ListedJob"}},
        "next": {"type": ["string", "null"], "description": "value of `before` for the next jobs"}},
    "required": ["jobs"]},
"Frames": {"type": "object", "properties": {
        "frames": {"type": "array", "items": {"$ref": "#/components/schemas/Frame"}},
        "next": {"type": ["integer", "null"], "description": "value of `from` for the next frames"}},
    "required": ["frames"]},
"CheckedChain": {"type": "object", "properties": {
        "diagnostics": {"type": "array", "items": {"$ref": "#/components/schemas/Diagnostic"}},
        "chain": {"type": ["object", "null"],
            "description": "values of the text; null if it is not an object with a list of passes"}},
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

}  // namespace

const io::Json& service_interface() {
    static const io::Json interface = *io::read_json(kInterface, "interface.cpp");
    return interface;
}

}  // namespace postchain::service
