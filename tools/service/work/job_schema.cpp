#include "tools/service/work/job_schema.h"

#include "chain/json_writer.h"
#include "config/schema.h"

namespace postchain::service {

std::string job_schema_text(const JobReader& reader) {
    JsonWriter json(true);
    const auto texts = [&](const char* key, const char* help) {
        json.key(key).begin_object();
        json.field("description", help).field("type", "array");
        json.key("items").begin_object();
        json.field("type", "string");
        json.end_object();
        json.end_object();
    };
    const auto text = [&](const char* key, const char* help) {
        json.key(key).begin_object();
        json.field("description", help).field("type", "string");
        json.end_object();
    };
    const auto chain = [&](const char* key) {
        json.key(key).begin_object();
        json.field("description", "a shipped chain's name, a chain file, or a chain as an object");
        json.key("type").value(std::vector<std::string>{"string", "object"});
        json.end_object();
    };
    const auto rows = [&](const ParameterTable& table, const std::string& group) {
        for (const Parameter& row : table.rows())
            if (row.group == group) {
                json.key(row.key);
                write_row_schema(json, row);
            }
    };
    const auto common = [&](const char* name) {
        json.key("kind").begin_object();
        json.field("const", name);
        json.end_object();
        json.key("priority").begin_object();
        json.field("type", "integer").field("minimum", -100).field("maximum", 100);
        json.field("default", 0);
        json.end_object();
    };
    const auto study = [&] {
        json.begin_object();
        json.field("title", "study").field("type", "object");
        json.field("additionalProperties", false);
        json.key("required").value(std::vector<std::string>{"kind", "study", "output"});
        json.key("properties").begin_object();
        common("study");
        json.key("study").begin_object();
        json.field("description", "a study's file, or the study as an object (docs/studies.md)");
        json.key("type").value(std::vector<std::string>{"string", "object"});
        json.end_object();
        rows(study::study_parameters(), "");
        json.end_object();
        json.end_object();
    };
    const auto kind = [&](const char* name, const ParameterTable* own) {
        json.begin_object();
        json.field("title", name).field("type", "object");
        json.field("additionalProperties", false);
        json.key("required")
            .value(own ? std::vector<std::string>{"kind", "input", "output"}
                       : std::vector<std::string>{"input", "output"});
        json.key("properties").begin_object();
        common(name);
        chain("chain");
        text("chain_text", "the text of a chain file, in place of chain");
        texts("set", "KEY=VALUE, as --set");
        rows(reader.run_table(), sequence::kInputGroup);
        rows(reader.run_table(), sequence::kPlanGroup);
        if (!own) rows(reader.run_table(), sequence::kLayerGroup);
        if (!own) rows(reader.run_table(), sequence::kOutputGroup);
        if (own) {
            rows(*own, "");
            texts("fail_above", "METRIC=NUMBER, as --fail-above");
        }
        if (own == &experiment::ab_parameters()) {
            chain("chain_b");
            text("chain_b_text", "the text of a chain file, in place of chain_b");
        }
        if (own == &experiment::bench_parameters()) {
            texts("sweep", "KEY=V1,V2,..., as --sweep");
            texts("under", "METRIC=NUMBER, as --under");
        }
        json.end_object();
        json.end_object();
    };
    json.begin_object();
    json.field("$schema", "https://json-schema.org/draft/2020-12/schema");
    json.field("title", "a job of the postchain service");
    json.key("oneOf").begin_array();
    kind("run", nullptr);
    kind("ab", &experiment::ab_parameters());
    kind("bench", &experiment::bench_parameters());
    study();
    json.end_array();
    json.end_object();
    return json.text();
}

}  // namespace postchain::service
