#include "tools/measure/report/report_json.h"

#include "tools/measure/report/json_parts.h"
#include "tools/measure/report/lists.h"

namespace postchain::report {
namespace {

Json metrics_json(const Metrics& metrics) {
    Json json = Json::object();
    for (const auto& [name, series] : metrics)
        json[name] = {{"mean", json_of(series.mean)}, {"frames", json_of(series.frames)}};
    return json;
}

Json metrics_or_null(const Metrics& metrics) {
    return metrics.empty() ? Json(nullptr) : metrics_json(metrics);
}

Json word(const std::string& text) {
    return text.empty() ? Json(nullptr) : Json(text);
}

Json variant(const Variant& variant) {
    Json sweep = Json::object();
    for (const auto& [key, value] : variant.sweep) sweep[key] = value;
    Json left_out = Json::array();
    for (const auto& [frame, elision] : variant.elisions) {
        Json one = {{"frame", frame}};
        one.update(json_of(elision, item_text(elision, variant.passes)));
        left_out.push_back(std::move(one));
    }
    return {{"name", variant.name},
            {"sweep", sweep},
            {"chain", variant.chain_text},
            {"chain_hash", hex_of(variant.chain_hash)},
            {"metrics", metrics_json(variant.metrics)},
            {"timing", variant.timing ? json_of(*variant.timing) : Json(nullptr)},
            {"split", variant.split ? json_of(*variant.split) : Json(nullptr)},
            {"left_out", left_out},
            {"failure", word(variant.failure)},
            {"pareto", variant.pareto},
            {"resumed", variant.resumed}};
}

Json elision_row(const ElisionRow& row) {
    return {{"variant", row.variant},
            {"what", row.what},
            {"rule", row.rule},
            {"reasons", row.reasons},
            {"frames", row.frames},
            {"bytes", row.saving.bytes},
            {"dispatches", row.saving.dispatches},
            {"taps", row.saving.taps}};
}

Json interval(const std::optional<Interval>& interval) {
    if (!interval) return nullptr;
    return {interval->low, interval->high};
}

Json comparison(const Comparison& comparison) {
    Json metrics = Json::array();
    for (const MetricComparison& metric : comparison.metrics)
        metrics.push_back({{"metric", metric.metric},
                           {"n", metric.n},
                           {"differences", json_of(metric.differences)},
                           {"mean", json_of(metric.mean)},
                           {"t_interval", interval(metric.t_interval)},
                           {"bootstrap", interval(metric.bootstrap)},
                           {"tiles", metric.tiles},
                           {"finding", name_of(metric.finding)},
                           {"words", metric.words}});
    return {{"metrics", metrics},
            {"bootstrap",
             {{"seed", comparison.bootstrap_seed},
              {"replicates", comparison.bootstrap_replicates},
              {"tile_px", comparison.bootstrap_tile_px}}},
            {"claims", word(comparison.claims)},
            {"verdict", comparison.verdict}};
}

Json winner(const std::optional<Winner>& winner) {
    if (!winner) return nullptr;
    return {{"variant", winner->variant}, {"metric", winner->metric}, {"words", winner->words}};
}

Json image(const StoredImage& image) {
    return {{"kind", name_of(image.kind)},
            {"variant", image.variant < 0 ? Json(nullptr) : Json(image.variant)},
            {"frame", image.frame},
            {"map", word(image.map)},
            {"path", image.path},
            {"width", image.width},
            {"height", image.height},
            {"channels", image.channels}};
}

}  // namespace

io::Json report_json(const Report& report) {
    Json metrics = Json::array();
    for (const MetricInfo& metric : report.metrics)
        metrics.push_back(
            {{"name", metric.name}, {"help", metric.help}, {"better", name_of(metric.better)}});
    Json constants = Json::object();
    for (const auto& [name, value] : report.constants) constants[name] = value;
    Json variants = Json::array(), images = Json::array(), crops = Json::array();
    Json left_out = Json::array();
    for (const ElisionRow& row : elision_rows(report)) left_out.push_back(elision_row(row));
    for (const Variant& one : report.variants) variants.push_back(variant(one));
    for (const StoredImage& one : report.images) images.push_back(image(one));
    for (const Crop& crop : report.crops)
        crops.push_back({{"frame", crop.frame},
                         {"x", crop.x},
                         {"y", crop.y},
                         {"width", crop.width},
                         {"height", crop.height},
                         {"why", crop.why}});
    const Json json = {
        {"postchain_report", 1},
        {"kind", name_of(report.kind)},
        {"title", report.title},
        {"command", report.command},
        {"version", report.version},
        {"input", report.input},
        {"truth", report.truth ? Json(*report.truth) : Json(nullptr)},
        {"no_truth", word(report.no_truth)},
        {"reference", report.reference},
        {"frames", report.frames},
        {"scored_frames", report.scored_frames},
        {"width", report.width},
        {"height", report.height},
        {"page_frames", report.page_frames},
        {"metrics", metrics},
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
        {"variants", variants},
        {"input_metrics", metrics_or_null(report.input_metrics)},
        {"truth_noise", metrics_or_null(report.truth_noise)},
        {"left_out", left_out},
        {"comparison", report.comparison ? comparison(*report.comparison) : Json(nullptr)},
        {"pareto_metric", word(report.pareto_metric)},
        {"winner", winner(report.winner)},
        {"under", report.under},
        {"images", images},
        {"crops", crops},
        {"warnings", report.warnings},
        {"notes", report.notes}};
    return json;
}

Status write_report_json(const Report& report) {
    return report.write(report.folder + "/report.json",
                        io::json_text(report_json(report), 1) + "\n");
}

}  // namespace postchain::report
