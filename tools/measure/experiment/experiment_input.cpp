#include "tools/measure/experiment/experiment_input.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <thread>

#include "chain/pass/resolved_chain.h"
#include "config/text_tree.h"
#include "tools/measure/experiment/pixel_classes.h"
#include "tools/measure/report/words.h"
#include "tools/metrics/display.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::experiment {
namespace {

namespace fs = std::filesystem;

std::string size_text(const io::Window& window) {
    return concat(window.width(), "x", window.height(), " ", window.text());
}

bool black(const metrics::RgbImage& image) {
    return std::ranges::all_of(image.rgb.data, [](float v) { return v <= 0; });
}

// Equal up to the digits that camera.json keeps.
bool same_value(const ParameterValue& a, const ParameterValue& b) {
    const auto* x = std::get_if<double>(&a);
    const auto* y = std::get_if<double>(&b);
    return x && y ? std::abs(*x - *y) <= 1e-6 * std::max(std::abs(*x), std::abs(*y)) : a == b;
}

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

Result<Truth> Truth::open(const std::string& pattern, const std::vector<int>& frames) {
    auto spec = io::InputSpec::parse(pattern);
    if (!spec.ok()) return spec.status().at("{truth}"_keyed);
    if (spec->separate_files())
        return Status(StatusCode::usage, "{truth}: give one pattern, for color only"_keyed);
    if (!spec->color().has_token() && frames.size() > 1)
        return Status(StatusCode::usage, concat("{truth}: "_keyed, pattern, ": one file for ",
                                                frames.size(), " frames; add #### to the name"));
    Truth truth;
    for (int frame : frames) {
        const std::string path = spec->color().format(frame);
        std::error_code error;
        if (!fs::exists(path, error)) continue;
        truth.files_[frame] = {{Role::color, path}};
        truth.frames_.push_back(frame);
    }
    if (truth.frames_.empty())
        return Status(StatusCode::input, concat(spec->color().format(frames[0]),
                                                ": the ground truth has no file for any of ",
                                                "the ", report::counted(frames.size(), "frame"),
                                                " of the input: ", sequence::frames_text(frames),
                                                "; render them, or measure without it"));
    return truth;
}

Result<sequence::FrameHeader> Truth::open_frame(int frame) const {
    return sequence::open_source_frame({}, files_.at(frame), frame);
}

Result<sequence::SourceFrame> Truth::read(sequence::FrameHeader header) {
    return sequence::read_source_frame({}, std::move(header), {}, io::Keep::nothing);
}

Result<metrics::RgbImage> Truth::load(int frame) const {
    ASSIGN_OR_RETURN(auto header, open_frame(frame));
    ASSIGN_OR_RETURN(auto source, read(std::move(header)));
    return metrics::rgb_image_of(
        io::placed(*source.planes.at(Role::color), source.header.window, windows_.at(frame)));
}

std::string Truth::identity(int frame) const {
    const auto stamp = io::FileStamp::of(path(frame));
    return concat(fs::path(stamp.path).filename().string(), " ", stamp.bytes, " ", stamp.time);
}

namespace {

constexpr int kSlicePx = 512;

// Adds the squared change of the displayed values, over RGB.
void add_change(const ImageF& from, const ImageF& to, ImageF& sum) {
    for (size_t i = 0; i < sum.pixels(); ++i)
        for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
            const float d =
                metrics::display_value(to.data[c]) - metrics::display_value(from.data[c]);
            sum.data[i] += d * d;
        }
}

// The row with the largest sum, and the pixels of it with the largest.
report::Slice slice_of(const ImageF& change) {
    report::Slice slice;
    double most = -1;
    for (int y = 0; y < change.height; ++y) {
        const float* row = change.pixel(0, y);
        const double sum = std::accumulate(row, row + change.width, 0.0);
        if (sum <= most) continue;
        most = sum;
        slice.row = y;
    }
    slice.width = std::min(kSlicePx, change.width);
    const float* row = change.pixel(0, slice.row);
    double here = std::accumulate(row, row + slice.width, 0.0);
    most = here;
    for (int left = 1; left + slice.width <= change.width; ++left) {
        here += double(row[left + slice.width - 1]) - double(row[left - 1]);
        if (here <= most) continue;
        most = here;
        slice.left = left;
    }
    return slice;
}

}  // namespace

