#include "tools/python/sequence_calls.h"

#include <filesystem>

#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/record/check_outputs.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/inspect_frame.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/sequence/run/run_sequence.h"
#include "tools/sequence/run/sheet.h"
#include "tools/sequence/source/sequence_reader.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

py::dict dict_of(const sequence::RunSummary& summary, const std::vector<std::string>& warnings,
                 bool canceled) {
    const size_t done = summary.written + summary.skipped + summary.held + summary.missing;
    py::dict dict;
    dict["total"] = summary.total;
    dict["written"] = summary.written;
    dict["skipped"] = summary.skipped;
    dict["held"] = summary.held;
    dict["missing"] = summary.missing;
    dict["failed"] = summary.failed;
    dict["left"] = summary.total - done - summary.failed;
    dict["elapsed_s"] = summary.elapsed_s;
    dict["gaps"] = summary.gaps;
    dict["warnings"] = warnings;
    dict["canceled"] = canceled;
    return dict;
}

}  // namespace

void Callbacks::check() const {
    if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
        raise_usage("progress: is not callable; give a function of a dict");
    if (!stop.is_none() && !py::hasattr(stop, "is_set"))
        raise_usage("stop: has no is_set(); give a threading.Event");
}

Call::Idle Callbacks::watch(bool& stopped) const {
    if (stop.is_none()) return {};
    return [this, &stopped](Call& call) {
        if (stopped || !py::bool_(stop.attr("is_set")())) return;
        stopped = true;
        call.ask_to_stop();
    };
}

bool Callbacks::ended_by(const py::dict& report) const {
    return progress(report).is(py::bool_(false));
}

py::dict run_sequence(const ChainObject& chain, const std::string& input, const std::string& output,
                      const py::object& camera, const Callbacks& callbacks,
                      const std::shared_ptr<Device>& device, const py::kwargs& values) {
    callbacks.check();
    sequence::RunSettings settings =
        job_settings("run_sequence", input, output, camera, values, run_keys());
    if (chain.is_file) settings.other_inputs.push_back({chain.name, "the chain file"});
    for (auto& picture : io::inputs_of(chain.chain.camera))
        settings.other_inputs.push_back(std::move(picture));
    bool stopped = false;
    std::vector<std::string> warnings;  // of the device's thread, until it has ended
    auto summary = device->run(
        "run_sequence",
        [&](Call& call, Executor& executor) {
            const auto observer = [&](const sequence::FrameReport& report,
                                      const sequence::RunProgress& progress) {
                for (const auto& said : report.warnings) warnings.push_back(in_python(said));
                for (const auto& note : report.write.notes)
                    warnings.push_back(in_python(report.output + ": " + note));
                if (callbacks.progress.is_none()) return;
                call.send([&, line = sequence::report_json(report, progress)] {
                    if (stopped || !callbacks.ended_by(python_of(line))) return;
                    stopped = true;
                    call.ask_to_stop();
                });
            };
            return sequence::run_sequence(chain.chain, settings, executor, device->renderer(),
                                          {observer, &call.stop()});
        },
        callbacks.watch(stopped));
    if (!summary.ok()) raise(summary.status());
    if (!summary->first_failure.ok() && !stopped &&
        settings.on_error == sequence::ErrorPolicy::stop && summary->failed > 0)
        raise(summary->first_failure);
    return dict_of(*summary, warnings, stopped);
}

py::list plan_sequence(const ChainObject& chain, const std::string& input, const py::object& camera,
                       const py::kwargs& values) {
    const sequence::RunSettings settings =
        job_settings("plan_sequence", input, "", camera, values, plan_sequence_keys());
    std::vector<io::Json> frames;
    const Status status = in_background("plan_sequence", [&](Call& call) -> Status {
        Status failure;
        const Status ended = sequence::plan_sequence(
            chain.chain, settings, [&](const sequence::PlanReport& planned) {
                failure = planned.plan.status();
                if (!failure.ok() || call.stop()) return false;
                frames.push_back(sequence::planned_json(planned, std::nullopt));
                frames.back()["warnings"] = planned.warnings;
                return true;
            });
        if (call.stop()) return Status(StatusCode::canceled, "plan_sequence: stopped");
        return ended.ok() ? failure : ended;
    });
    if (!status.ok()) raise(status);
    py::list plans;
    for (const io::Json& frame : frames) plans.append(python_of(frame));
    return plans;
}

py::tuple frame_list(const std::string& input, const py::kwargs& values) {
    std::set<std::string> keys = read_keys();
    keys.insert("frames");
    const sequence::RunSettings settings =
        job_settings("frames", input, "", py::none(), values, keys);
    const io::FrameList list = value_of(io::find_frames(settings.input, settings.frames));
    if (!list.missing.empty())
        raise(Status(StatusCode::input, concat(settings.input.color().format(list.missing.front()),
                                               ": frame is not on disk; give frames= that exist")));
    std::vector<int> on_disk;
    for (const auto& [number, files] :
         value_of(io::find_frames(sequence::input_of_neighbors(settings.input), std::nullopt))
             .files)
        on_disk.push_back(number);
    return py::make_tuple(list.frames, on_disk, settings.source.cuts);
}

