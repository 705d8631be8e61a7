#include "tools/measure/report/report_json.h"

#include <cmath>

#include "tools/sequence/files/json.h"

namespace postchain::report {
namespace {

Json figure_json(const TimeFigure& time) {
    return {{"median_ms", time.median_ms}, {"spread_ms", time.spread_ms}, {"n", time.n}};
}

TimeFigure figure_from(const Json& json) {
    return {json.at("median_ms"), json.at("spread_ms"), json.at("n")};
}

Json parts_json(const ErrorParts& parts) {
    return {{"precision", json_of(parts.precision)},
            {"sampling", json_of(parts.sampling)},
            {"model", json_of(parts.model)},
            {"total", json_of(parts.total)}};
}

std::optional<double> number_from(const Json& json) {
    return json.is_null() ? std::nullopt : std::optional<double>(json.get<double>());
}

ErrorParts parts_from(const Json& json) {
    return {number_from(json.at("precision")), number_from(json.at("sampling")),
            number_from(json.at("model")), number_from(json.at("total"))};
}

std::string word_from(const Json& json) {
    return json.is_null() ? std::string() : json.get<std::string>();
}

// nlohmann throws if JSON has another form; then it is not a file of this program.
template <class T, class Read>
std::optional<T> guarded(const Read& read) {
    try {
        return read();
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

// The enumerator with this name_of(); the last one if there is none.
template <class E>
E enum_from(const Json& json, E last) {
    const std::string name = json;
    for (int i = 0; i < int(last); ++i)
        if (name == postchain::name_of(E(i))) return E(i);
    return last;
}

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

Json report_json(const Report& report) {
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

Json json_of(const std::optional<double>& value) {
    if (!value || !std::isfinite(*value)) return nullptr;
    return *value;
}

Json json_of(const std::vector<std::optional<double>>& values) {
    Json list = Json::array();
    for (const auto& value : values) list.push_back(json_of(value));
    return list;
}

Json json_of(const Timing& timing) {
    Json passes = Json::array();
    for (const PassCost& cost : timing.passes) {
        Json pass = figure_json(cost.time);
        pass["pass"] = cost.pass;
        pass["left_out"] = cost.elided;
        passes.push_back(std::move(pass));
    }
    return {{"frame", timing.frame},
            {"source", timing.source},
            {"trustworthy", timing.trustworthy},
            {"why_not", timing.why_not.empty() ? Json(nullptr) : Json(timing.why_not)},
            {"total", figure_json(timing.total)},
            {"passes", passes}};
}

Json json_of(const ErrorSplit& split) {
    Json mse = parts_json(split.mse);
    mse["cross"] = json_of(split.cross);
    Json others = Json::object();
    for (const auto& [name, one] : split.others) others[name] = parts_json(one);
    return {{"frames", split.frames},
            {"mse", mse},
            {"others", others},
            {"seeds", split.seeds},
            {"converged_noise_mse", split.converged_noise},
            {"convergence", split.convergence},
            {"notes", split.notes}};
}

Json json_of(const Elision& elision, const std::string& what) {
    Json json = io::json_from(elision_json(elision, what));
    for (const char* of_one_plan : {"work_list", "outside", "taps_per_block"})
        json.erase(of_one_plan);
    return json;
}

std::optional<Timing> timing_from(const Json& json) {
    return guarded<Timing>([&] {
        Timing timing;
        timing.frame = json.at("frame");
        timing.source = json.at("source");
        timing.trustworthy = json.at("trustworthy");
        timing.why_not = word_from(json.at("why_not"));
        timing.total = figure_from(json.at("total"));
        for (const Json& pass : json.at("passes"))
            timing.passes.push_back({pass.at("pass"), pass.at("left_out"), figure_from(pass)});
        return timing;
    });
}

std::optional<ErrorSplit> split_from(const Json& json) {
    return guarded<ErrorSplit>([&] {
        ErrorSplit split;
        split.frames = json.at("frames").get<std::vector<int>>();
        split.mse = parts_from(json.at("mse"));
        split.cross = number_from(json.at("mse").at("cross"));
        for (const auto& [name, parts] : json.at("others").items())
            split.others[name] = parts_from(parts);
        split.seeds = json.at("seeds");
        split.converged_noise = json.at("converged_noise_mse");
        split.convergence = json.at("convergence").get<std::vector<std::string>>();
        split.notes = json.at("notes").get<std::vector<std::string>>();
        return split;
    });
}

std::optional<Elision> elision_from(const Json& json) {
    return guarded<Elision>([&] {
        Elision elision;
        elision.pass = json.at("pass").is_null() ? -1 : json.at("pass").get<int>();
        elision.kind = enum_from<ElisionKind>(json.at("kind"), ElisionKind::blocks);
        elision.item = json.at("item");
        elision.rule = json.at("rule");
        const Json& fact = json.at("fact");
        elision.fact.name = fact.at("name");
        elision.fact.value = number_from(fact.at("value"));
        elision.fact.limit = number_from(fact.at("limit"));
        elision.fact.unit = fact.at("unit");
        elision.fact.relation =
            enum_from<Fact::Relation>(fact.at("relation"), Fact::Relation::at_least);
        elision.saving = {json.at("bytes"), json.at("dispatches"), json.at("taps")};
        return elision;
    });
}

}  // namespace postchain::report