Status Truth::survey(const sequence::RunSettings& input, metrics::ToneMapper mapper) {
    ASSIGN_OR_RETURN(auto list, io::find_frames(input.input, input.frames));
    exposures_ = {};
    ImageF before, change;
    for (int frame : frames_) {
        const std::string& path = files_.at(frame).at(Role::color);
        ASSIGN_OR_RETURN(auto filtered,
                         sequence::open_source_frame(input.source, list.files.at(frame), frame));
        ASSIGN_OR_RETURN(auto header, open_frame(frame));
        const io::ExrPart& part_of_input = sequence::color_part(filtered);
        const io::ExrPart& part_of_truth = sequence::color_part(header);
        const io::Window of_input = filtered.window, of_truth = header.window;
        const auto differ = [&](const char* what, const io::Window& its, const io::Window& own) {
            return Status(
                StatusCode::input,
                concat(path, ": the ", what, " of the ground truth is ", size_text(its),
                       ", but that of ", filtered.files.color_file().path(), " is ", size_text(own),
                       "; render the ground truth with the input's region"));
        };
        const bool one_display = part_of_truth.display_window == part_of_input.display_window;
        if (of_truth != of_input && !(one_display && of_truth.contains(of_input)))
            return differ("window", of_truth, of_input);
        // Beyond its data window the ground truth would be completed with black.
        if (!part_of_truth.data_window.contains(part_of_input.data_window))
            return differ("data window", part_of_truth.data_window, part_of_input.data_window);
        windows_[frame] = of_input;
        ASSIGN_OR_RETURN(auto source, read(std::move(header)));
        if (const auto bad = source.findings.health.nonfinite_color)
            return Status(
                StatusCode::input,
                concat(path, ": the ground truth has ", report::counted(bad, "pixel"),
                       " with NaN or Inf, the first at ", source.findings.first_nonfinite_text(),
                       "; cannot measure against it"));
        auto image =
            metrics::rgb_image_of(io::placed(*source.planes.at(Role::color), of_truth, of_input));
        if (!image.ok()) return image.status().at(path);
        if (black(*image))
            return Status(StatusCode::input, path + ": the ground truth is black; check the file");
        exposures_ = metrics::joined(exposures_, metrics::exposure_range(*image, mapper));
        if (change.empty()) change = ImageF(image->rgb.width, image->rgb.height, 1);
        if (!before.empty()) add_change(before, image->rgb, change);
        before = std::move(image->rgb);
    }
    if (frames_.size() > 1) slice_ = slice_of(change);
    return Status();
}

Result<io::FrameList> frames_on_disk(const sequence::RunSettings& input) {
    auto list = io::find_frames(input.input, input.frames);
    if (list.ok() && !list->missing.empty())
        return Status(StatusCode::input,
                      concat(input.input.color().format(list->missing[0]), ": ",
                             report::counted(list->missing.size(), "requested frame"),
                             " not on disk: ", sequence::frames_text(list->missing),
                             "; render them, or leave them out"));
    return list;
}

Result<InputSurvey> survey_input(const sequence::RunSettings& input, metrics::ToneMapper mapper,
                                 bool with_exposures) {
    ASSIGN_OR_RETURN(auto list, frames_on_disk(input));
    InputSurvey survey;
    survey.frames = list.frames;
    io::Window first;
    std::string first_path;
    for (int frame : list.frames) {
        ASSIGN_OR_RETURN(auto header,
                         sequence::open_source_frame(input.source, list.files.at(frame), frame));
        const io::Window window = header.window;
        const std::string path = header.files.color_file().path();
        if (first_path.empty()) {
            first = window;
            first_path = path;
        }
        if (window.width() != first.width() || window.height() != first.height())
            return Status(StatusCode::input, concat(path, ": size is ", size_text(window), ", but ",
                                                    first_path, " is ", size_text(first),
                                                    "; all frames of a report must have one size"));
        if (!with_exposures) continue;
        ASSIGN_OR_RETURN(auto source, sequence::read_source_frame(input.source, std::move(header),
                                                                  {}, io::Keep::nothing));
        auto image = metrics::rgb_image_of(*source.planes.at(Role::color));
        if (!image.ok()) return image.status().at(path);
        survey.exposures =
            metrics::joined(survey.exposures, metrics::exposure_range(*image, mapper));
    }
    survey.width = first.width();
    survey.height = first.height();
    return survey;
}

