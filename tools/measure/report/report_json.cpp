#include "tools/measure/report/report_json.h"

namespace postchain::report {
namespace {

// Null if it is empty.
Json word(const std::string& text) {
    return text.empty() ? Json(nullptr) : Json(text);
}

std::string word_from(const Json& json) {
    return json.is_null() ? std::string() : json.get<std::string>();
}

// The enumerator with this name_of(); the last one if there is none.
template <class E>
E enum_from(const Json& json, E last) {
    const std::string name = json;
    for (int i = 0; i < int(last); ++i)
        if (name == postchain::name_of(E(i))) return E(i);
    return last;
}

}  // namespace

// nlohmann-json finds these by their types.

static void to_json(Json& json, const TimeFigure& time) {
    json = {{"median_ms", time.median_ms}, {"spread_ms", time.spread_ms}, {"n", time.n}};
}

static void from_json(const Json& json, TimeFigure& time) {
    time = {json.at("median_ms"), json.at("spread_ms"), json.at("n")};
}

static void to_json(Json& json, const PassCost& cost) {
    json = cost.time;
    json["pass"] = cost.pass;
    json["left_out"] = cost.elided;
}

static void from_json(const Json& json, PassCost& cost) {
    cost = {json.at("pass"), json.at("left_out"), json.get<TimeFigure>()};
}

void to_json(Json& json, const Timing& timing) {
    json = {{"frame", timing.frame},
            {"source", timing.source},
            {"trustworthy", timing.trustworthy},
            {"why_not", word(timing.why_not)},
            {"total", timing.total},
            {"passes", timing.passes}};
}

void from_json(const Json& json, Timing& timing) {
    timing.frame = json.at("frame");
    timing.source = json.at("source");
    timing.trustworthy = json.at("trustworthy");
    timing.why_not = word_from(json.at("why_not"));
    timing.total = json.at("total").get<TimeFigure>();
    timing.passes = json.at("passes").get<std::vector<PassCost>>();
}

static void to_json(Json& json, const ErrorParts& parts) {
    json = {{"precision", parts.precision},
            {"sampling", parts.sampling},
            {"model", parts.model},
            {"total", parts.total}};
}

static void from_json(const Json& json, ErrorParts& parts) {
    json.at("precision").get_to(parts.precision);
    json.at("sampling").get_to(parts.sampling);
    json.at("model").get_to(parts.model);
    json.at("total").get_to(parts.total);
}

void to_json(Json& json, const ErrorSplit& split) {
    Json mse = split.mse;
    mse["cross"] = split.cross;
    json = {{"frames", split.frames},
            {"mse", mse},
            {"others", split.others},
            {"seeds", split.seeds},
            {"converged_noise_mse", split.converged_noise},
            {"convergence", split.convergence},
            {"notes", split.notes}};
}

void from_json(const Json& json, ErrorSplit& split) {
    json.at("frames").get_to(split.frames);
    json.at("mse").get_to(split.mse);
    json.at("mse").at("cross").get_to(split.cross);
    json.at("others").get_to(split.others);
    json.at("seeds").get_to(split.seeds);
    json.at("converged_noise_mse").get_to(split.converged_noise);
    json.at("convergence").get_to(split.convergence);
    json.at("notes").get_to(split.notes);
}

static void to_json(Json& json, const Series& series) {
    json = {{"mean", series.mean}, {"frames", series.frames}};
}

static void to_json(Json& json, const Variant& variant) {
    Json sweep = Json::object();
    for (const auto& [key, value] : variant.sweep) sweep[key] = value;
    Json left_out = Json::array();
    for (const auto& [frame, elision] : variant.elisions) {
        Json one = {{"frame", frame}};
        one.update(json_of(elision, item_text(elision, variant.passes)));
        left_out.push_back(std::move(one));
    }
    json = {{"name", variant.name},
            {"sweep", sweep},
            {"chain", variant.chain_text},
            {"chain_hash", hex_of(variant.chain_hash)},
            {"metrics", variant.metrics},
            {"timing", variant.timing},
            {"split", variant.split},
            {"left_out", left_out},
            {"failure", word(variant.failure)},
            {"pareto", variant.pareto},
            {"resumed", variant.resumed}};
}

static void to_json(Json& json, const ElisionRow& row) {
    json = {{"variant", row.variant},
            {"what", row.what},
            {"rule", row.rule},
            {"reasons", row.reasons},
            {"frames", row.frames},
            {"bytes", row.saving.bytes},
            {"dispatches", row.saving.dispatches},
            {"taps", row.saving.taps}};
}

void to_json(Json& json, const Interval& interval) {
    json = Json::array({interval.low, interval.high});
}

static void to_json(Json& json, const MetricComparison& metric) {
    json = {{"metric", metric.metric},
            {"n", metric.n},
            {"differences", metric.differences},
            {"mean", metric.mean},
            {"t_interval", metric.t_interval},
            {"bootstrap", metric.bootstrap},
            {"tiles", metric.tiles},
            {"finding", name_of(metric.finding)},
            {"words", metric.words}};
}

static void to_json(Json& json, const Comparison& comparison) {
    json = {{"metrics", comparison.metrics},
            {"bootstrap",
             {{"seed", comparison.bootstrap_seed},
              {"replicates", comparison.bootstrap_replicates},
              {"tile_px", comparison.bootstrap_tile_px}}},
            {"claims", word(comparison.claims)},
            {"verdict", comparison.verdict}};
}

static void to_json(Json& json, const Winner& winner) {
    json = {{"variant", winner.variant}, {"metric", winner.metric}, {"words", winner.words}};
}

static void to_json(Json& json, const StoredImage& image) {
    json = {{"kind", name_of(image.kind)},
            {"variant", image.variant < 0 ? Json(nullptr) : Json(image.variant)},
            {"frame", image.frame},
            {"map", word(image.map)},
            {"path", image.path},
            {"width", image.width},
            {"height", image.height},
            {"channels", image.channels}};
}

static void to_json(Json& json, const Crop& crop) {
    json = {{"frame", crop.frame}, {"x", crop.x},           {"y", crop.y},
            {"width", crop.width}, {"height", crop.height}, {"why", crop.why}};
}

static void to_json(Json& json, const Slice& slice) {
    json = {{"row", slice.row}, {"left", slice.left}, {"width", slice.width}};
}

static void to_json(Json& json, const MetricInfo& metric) {
    json = {{"name", metric.name}, {"help", metric.help}, {"better", name_of(metric.better)}};
}

Json report_json(const Report& report) {
    Json constants = Json::object();
    for (const auto& [name, value] : report.constants) constants[name] = value;
    const auto metrics_or_null = [](const Metrics& metrics) {
        return metrics.empty() ? Json(nullptr) : Json(metrics);
    };
    return {{"postchain_report", 1},
            {"kind", name_of(report.kind)},
            {"title", report.title},
            {"command", report.command},
            {"version", report.version},
            {"input", report.input},
            {"truth", report.truth},
            {"no_truth", word(report.no_truth)},
            {"reference", report.reference},
            {"frames", report.frames},
            {"scored_frames", report.scored_frames},
            {"width", report.width},
            {"height", report.height},
            {"page_frames", report.page_frames},
            {"metrics", report.metrics},
            {"constants", constants},
            {"hdr_flip",
             {{"tone_mapper", report.tone_mapper},
              {"start_ev", report.exposure_start},
              {"stop_ev", report.exposure_stop},
              {"exposures_ev", report.exposures}}},
            {"display_transform", report.display_transform},
            {"device",
             {{"renderer", report.renderer},
              {"software", report.software},
              {"threads", report.threads},
              {"precision", report.precision}}},
            {"seeds", report.seeds},
            {"variants", report.variants},
            {"input_metrics", metrics_or_null(report.input_metrics)},
            {"truth_noise", metrics_or_null(report.truth_noise)},
            {"left_out", elision_rows(report)},
            {"comparison", report.comparison},
            {"pareto_metric", word(report.pareto_metric)},
            {"winner", report.winner},
            {"under", report.under},
            {"images", report.images},
            {"crops", report.crops},
            {"slice", report.slice},
            {"warnings", report.warnings},
            {"notes", report.notes}};
}

Json json_of(const Elision& elision, const std::string& what) {
    Json json = io::json_from(elision_json(elision, what));
    for (const char* of_one_plan : {"work_list", "outside", "taps_per_block"})
        json.erase(of_one_plan);
    return json;
}

Elision elision_from(const Json& json) {
    Elision elision;
    elision.pass = json.at("pass").is_null() ? -1 : json.at("pass").get<int>();
    elision.kind = enum_from<ElisionKind>(json.at("kind"), ElisionKind::blocks);
    elision.item = json.at("item");
    elision.rule = json.at("rule");
    const Json& fact = json.at("fact");
    elision.fact.name = fact.at("name");
    fact.at("value").get_to(elision.fact.value);
    fact.at("limit").get_to(elision.fact.limit);
    elision.fact.unit = fact.at("unit");
    elision.fact.relation =
        enum_from<Fact::Relation>(fact.at("relation"), Fact::Relation::at_least);
    elision.saving = {json.at("bytes"), json.at("dispatches"), json.at("taps")};
    return elision;
}

}  // namespace postchain::report
