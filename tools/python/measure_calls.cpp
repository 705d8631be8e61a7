#include "tools/python/measure_calls.h"

#include <set>

#include "chain/base/text.h"
#include "config/camera_file.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/temporal.h"
#include "tools/python/array_file.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/source/frame_source.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// An image to compare: pixels, or a file to read them from.
struct Picture {
    ImageF pixels;
    std::string path;
    int frame = 0;

    std::string name() const { return path.empty() ? "the array" : path; }
};

struct Side {
    std::vector<Picture> pictures;
    bool is_sequence = false;
};

Side side_of(const char* argument, const py::object& value) {
    Side side;
    const auto add = [&](const py::object& one) {
        if (py::isinstance<py::array>(one))
            side.pictures.push_back({image_of(argument, one), "", int(side.pictures.size())});
        else
            side.pictures.push_back({{}, path_of(one, argument), int(side.pictures.size())});
    };
    const bool is_path = py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
    if (is_path) {
        const auto pattern = value_of(io::PathPattern::parse(path_of(value, argument)));
        side.is_sequence = pattern.has_token();
        if (!side.is_sequence) {
            add(value);
            return side;
        }
        for (const auto& [number, path] : pattern.discover())
            side.pictures.push_back({{}, path, number});
        if (side.pictures.empty())
            raise(Status(StatusCode::input, pattern.text() + ": " + io::why_none(pattern)));
    } else if (py::isinstance<py::array>(value) || !py::isinstance<py::iterable>(value)) {
        add(value);
    } else {
        side.is_sequence = true;
        for (const py::handle one : value) add(py::reinterpret_borrow<py::object>(one));
        if (side.pictures.empty()) raise_usage(argument, ": is empty; give an image");
    }
    return side;
}

Status stopped() {
    return Status(StatusCode::canceled, "diff: stopped");
}

class Comparer {
  public:
    Comparer(const sequence::SourceSettings& source, const DiffRequest& request,
             metrics::CompareSettings settings, std::set<std::string> temporal)
        : source_(source),
          request_(request),
          settings_(std::move(settings)),
          temporal_(std::move(temporal)) {}

    struct Frame {
        metrics::Values values;
        ImageF map;
    };

    // The exposures of all references together.
    Status find_exposures(const std::vector<Picture>& references, const std::atomic<bool>& stop) {
        metrics::ExposureRange range;
        for (const Picture& reference : references) {
            if (stop) return stopped();
            ASSIGN_OR_RETURN(auto pixels, read(reference));
            ASSIGN_OR_RETURN(const auto image, metrics::rgb_image_of(pixels).at(reference.name()));
            range =
                metrics::joined(range, metrics::exposure_range(image, settings_.flip.tone_mapper));
        }
        settings_.exposures = range;
        return Status();
    }

    Result<Frame> compare(const Picture& reference, const Picture& test) {
        ASSIGN_OR_RETURN(auto expected, read(reference));
        ASSIGN_OR_RETURN(auto found, read(test));
        const auto at = [&](const Status& status) {
            return status.at(reference.name() + " against " + test.name());
        };
        auto pair = metrics::pair_of(found, expected);
        if (!pair.ok()) return at(pair.status());
        ASSIGN_OR_RETURN(auto compared, metrics::compare(*pair, settings_));
        Frame frame{std::move(compared.values), std::move(compared.map)};
        if (temporal_.empty()) return frame;
        if (const Status status = temporal_error_.add(*pair); !status.ok()) return at(status);
        for (const auto& value : temporal_error_.last())
            if (temporal_.contains(value.first)) frame.values.push_back(value);
        return frame;
    }

  private:
    Result<ImageF> read(const Picture& picture) const {
        ImageF pixels = picture.pixels;
        if (!picture.path.empty()) {
            ASSIGN_OR_RETURN(auto color,
                             sequence::read_color(source_, picture.path, picture.frame));
            pixels = io::placed(color.rgba, color.window, color.display_window);
        }
        if (request_.over && pixels.channels == 4) metrics::composite_over(pixels, *request_.over);
        return pixels;
    }

    const sequence::SourceSettings& source_;
    const DiffRequest& request_;
    metrics::CompareSettings settings_;
    const std::set<std::string> temporal_;
    metrics::TemporalError temporal_error_;
};

py::dict dict_of(const metrics::Values& values) {
    py::dict dict;
    for (const auto& [name, value] : values)
        dict[name.c_str()] = value ? py::object(py::float_(*value)) : py::object(py::none());
    return dict;
}