SceneOfInput find_scene(const sequence::RunSettings& input, const InputSurvey& survey) {
    SceneOfInput found;
    const std::string path = input.input.color().folder() + "/camera.json";
    auto text = read_text_file(path, StatusCode::input);
    if (!text.ok()) {
        found.why_not = "no ground truth was given, and there is no " + path + " to name a scene";
        return found;
    }
    const TextNode root = read_text_tree(*text, path, StatusCode::input, io::kReportLimits).root;
    const auto word = [&](const char* key) {
        const TextNode* value = root.find(key);
        return value && value->is_scalar() ? value->text : std::string();
    };
    scenes::SceneRequest request;
    request.name = word("scene");
    const auto& all = scenes::scenes();
    const auto scene = std::ranges::find_if(all, [&](const scenes::SceneInfo& info) {
        return info.name == request.name && info.help == word("description");
    });
    if (scene == all.end()) {
        found.why_not = "no ground truth was given, and " + path + " names no generated scene";
        return found;
    }
    request.width = survey.width;
    request.height = survey.height;
    request.frames = survey.frames;
    // The lens that the sequence was rendered with; in `zoom`, focal length and focus come from the
    // scene in every frame.
    const CameraFile file = parse_camera(*text, path);
    if (!file.status().ok()) {
        found.why_not = file.status().message();
        return found;
    }
    request.camera = file.camera;
    io::ApertureFiles pictures;
    if (Status status = pictures.read(request.camera); !status.ok()) {
        found.why_not = status.message();
        return found;
    }
    request.camera.meters_per_unit.reset();
    if (!file.frames.empty()) {
        request.camera.focal_length_mm.reset();
        request.camera.focus_distance.reset();
    }
    found.request = std::move(request);
    return found;
}

std::vector<std::string> differences_from_truth(const Chain& chain,
                                                const sequence::FrameHeader& header,
                                                const Camera& camera_of_truth) {
    FrameDescription frame;
    frame.width = header.window.width();
    frame.height = header.window.height();
    frame.camera = header.camera.overlaid_by(chain.camera);
    for (const auto& link : chain.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0;
    std::vector<std::string> texts;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const auto pass = resolve_link(chain, i, frame);
        if (!pass.ok()) continue;
        for (const UsedValue& used : (*pass)->used_values()) {
            const Parameter* row = camera_parameters().find(used.key);
            if (!row || used.of == UsedValue::Of::frame) continue;
            const ParameterValue truth = row->get(&camera_of_truth);
            if (same_value(used.value, truth)) continue;
            const bool looked_up = used.row == "focus_at";
            texts.push_back(concat(used.key, " ",
                                   looked_up ? std::string("at focus_at") : text_of(used.value),
                                   " in place of ", text_of(truth)));
        }
    }
    return texts;
}

Result<std::string> generate_truth(const scenes::SceneRequest& given, const std::string& parent,
                                   int samples, const io::OutputFiles& files,
                                   const egl::ContextOptions& context,
                                   const std::function<bool(int, double)>& progress) {
    scenes::SceneRequest request = given;
    request.truth_samples = samples;
    // One folder per request, so that files left by an interrupted run can be reused.
    const std::string text = concat(request.name, " ", request.width, "x", request.height, " ",
                                    samples, " ", request.camera.text());
    const std::string folder = parent + "/" + hex_of(hash_text(text));
    RETURN_IF_ERROR(io::make_folder(folder));
    const std::string pattern = folder + "/both.####.exr";
    ASSIGN_OR_RETURN(auto name, io::PathPattern::parse(pattern));
    std::unique_ptr<scenes::SceneRenderer> renderer;
    for (int frame : request.frames) {
        const std::string path = name.format(frame);
        if (io::ExrFile::open(path).ok())
            continue;  // from an interrupted run: files appear complete
        if (!renderer) {
            ASSIGN_OR_RETURN(renderer, scenes::SceneRenderer::create(context));
        }
        auto planes =
            scenes::render_frame(*renderer, request, frame, scenes::Picture::both,
                                 [&](double share) { return !progress || progress(frame, share); });
        if (!planes.ok()) return planes.status();
        ASSIGN_OR_RETURN(const auto permit, files.permit(path));
        ASSIGN_OR_RETURN(auto written,
                         io::write_planes_exr(path, planes->color, {"R", "G", "B", "A"}, permit));
    }
    return pattern;
}

