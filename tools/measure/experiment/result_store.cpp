#include "tools/measure/experiment/result_store.h"

#include "chain/base/parameter.h"
#include "chain/base/readable_file.h"
#include "tools/measure/experiment/converge.h"
#include "tools/measure/report/report_json.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::experiment {
namespace {

report::Json load(const std::string& path, const std::string& key) {
    auto json = io::read_json(text_of_file(path), path, io::kReportLimits);
    if (!json.ok() || !json->is_object() || json->value("key", report::Json()) != key)
        return nullptr;
    return std::move(*json);
}

Result<std::string> files_of(const Chain& chain, int frame, const ExperimentSettings& settings,
                             const ExperimentInput& input) {
    sequence::SequenceReader reader(
        settings.run.source, settings.run.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.run.source, header, settings.run.plan);
        });
    ASSIGN_OR_RETURN(const auto opened, reader.open(frame, input.files.at(frame)));
    std::string work = sequence::fingerprint_of(chain, settings.run, opened);
    if (input.has_truth(frame)) work += " truth " + input.truth->identity(frame);
    return work;
}

}  // namespace

ResultStore::ResultStore(std::string folder, std::string conditions, io::OutputFiles files)
    : folder_(folder + "/results"), conditions_(std::move(conditions)), files_(std::move(files)) {}

Status ResultStore::prepare() const {
    return io::make_folder(folder_);
}

std::string ResultStore::path(const std::string& name) const {
    return folder_ + "/" + name + ".json";
}

std::string ResultStore::key(const std::string& work) const {
    return hex_of(hash_text(conditions_ + "\n" + work));
}

std::optional<FrameResult> ResultStore::frame(const std::string& name, int frame,
                                              const std::string& work) const {
    const report::Json json = load(path(concat(name, ".", frame)), key(work));
    if (json.is_null()) return std::nullopt;
    try {
        FrameResult result;
        json.at("metrics").get_to(result.metrics);
        json.at("split").get_to(result.split);
        json.at("slice").get_to(result.slice);
        for (const report::Json& one : json.at("left_out"))
            result.elisions.push_back(report::elision_from(one));
        return result;
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

std::optional<report::Timing> ResultStore::timing(const std::string& name,
                                                  const std::string& work) const {
    const report::Json json = load(path(name + ".time"), key(work));
    try {
        return json.is_null() ? std::nullopt
                              : std::optional(json.at("timing").get<report::Timing>());
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

Status ResultStore::keep(const std::string& name, int frame, const std::string& work,
                         const FrameResult& result) const {
    report::Json left_out = report::Json::array();
    for (const Elision& elision : result.elisions) left_out.push_back(report::json_of(elision));
    const report::Json json = {{"key", key(work)},
                               {"metrics", result.metrics},
                               {"split", result.split},
                               {"slice", result.slice},
                               {"left_out", left_out}};
    return files_.put(path(concat(name, ".", frame)), io::json_text(json, 1));
}

Status ResultStore::keep(const std::string& name, const std::string& work,
                         const report::Timing& timing) const {
    const report::Json json = {{"key", key(work)}, {"timing", timing}};
    return files_.put(path(name + ".time"), io::json_text(json, 1));
}

std::string conditions_of(const report::Report& report, const ExperimentSettings& settings,
                          const RuleNames& rules) {
    std::string text =
        concat("results 4\n", report.version, "\n", report.renderer, "\n", report.threads, "\n",
               report.precision, "\n", report.tone_mapper, " ", settings.flip.pixels_per_degree,
               " ", report.exposure_start, " ", report.exposure_stop, "\n", kConvergedSeeds, " ",
               settings.repeats, "\n", report.reference, "\n");
    if (const auto& slice = report.slice)
        text += concat("slice ", slice->row, " ", slice->left, " ", slice->width, "\n");
    for (const auto& rule : rules) text += rule + "\n";
    return text;
}

Result<std::string> key_of_result(const Chain& chain, int frame, const std::string& more,
                                  const ExperimentSettings& settings,
                                  const ExperimentInput& input) {
    ASSIGN_OR_RETURN(auto work, files_of(chain, frame, settings, input));
    if (!input.follows(frame)) return work + more;
    ASSIGN_OR_RETURN(auto before, files_of(chain, frame - 1, settings, input));
    return work + more + " after " + before;
}

}  // namespace postchain::experiment