py::object inspect(const std::string& input, const py::object& camera, const py::kwargs& values) {
    std::error_code error;
    if (std::filesystem::is_directory(input, error)) {
        if (!camera.is_none() || py::len(values) > 0)
            raise_usage("inspect: ", input,
                        " is a folder, which is only listed; give a sequence in it for "
                        "camera and settings");
        return python_of(value_of(sequence::inspect_folder(input)));
    }
    const sequence::RunSettings settings =
        job_settings("inspect", input, "", camera, values, inspect_keys());
    std::vector<std::string> warnings;
    auto json = in_background("inspect", [&](Call& call) -> Result<io::Json> {
        ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
        std::vector<int> shown = list.frames;
        if (!settings.frames) shown.resize(1);
        sequence::SequenceSurvey survey;
        io::Json frames = io::Json::array();
        for (int frame : shown) {
            if (call.stop()) return Status(StatusCode::canceled, "inspect: stopped");
            if (list.is_missing(frame)) return sequence::absent_frame(frame, settings);
            auto found = sequence::inspect_frame(settings, list.files.at(frame), frame, survey);
            if (!found.status.ok()) return found.status;
            for (auto& warning : found.source->warnings) warnings.push_back(warning);
            frames.push_back(std::move(found.json));
        }
        io::Json all = {{"frames", std::move(frames)}};
        if (list.files.size() < 2 || list.frames.size() < 2) return all;
        if (!settings.frames)
            if (const Status status =
                    sequence::survey_others(settings, list, sequence::frames_to_survey(list),
                                            survey, [&](size_t) { return !call.stop(); });
                !status.ok())
                return status;
        all["sequence"] = survey.json();
        return all;
    });
    if (!json.ok()) raise(json.status());
    warn(warnings);
    return python_of(*json);
}

const std::set<std::string>& sheet_keys() {
    static const std::set<std::string> keys = {
        "frames",         "profile", "view_layer",   "view",      "max_memory",
        "input_transfer", "ocio",    "ocio_display", "ocio_view", "ocio_colorspace"};
    return keys;
}

io::OnExisting on_existing_of(const py::object& given, const char* function) {
    sequence::JobSettings job;
    py::kwargs words;
    words["on_existing"] = given;
    set_rows(job_parameters(), &job, words, function);
    return job.on_existing;
}

py::dict check(const std::vector<std::string>& outputs, const py::object& frames,
               const std::string& like) {
    if (outputs.empty()) raise_usage("outputs: is empty; give a pattern");
    std::optional<io::FrameRange> range;
    if (!frames.is_none())
        range = value_of(io::FrameRange::parse(
            std::get<std::string>(parameter_value(frames, *job_parameters().find("frames")))));
    bool whole = true;
    auto all = in_background("check", [&](Call& call) -> Result<io::Json> {
        io::Json sequences = io::Json::array();
        for (const std::string& text : outputs) {
            if (call.stop()) return Status(StatusCode::canceled, "check: stopped");
            ASSIGN_OR_RETURN(const auto pattern, io::PathPattern::parse(text));
            ASSIGN_OR_RETURN(const auto found, sequence::check_outputs(pattern, range, like));
            sequences.push_back(sequence::checked_json(text, found));
            for (const auto& one : found)
                whole = whole && one.state == sequence::OutputState::whole;
        }
        return sequences;
    });
    if (!all.ok()) raise(all.status());
    return python_of(io::Json{{"whole", whole}, {"sequences", *all}});
}

py::dict sheet(const std::string& input, const std::string& output, const std::string& beside,
               int cells, int columns, int width, const py::object& on_existing,
               const Callbacks& callbacks, const py::kwargs& values) {
    callbacks.check();
    check_keys("sheet", values, sheet_keys());
    py::kwargs settings = values.attr("copy")();
    settings["png"] = true;  // uses the view of previews
    sequence::SheetSettings asked;
    asked.run = job_settings("sheet", input, "", py::none(), settings, run_keys());
    asked.output = output;
    asked.beside = beside;
    asked.cells = cells;
    asked.columns = columns;
    asked.width = width;
    asked.on_existing = on_existing_of(on_existing, "sheet");
    if (cells < 1 || cells > 10000) raise_usage("cells: ", cells, " is not in 1..10000");
    if (columns < 0 || columns > 10000) raise_usage("columns: ", columns, " is not in 1..10000");
    if (width < 16 || width > 4096) raise_usage("width: ", width, " is not in 16..4096");
    bool stopped = false;
    auto report = in_background(
        "sheet",
        [&](Call& call) {
            return sequence::make_sheet(asked, [&](int frame, size_t done, size_t total) {
                if (!callbacks.progress.is_none())
                    call.send([&, frame, done, total] {
                        py::dict dict;
                        dict["frame"] = frame;
                        dict["done"] = done;
                        dict["total"] = total;
                        if (stopped || !callbacks.ended_by(dict)) return;
                        stopped = true;
                        call.ask_to_stop();
                    });
                return !call.stop();
            });
        },
        callbacks.watch(stopped));
    const sequence::SheetReport made = value_unless_stopped(std::move(report), stopped);
    warn(made.unreadable);
    py::dict dict;
    dict["frames"] = made.frames;
    dict["of"] = made.of;
    dict["absent"] = made.absent;
    return dict;
}

}  // namespace postchain::python
