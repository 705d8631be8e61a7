#include "tools/measure/experiment/basis.h"

#include <algorithm>
#include <thread>

#include "tools/measure/report/words.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::experiment {
namespace {

void state_conditions(const ExperimentSettings& settings, report::Report& report) {
    report.folder = settings.folder;
    report.command = settings.command;
    report.version = settings.run.version;
    report.input = settings.input;
    report.renderer = settings.renderer;
    report.software = settings.software;
    report.threads = settings.threads > 0 ? settings.threads
                                          : std::max(1, int(std::thread::hardware_concurrency()));
    report.precision = name_of(settings.run.plan.precision);
}

}  // namespace

Result<Basis> open_basis(report::Kind kind, const ExperimentSettings& settings,
                         report::Report& report) {
    report.kind = kind;
    state_conditions(settings, report);
    const auto mapper = settings.flip.tone_mapper;
    Basis basis;
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.run.input, settings.run.frames));
    basis.files = std::move(list.files);
    for (const auto& [frame, files] : basis.files)
        for (const auto& [role, path] : files) basis.stamps.push_back(io::FileStamp::of(path));
    ASSIGN_OR_RETURN(auto survey, survey_input(settings.run, mapper, settings.truth.empty()));
    report.frames = survey.frames;
    report.width = survey.width;
    report.height = survey.height;
    basis.exposures = survey.exposures;
    if (!settings.truth.empty()) {
        ASSIGN_OR_RETURN(auto truth, Truth::open(settings.truth, report.frames));
        for (const std::string& path : truth.paths())
            basis.stamps.push_back(io::FileStamp::of(path));
        RETURN_IF_ERROR(truth.survey(settings.run, mapper));
        basis.exposures = truth.exposures();
        basis.truth = std::move(truth);
        report.truth = settings.truth_is.empty() ? settings.truth : settings.truth_is;
        report.reference = "truth";
    } else {
        report.no_truth =
            settings.no_truth.empty() ? "no ground truth given (-r)" : settings.no_truth;
        report.reference = kind == report::Kind::ab ? "a" : "converged";
    }
    report.scored_frames = basis.truth ? basis.truth->frames() : report.frames;
    if (report.scored_frames.size() < report.frames.size())
        report.notes.push_back(concat(
            report.scored_frames.size(), " of ", report::counted(report.frames.size(), "frame"),
            " were measured, those with a ground truth: ",
            sequence::frames_text(report.scored_frames),
            "; the other frames count only for `flicker`, `grid` and elision"));
    report.page_frames = spread_frames(report.scored_frames, settings.page_frames);
    report.metrics = metric_columns(kind, basis.truth.has_value());
    report.constants = metrics::metric_constants();
    report.constants.emplace_back("pixels_per_degree", settings.flip.pixels_per_degree);
    report.exposure_start = basis.exposures.start;
    report.exposure_stop = basis.exposures.stop;
    report.exposures = basis.exposures.exposures();
    report.tone_mapper = metrics::name_of(mapper);
    return basis;
}

Result<sequence::SourceFrame> read_frame(const Basis& basis, const sequence::RunSettings& run,
                                         int frame, RoleSet wanted) {
    sequence::SequenceReader reader(run.source, run.input,
                                    [&](const sequence::FrameHeader&) { return wanted; });
    ASSIGN_OR_RETURN(const auto inputs, reader.open(frame, basis.files.at(frame)));
    auto source = reader.read(inputs);
    if (source.ok()) source->description.frame_number = frame;
    return source;
}

std::vector<std::string> notes_on_neighbors(const sequence::SourceFrame& frame) {
    std::vector<std::string> notes;
    for (const auto& [neighbor, why] : frame.description.missing_neighbors)
        notes.push_back(concat("frame ", frame.description.frame_number,
                               " is filtered without the frame ", name_of(neighbor), ": ", why));
    return notes;
}

}  // namespace postchain::experiment