// temporal: those of metrics::temporal_rows() that are requested.
metrics::CompareSettings compare_settings(const DiffRequest& request, bool sequence,
                                          std::set<std::string>& temporal) {
    metrics::CompareSettings settings;
    for (const auto& row : metrics::temporal_rows())
        if (sequence && request.metrics.empty()) temporal.insert(row.name);
    for (const std::string& name : request.metrics) {
        const bool is_temporal = metrics::is_temporal(name);
        if (is_temporal && !sequence)
            raise_usage("metrics: ", name, " needs two frames or more; give lists");
        (is_temporal ? temporal : settings.metrics).insert(name);
    }
    // An empty set would be all metrics.
    if (settings.metrics.empty() && !request.metrics.empty()) settings.metrics.insert("nonfinite");
    settings.map = request.map;
    const double ppd = request.pixels_per_degree;
    if (!(ppd >= metrics::kMinPixelsPerDegree && ppd <= metrics::kMaxPixelsPerDegree))
        raise_usage("pixels_per_degree: ", ppd, " is not in ", metrics::kMinPixelsPerDegree, "..",
                    metrics::kMaxPixelsPerDegree);
    settings.flip.pixels_per_degree = ppd;
    const auto mapper = metrics::find_tone_mapper(request.tone_mapper);
    if (!mapper)
        raise_usage("tone_mapper: unknown tone mapper '", request.tone_mapper, "'; known are ",
                    joined(metrics::tone_mapper_names()));
    settings.flip.tone_mapper = *mapper;
    return settings;
}

}  // namespace

py::dict diff(const py::object& reference, const py::object& test, const DiffRequest& request,
              const py::kwargs& values) {
    const Side a = side_of("reference", reference), b = side_of("test", test);
    if (a.is_sequence != b.is_sequence || a.pictures.size() != b.pictures.size())
        raise_usage("diff: ", a.pictures.size(), " references and ", b.pictures.size(),
                    " images; give one of each, or as many");
    for (size_t i = 0; i < a.pictures.size(); ++i)
        if (!a.pictures[i].path.empty() && !b.pictures[i].path.empty() && a.is_sequence &&
            a.pictures[i].frame != b.pictures[i].frame)
            raise(Status(StatusCode::input,
                         concat(a.pictures[i].path, " against ", b.pictures[i].path,
                                ": the frames of the patterns differ; give lists of files")));
    std::set<std::string> temporal;
    const bool many = a.pictures.size() > 1;
    const metrics::CompareSettings settings = compare_settings(request, many, temporal);
    const sequence::SourceSettings source =
        job_settings("diff", "frame.exr", "", py::none(), values, file_keys()).source;
    std::vector<Comparer::Frame> frames;
    const Status status = in_background("diff", [&](Call& call) -> Status {
        Comparer comparer(source, request, settings, temporal);
        if (many) RETURN_IF_ERROR(comparer.find_exposures(a.pictures, call.stop()));
        for (size_t i = 0; i < a.pictures.size(); ++i) {
            if (call.stop()) return stopped();
            ASSIGN_OR_RETURN(auto frame, comparer.compare(a.pictures[i], b.pictures[i]));
            frames.push_back(std::move(frame));
        }
        return Status();
    });
    if (!status.ok()) raise(status);
    py::list listed;
    std::vector<metrics::Values> all;
    for (Comparer::Frame& frame : frames) {
        py::dict one = dict_of(frame.values);
        if (!request.map.empty()) one["map"] = array_of(std::move(frame.map));
        listed.append(one);
        all.push_back(std::move(frame.values));
    }
    if (!a.is_sequence) return listed[0];
    py::dict result;
    result["frames"] = listed;
    result["summary"] = dict_of(metrics::summary_of(all));
    return result;
}

void write_scene(scenes::SceneRequest request, const py::object& frames,
                 const std::string& on_existing, const py::object& camera,
                 const std::string& device, const Callbacks& callbacks) {
    callbacks.check();
    const int width = request.width, height = request.height;
    if (width < 1 || height < 1 || width > io::kMaxSide || height > io::kMaxSide)
        raise_usage("size: ", width, "x", height, ": sides are 1..", io::kMaxSide);
    const Parameter& row = *job_parameters().find("frames");
    const auto text = std::get<std::string>(parameter_value(frames, row));
    request.frames = value_of(io::FrameRange::parse(text)).frames;
    sequence::JobSettings job;
    py::kwargs words;
    words["on_existing"] = on_existing;
    set_rows(job_parameters(), &job, words, "scene");
    if (job.on_existing == io::OnExisting::skip)
        raise_usage("on_existing: a scene has no frames to skip; give fail or overwrite");
    request.on_existing = job.on_existing;
    if (!camera.is_none() && !py::isinstance<py::dict>(camera))
        raise_usage("camera: is a ", type_of(camera), "; give a dict");
    if (!camera.is_none() && py::len(camera) > 0)
        request.camera = camera_of(camera.cast<py::dict>()).camera;
    if (auto model = scenes::model_for(request); !model.ok()) raise(model.status());
    std::vector<std::string> warnings;
    const egl::ContextOptions context = context_options(device, warnings);
    bool stopped = false;
    const Status status = in_background(
        "scene",
        [&](Call& call) -> Status {
            ASSIGN_OR_RETURN(auto renderer, scenes::SceneRenderer::create(context));
            return scenes::write_scene(
                *renderer, request, [&](const scenes::SceneProgress& progress) {
                    if (!callbacks.progress.is_none())
                        call.send([&, progress] {
                            py::dict report;
                            report["frame"] = progress.frame;
                            report["picture"] = scenes::name_of(progress.picture);
                            report["done"] = progress.done;
                            if (callbacks.ended_by(report)) call.ask_to_stop();
                        });
                    return !call.stop();
                });
        },
        callbacks.watch(stopped));
    if (!status.ok()) raise(status);
    warn(warnings);
}

}  // namespace postchain::python
