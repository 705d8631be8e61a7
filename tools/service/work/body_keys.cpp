#include "tools/service/work/body_keys.h"

#include "config/schema.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/study/settings.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/settings/job_settings.h"
#include "tools/service/store/job.h"

namespace postchain::service {
namespace {

using io::Json;

Json string_schema(const char* help) {
    return {{"description", help}, {"type", "string"}};
}

Json strings_schema(const char* help) {
    return {{"description", help}, {"type", "array"}, {"items", {{"type", "string"}}}};
}

Json string_or_object(const char* help) {
    return {{"description", help}, {"type", {"string", "object"}}};
}

void add_chain(const std::string& key, BodyKeys& keys) {
    keys.emplace_back(key, string_or_object("a shipped chain's name, a chain file, or a chain as "
                                            "an object"));
    keys.emplace_back(key + "_text",
                      string_schema(("the text of a chain file, in place of " + key).c_str()));
}

void add_rows(const ParameterTable& table, const std::string& group, BodyKeys& keys) {
    for (const Parameter& row : table.rows())
        if (row.group == group) keys.emplace_back(row.key, io::json_from(row_schema(row)));
}

Json schema_of(RequestKind kind, const std::vector<std::string>& required,
               const ParameterTable& run_table) {
    Json properties = Json::object();
    for (auto& [key, schema] : body_keys(kind, run_table)) properties[key] = std::move(schema);
    return {{"title", name_of(JobKind(kind))},
            {"type", "object"},
            {"additionalProperties", false},
            {"required", required},
            {"properties", properties}};
}

}  // namespace

BodyKeys body_keys(RequestKind kind, const ParameterTable& run_table) {
    BodyKeys keys;
    if (kind != RequestKind::plan && kind != RequestKind::preview) {
        keys.emplace_back("kind", Json{{"const", name_of(JobKind(kind))}});
        keys.emplace_back("priority", Json{{"type", "integer"},
                                           {"minimum", -kMaxPriority},
                                           {"maximum", kMaxPriority},
                                           {"default", 0}});
        keys.emplace_back(
            "frame_timeout",
            Json{{"description",
                  "seconds that reading, filtering or writing a frame may take; in place of "
                  "--frame-timeout of the service"},
                 {"type", "integer"},
                 {"minimum", 1},
                 {"maximum", kMaxFrameTimeoutS}});
    }
    if (kind == RequestKind::study) {
        keys.emplace_back("study", string_or_object("a study's file, or the study as an object "
                                                    "(docs/studies.md)"));
        add_rows(study::study_parameters(), "", keys);
        return keys;
    }
    add_chain("chain", keys);
    keys.emplace_back("set", strings_schema("KEY=VALUE, as --set"));
    add_rows(run_table, sequence::kInputGroup, keys);
    add_rows(run_table, sequence::kPlanGroup, keys);
    if (kind == RequestKind::run || kind == RequestKind::plan)
        add_rows(run_table, sequence::kLayerGroup, keys);
    if (kind == RequestKind::run) add_rows(run_table, sequence::kOutputGroup, keys);
    if (kind == RequestKind::ab) add_rows(experiment::ab_parameters(), "", keys);
    if (kind == RequestKind::bench) add_rows(experiment::bench_parameters(), "", keys);
    if (kind == RequestKind::ab || kind == RequestKind::bench)
        keys.emplace_back("fail_above", strings_schema("METRIC=NUMBER, as --fail-above"));
    if (kind == RequestKind::ab) add_chain("chain_b", keys);
    if (kind == RequestKind::bench) {
        keys.emplace_back("sweep", strings_schema("KEY=V1,V2,..., as --sweep"));
        keys.emplace_back("under", strings_schema("METRIC=NUMBER, as --under"));
    }
    if (kind == RequestKind::preview) {
        keys.emplace_back("frame", Json::object());
        keys.emplace_back("scale", Json::object());
        keys.emplace_back("plane", Json::object());
    }
    return keys;
}

io::Json job_schema(const ParameterTable& run_table) {
    return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"title", "a job of the postchain service"},
            {"oneOf",
             {schema_of(RequestKind::run, {"input", "output"}, run_table),
              schema_of(RequestKind::ab, {"kind", "input", "output"}, run_table),
              schema_of(RequestKind::bench, {"kind", "input", "output"}, run_table),
              schema_of(RequestKind::study, {"kind", "study", "output"}, run_table)}}};
}

}  // namespace postchain::service