Status find_truth(BenchSettings& settings, const io::OutputFiles& files,
                  const egl::ContextOptions& context,
                  const std::function<bool(const std::string&)>& progress) {
    if (!settings.truth.empty()) return Status();
    ASSIGN_OR_RETURN(auto survey, survey_input(settings.run, settings.flip.tone_mapper, false));
    const SceneOfInput scene = find_scene(settings.run, survey);
    if (!scene.request) {
        settings.no_truth = scene.why_not;
        return Status();
    }
    auto pattern =
        generate_truth(*scene.request, settings.folder + "/truth", settings.truth_samples, files,
                       context, [&](int frame, double share) {
                           return progress(concat("truth of ", scene.request->name, ", frame ",
                                                  frame, ", ", int(100 * share), " %"));
                       });
    if (!pattern.ok()) return pattern.status();
    ASSIGN_OR_RETURN(const auto model, scenes::model_for(*scene.request));
    for (int frame : scene.request->frames)
        settings.truth_cameras[frame] = scenes::camera_at(model, frame);
    settings.truth = *pattern;
    settings.truth_is = concat("generated: ", scene.request->name, ", ", settings.truth_samples,
                               " samples per pixel");
    return Status();
}

Status ExperimentInput::check_unchanged(int first, int last) const {
    for (auto at = stamps.lower_bound(first); at != stamps.end() && at->first <= last; ++at)
        RETURN_IF_ERROR(io::check_unchanged(at->second));
    return Status();
}

Result<ExperimentInput> open_input(report::Kind kind, const ExperimentSettings& settings,
                                   report::Report& report) {
    report.kind = kind;
    state_conditions(settings, report);
    const auto mapper = settings.flip.tone_mapper;
    ExperimentInput input;
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.run.input, settings.run.frames));
    input.files = std::move(list.files);
    for (const auto& [frame, files] : input.files)
        for (const auto& [role, path] : files)
            input.stamps[frame].push_back(io::FileStamp::of(path));
    ASSIGN_OR_RETURN(auto survey, survey_input(settings.run, mapper, settings.truth.empty()));
    report.frames = survey.frames;
    report.width = survey.width;
    report.height = survey.height;
    input.exposures = survey.exposures;
    if (!settings.truth.empty()) {
        ASSIGN_OR_RETURN(auto truth, Truth::open(settings.truth, report.frames));
        for (const int frame : truth.frames())
            input.stamps[frame].push_back(io::FileStamp::of(truth.path(frame)));
        RETURN_IF_ERROR(truth.survey(settings.run, mapper));
        input.exposures = truth.exposures();
        report.slice = truth.slice();
        input.truth = std::move(truth);
        report.truth = settings.truth_is.empty() ? settings.truth : settings.truth_is;
        report.reference = "truth";
    } else {
        report.no_truth =
            settings.no_truth.empty() ? "no ground truth given (-r)" : settings.no_truth;
        report.reference = kind == report::Kind::ab ? "a" : "converged";
    }
    report.scored_frames = input.truth ? input.truth->frames() : report.frames;
    if (report.scored_frames.size() < report.frames.size())
        report.notes.push_back(concat(
            report.scored_frames.size(), " of ", report::counted(report.frames.size(), "frame"),
            " were measured, those with a ground truth: ",
            sequence::frames_text(report.scored_frames),
            "; the other frames count only for `flicker`, `grid` and elision"));
    report.page_frames = spread_frames(report.scored_frames, settings.page_frames);
    report.metrics = metric_columns(kind, input.truth.has_value());
    report.constants = metrics::metric_constants();
    for (const auto& constant : {std::pair("pixels_per_degree", settings.flip.pixels_per_degree),
                                 {"moving_px", kMovingPx},
                                 {"defocused_px", kDefocusedPx},
                                 {"depth_jump", kDepthJump},
                                 {"outline_reach_px", kOutlineReachPx}})
        report.constants.push_back(constant);
    report.exposure_start = input.exposures.start;
    report.exposure_stop = input.exposures.stop;
    report.exposures = input.exposures.exposures();
    report.tone_mapper = metrics::name_of(mapper);
    return input;
}

Result<sequence::SourceFrame> read_frame(const ExperimentInput& input,
                                         const sequence::RunSettings& run, int frame,
                                         RoleSet wanted) {
    sequence::SequenceReader reader(run.source, run.input,
                                    [&](const sequence::FrameHeader&) { return wanted; });
    ASSIGN_OR_RETURN(const auto opened, reader.open(frame, input.files.at(frame)));
    auto source = reader.read(opened);
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
