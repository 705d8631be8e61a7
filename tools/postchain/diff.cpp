// postchain diff: error metrics of B against the reference A, one image or a sequence.
//
//   file --profile--> color role --> Pair --tools/metrics--> values, error map
//
// HDR-FLIP's exposures come from the references alone; those of a sequence are read once before,
// so that every frame is judged at the same exposures.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tools/io/exr_writer.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/temporal.h"
#include "tools/postchain/exit_code.h"
#include "tools/postchain/log.h"
#include "tools/postchain/stop_on_signal.h"
#include "tools/postchain/verbs.h"

namespace postchain {
namespace {

using Json = nlohmann::ordered_json;
using Values = std::vector<std::pair<std::string, std::optional<double>>>;

constexpr const char* kTde = "tde";  // the one metric that takes more than a pair

struct Frame {
    int number = 0;
    std::string a, b;  // paths
};

struct Limit {
    std::string metric;
    double above = 0;
};

struct Work {
    offline::SourceSettings source;
    std::vector<Frame> frames;
    bool sequence = false;
    metrics::CompareSettings compare;
    bool tde = false;
    std::vector<Limit> limits;
    std::vector<io::PathPattern> maps;
    io::OnExisting on_existing = io::OnExisting::fail;
};

// Color as the file has it, non-finite values included; premultiplied.
struct Color {
    io::InputFrame input;
    ImageF& rgba() { return input.planes.at(Role::color); }
};

Result<Color> read_color(const offline::SourceSettings& settings, const std::string& path,
                         int frame) {
    auto header = offline::open_source_frame(settings, {{Role::color, path}}, frame);
    if (!header.ok()) return header.status();
    auto input =
        io::read_frame(header->files, header->assignment, {Role::color}, io::Keep::nothing);
    if (!input.ok()) return input.status();
    log::detail(concat(path, ": profile ", header->match.profile));
    Color color{std::move(*input)};
    if (header->match.options.unpremultiplied) {
        ImageF& rgba = color.rgba();
        for (size_t i = 0; i < rgba.pixels(); ++i)
            for (size_t c = 0; c < 3; ++c) rgba.data[4 * i + c] *= rgba.data[4 * i + 3];
    }
    return color;
}

Result<metrics::Pair> read_pair(const Work& work, const Frame& frame) {
    const std::string both = frame.a + " against " + frame.b;
    auto a = read_color(work.source, frame.a, frame.number);
    if (!a.ok()) return a.status().at(both);
    auto b = read_color(work.source, frame.b, frame.number);
    if (!b.ok()) return b.status().at(both);
    const auto same = [&](const char* what, const io::Window& wa, const io::Window& wb) {
        if (wa == wb) return Status();
        return Status(StatusCode::input,
                      concat(both, ": ", what, " differ: ", wa.width(), "x", wa.height(), " ",
                             wa.text(), " and ", wb.width(), "x", wb.height(), " ", wb.text()));
    };
    if (Status s = same("display windows", a->input.display_window, b->input.display_window);
        !s.ok())
        return s;
    if (Status s = same("data windows", a->input.data_window, b->input.data_window); !s.ok())
        return s;
    if (a->input.description.luma_weights != b->input.description.luma_weights)
        log::warning(both + ": their chromaticities differ; values are compared as they are");
    auto pair = metrics::pair_of(b->rgba(), a->rgba());
    if (!pair.ok()) return pair.status().at(both);
    return pair;
}

// What typed text asks for -----------------------------------------------------------------------

std::string known_metrics() {
    std::string text;
    for (const auto& row : metrics::metric_rows()) text += row.name + ", ";
    return text + kTde;
}

Status check_metric(const char* option, const std::string& name, bool sequence) {
    if (name != kTde && !metrics::find_metric(name))
        return Status(StatusCode::usage,
                      concat(option, ": no metric '", name, "'; known are ", known_metrics()));
    if (name == kTde && !sequence)
        return Status(StatusCode::usage, concat(option, ": tde needs two frames or more"));
    return Status();
}

Result<Limit> parse_limit(const std::string& text) {
    const size_t equals = text.find('=');
    Limit limit{text.substr(0, equals), 0};
    const char* end = text.data() + text.size();
    const char* begin = equals == std::string::npos ? end : text.data() + equals + 1;
    const auto parsed = std::from_chars(begin, end, limit.above);
    if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(limit.above))
        return Status(StatusCode::usage,
                      "--fail-above: '" + text + "' is not METRIC=NUMBER, as in flip=0.05");
    const auto* row = metrics::find_metric(limit.metric);
    if (row && !row->is_error)
        return Status(StatusCode::usage, "--fail-above: more " + limit.metric +
                                             " is better; name an error, as in mse=0.001");
    return limit;
}

Result<std::vector<Frame>> frames_of(const Options& options, const DiffOptions& diff,
                                     bool& sequence) {
    auto a = io::PathPattern::parse(diff.a);
    if (!a.ok()) return a.status().at("A");
    auto b = io::PathPattern::parse(diff.b);
    if (!b.ok()) return b.status().at("B");
    if (a->has_token() != b->has_token())
        return Status(StatusCode::usage, concat("diff: ", a->text(), " and ", b->text(),
                                                ": one is a sequence, the other one image"));
    sequence = a->has_token();
    if (!sequence) {
        if (!options.frames.empty())
            return Status(StatusCode::usage,
                          "--frames: A and B name one image each; give patterns (A.####.exr)");
        return std::vector<Frame>{{a->literal_frame(), a->text(), b->text()}};
    }
    const auto in_a = a->discover(), in_b = b->discover();
    std::vector<int> numbers;
    if (!options.frames.empty()) {
        auto range = io::FrameRange::parse(options.frames);
        if (!range.ok()) return range.status().at("--frames");
        numbers = range->frames;
    } else {
        for (const auto& [number, path] : in_a) numbers.push_back(number);
        if (numbers.empty())
            return Status(StatusCode::input, a->text() + ": no file matches this pattern");
        std::vector<int> more;
        for (const auto& [number, path] : in_b)
            if (!in_a.count(number)) more.push_back(number);
        if (!more.empty())
            log::warning(concat(b->text(), " has frames that ", a->text(),
                                " has not: ", offline::frames_text(more)));
    }
    std::vector<Frame> frames;
    std::vector<int> not_in_a, not_in_b;
    for (int number : numbers) {
        const auto path_a = in_a.find(number), path_b = in_b.find(number);
        if (path_a == in_a.end()) not_in_a.push_back(number);
        if (path_b == in_b.end()) not_in_b.push_back(number);
        if (path_a != in_a.end() && path_b != in_b.end())
            frames.push_back({number, path_a->second, path_b->second});
    }
    if (not_in_a.empty() && not_in_b.empty()) return frames;
    std::string text = a->text() + " against " + b->text() + ": frames that are not on disk:";
    if (!not_in_a.empty()) text += " of A " + offline::frames_text(not_in_a);
    if (!not_in_b.empty()) text += " of B " + offline::frames_text(not_in_b);
    return Status(StatusCode::input, text);
}

bool ends_with(const std::string& text, const std::string& end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

Status add_maps(const DiffOptions& diff, Work& work) {
    for (const auto& text : diff.maps) {
        auto pattern = io::PathPattern::parse(text);
        if (!pattern.ok()) return pattern.status().at("--map");
        if (!ends_with(text, ".png") && !ends_with(text, ".exr"))
            return Status(StatusCode::usage, "--map: " + text + " is neither .png nor .exr");
        if (work.sequence && !pattern->has_token() && work.frames.size() > 1)
            return Status(StatusCode::usage,
                          "--map: " + text + " would be written for every frame; give a pattern");
        for (const auto& frame : work.frames)
            for (const auto& input : {frame.a, frame.b}) {
                std::error_code ignored;
                if (std::filesystem::equivalent(pattern->format(frame.number), input, ignored))
                    return Status(StatusCode::usage,
                                  "--map: " + input + " is one of the images to be compared");
            }
        work.maps.push_back(std::move(*pattern));
    }
    if (!diff.map_metric.empty() && !metrics::find_map(diff.map_metric)) {
        std::string known;
        for (const auto& row : metrics::map_rows()) known += (known.empty() ? "" : ", ") + row.name;
        return Status(StatusCode::usage, concat("--map-metric: no error map '", diff.map_metric,
                                                "'; known are ", known));
    }
    if (!work.maps.empty()) work.compare.map = diff.map_metric;
    return Status();
}

Result<Work> work_of(const Options& options, const DiffOptions& diff) {
    Work work;
    auto frames = frames_of(options, diff, work.sequence);
    if (!frames.ok()) return frames.status();
    work.frames = std::move(*frames);
    if (!options.profile.empty()) {
        auto profile = find_profile(options.profile);
        if (!profile.ok()) return profile.status().at("--profile");
        work.source.profile = std::move(*profile);
    }
    work.source.layer = options.layer;
    work.source.view = options.view;
    work.on_existing =
        options.on_existing == "overwrite" ? io::OnExisting::overwrite : io::OnExisting::fail;

    const bool many = work.frames.size() > 1;
    for (const auto& row : metrics::metric_rows())
        if (diff.metrics.empty()) work.compare.metrics.insert(row.name);
    work.tde = diff.metrics.empty() && many;
    const auto want = [&](const char* option, const std::string& name) {
        if (Status status = check_metric(option, name, many); !status.ok()) return status;
        if (name == kTde)
            work.tde = true;
        else
            work.compare.metrics.insert(name);
        return Status();
    };
    for (const auto& name : diff.metrics)
        if (Status status = want("--metric", name); !status.ok()) return status;
    for (const auto& text : diff.fail_above) {
        auto limit = parse_limit(text);
        if (!limit.ok()) return limit.status();
        if (Status status = want("--fail-above", limit->metric); !status.ok()) return status;
        work.limits.push_back(std::move(*limit));
    }
    // Only tde asked for: an empty set would mean all others.
    if (work.compare.metrics.empty()) work.compare.metrics.insert("nonfinite");
    work.compare.flip.pixels_per_degree = diff.pixels_per_degree;
    for (auto mapper :
         {metrics::ToneMapper::aces, metrics::ToneMapper::reinhard, metrics::ToneMapper::hable})
        if (diff.tone_mapper == metrics::name_of(mapper)) work.compare.flip.tone_mapper = mapper;
    work.compare.flip.threads = threads_of(options);
    if (Status status = add_maps(diff, work); !status.ok()) return status;
    return work;
}

// Exposures of a sequence: from every reference.
Status find_exposures(Work& work, const StopOnSignal& stop) {
    metrics::ExposureRange range;
    for (size_t i = 0; i < work.frames.size() && !stop.asked(); ++i) {
        const Frame& frame = work.frames[i];
        log::progress(concat("exposures of ", frame.a));
        auto color = read_color(work.source, frame.a, frame.number);
        if (!color.ok()) return color.status().at(frame.a + " against " + frame.b);
        auto picture = metrics::picture_of(color->rgba());
        if (!picture.ok()) return picture.status().at(frame.a);
        range = metrics::joined(range,
                                metrics::exposure_range(*picture, work.compare.flip.tone_mapper));
    }
    work.compare.exposures = range;
    return Status();
}

// What is said ------------------------------------------------------------------------------------

Json to_json(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

Json settings_json(const Work& work, const metrics::ExposureRange& range) {
    const auto& flip = work.compare.flip;
    Json json = {{"pixels_per_degree", flip.pixels_per_degree}};
    if (work.compare.metrics.count("hdr_flip") || work.compare.map == "hdr_flip") {
        json["tone_mapper"] = metrics::name_of(flip.tone_mapper);
        json["exposure_start"] = range.start;
        json["exposure_stop"] = range.stop;
        json["exposures"] = range.count();
    }
    for (const auto& [name, value] : metrics::metric_constants()) json[name] = value;
    return json;
}

std::string number_text(const std::optional<double>& value) {
    if (!value) return "none";
    char text[32];
    std::snprintf(text, sizeof(text), "%.6g", *value);
    return text;
}

void print_line(const Json& json) {
    std::printf("%s\n", json.dump(-1, ' ', false, Json::error_handler_t::replace).c_str());
    std::fflush(stdout);
}

void print_table(const Values& values) {
    for (const auto& [name, value] : values)
        std::printf("  %-16s %s\n", name.c_str(), number_text(value).c_str());
}

void print_settings(const Json& settings) {
    std::string text = "with";
    for (const auto& [name, value] : settings.items())
        text += " " + name + " " +
                (value.is_string() ? value.get<std::string>() : number_text(value.get<double>()));
    std::printf("%s\n", text.c_str());
}

// Mean over the frames that have a value; sums of counts, largest of maxima.
Values summary_of(const std::vector<Values>& frames) {
    Values summary;
    for (size_t i = 0; i < frames.front().size(); ++i) {
        const std::string& name = frames.front()[i].first;
        double sum = 0, largest = 0;
        size_t count = 0;
        for (const auto& values : frames)
            if (const auto& value = values[i].second) {
                sum += *value;
                largest = std::max(largest, *value);
                ++count;
            }
        std::optional<double> value;
        if (name == "nonfinite")
            value = sum;
        else if (name == "difference_max")
            value = largest;
        else if (count > 0)
            value = sum / double(count);
        summary.emplace_back(name, value);
    }
    return summary;
}

// Complains about each limit that is broken; true when one is.
bool exceeds(const Work& work, const Values& values, const std::string& where) {
    bool exceeded = false;
    for (const auto& limit : work.limits)
        for (const auto& [name, value] : values) {
            if (name != limit.metric || !value || !(*value > limit.above)) continue;
            exceeded = true;
            log::error(concat(where, ": ", name, " ", number_text(value), " is above ",
                              number_text(limit.above)));
        }
    return exceeded;
}

// Magma over 0..shown_max as PNG, the values themselves as EXR.
Status write_map(const Work& work, const std::string& path, const ImageF& map) {
    const auto& row = *metrics::find_map(work.compare.map);
    if (ends_with(path, ".exr"))
        return io::write_planes_exr(path, map, {"Y"}, work.on_existing).status();
    ImageF shown = map;
    for (float& v : shown.data) v = std::clamp(v / float(row.shown_max), 0.0f, 1.0f);
    ImageF colors(map.width, map.height, 3);
    const OIIO::ImageBuf from(OIIO::ImageSpec(map.width, map.height, 1, OIIO::TypeDesc::FLOAT),
                              shown.data.data());
    OIIO::ImageBuf to(OIIO::ImageSpec(map.width, map.height, 3, OIIO::TypeDesc::FLOAT),
                      colors.data.data());
    if (!OIIO::ImageBufAlgo::color_map(to, from, 0, "magma"))
        return Status(StatusCode::internal, path + ": " + to.geterror());
    return io::write_png_preview(path, colors, {0, io::ToneCurve::none, work.on_existing});
}

Status write_maps(const Work& work, const Frame& frame, const ImageF& map) {
    for (const auto& pattern : work.maps)
        if (Status status = write_map(work, pattern.format(frame.number), map); !status.ok())
            return status;
    return Status();
}

}  // namespace

void add_diff(CLI::App& verb, Options& o, DiffOptions& diff) {
    diff.pixels_per_degree = metrics::kPixelsPerDegree;
    std::string names, maps;
    for (const auto& row : metrics::metric_rows()) names += row.name + " (" + row.help + "), ";
    for (const auto& row : metrics::map_rows())
        maps += concat(maps.empty() ? "" : ", ", row.name, " (", row.help, "; brightest at ",
                       row.shown_max, ")");
    verb.add_option("A", diff.a, "reference: an image, or a sequence A.####.exr")->required();
    verb.add_option("B", diff.b, "what is held against it, of the same kind")->required();
    verb.add_option("--frames", o.frames,
                    "which frames of sequences: 1-10,20-40x2 (default: all "
                    "of A on disk)")
        ->type_name("RANGE");
    verb.add_option("--metric", diff.metrics,
                    "one metric, may be repeated (default: all): " + names +
                        "tde (mean |change of the error| from frame to frame)")
        ->type_name("NAME")
        ->expected(1)
        ->take_all();
    verb.add_option("--fail-above", diff.fail_above,
                    "exit with 8 when a frame or the summary is above it, may be repeated: "
                    "flip=0.05")
        ->type_name("METRIC=NUMBER")
        ->expected(1)
        ->take_all();
    verb.add_option("--map", diff.maps,
                    "error map, may be repeated: .png in magma colors, .exr with the values; a "
                    "pattern for sequences")
        ->type_name("FILE")
        ->expected(1)
        ->take_all();
    verb.add_option("--map-metric", diff.map_metric, "error of the map: " + maps)
        ->type_name("NAME")
        ->capture_default_str();
    verb.add_option("--on-existing", o.on_existing, "when a map exists")
        ->check(CLI::IsMember({"fail", "overwrite"}))
        ->capture_default_str();
    verb.add_option("--ppd", diff.pixels_per_degree, "pixels per degree of visual angle, for FLIP")
        ->check(CLI::Range(metrics::kMinPixelsPerDegree, metrics::kMaxPixelsPerDegree))
        ->capture_default_str();
    verb.add_option("--tone-mapper", diff.tone_mapper, "of HDR-FLIP")
        ->check(CLI::IsMember({"aces", "reinhard", "hable"}))
        ->capture_default_str();
    verb.add_option("--profile", o.profile, "names of the writer, for both (default: detected)")
        ->type_name("NAME");
    verb.add_option("--layer", o.layer, "layer to take where there are several")->type_name("NAME");
    verb.add_option("--view", o.view, "view to take of a multi-view file")->type_name("NAME");
    verb.add_option("--threads", o.threads, "CPU threads (default: all cores)")
        ->check(CLI::Range(1, 1024));
    verb.add_flag("--json", o.json,
                  "one JSON object per frame; for sequences a last one with "
                  "\"summary\": true");
}

int diff_verb(const Options& options, const DiffOptions& diff) {
    auto made = work_of(options, diff);
    if (!made.ok()) return fail(made.status());
    Work& work = *made;
    io::set_exr_threads(threads_of(options));
    const StopOnSignal stop;
    const bool hdr = work.compare.metrics.count("hdr_flip") > 0 || work.compare.map == "hdr_flip";
    if (hdr && work.frames.size() > 1)
        if (Status status = find_exposures(work, stop); !status.ok()) return fail(status);

    std::vector<Values> all;
    metrics::TemporalError temporal;
    metrics::ExposureRange exposures;
    bool exceeded = false;
    for (const Frame& frame : work.frames) {
        if (stop.asked()) break;
        log::progress(
            concat("frame ", frame.number, ", ", all.size(), " of ", work.frames.size(), " done"));
        auto pair = read_pair(work, frame);
        if (!pair.ok()) return fail(pair.status());
        auto compared = metrics::compare(*pair, work.compare);
        if (!compared.ok()) return fail(compared.status());
        exposures = compared->exposures;
        Values values = compared->values;
        if (work.tde) {
            if (Status status = temporal.add(*pair); !status.ok())
                return fail(status.at(frame.a + " against the frame before"));
            values.emplace_back(kTde, temporal.last());
        }
        if (const auto bad = pair->reference.nonfinite)
            log::warning(concat(frame.a, ": ", bad, " pixels of the reference are not finite, ",
                                "taken as 0"));
        if (Status status = write_maps(work, frame, compared->map); !status.ok())
            return fail(status);

        log::progress("");
        if (options.json) {
            Json json = {{"frame", frame.number}, {"a", frame.a}, {"b", frame.b}};
            for (const auto& [name, value] : values) json[name] = to_json(value);
            json["nonfinite_reference"] = pair->reference.nonfinite;
            if (!work.sequence) json["settings"] = settings_json(work, exposures);
            print_line(json);
        } else if (work.sequence) {
            std::string text = concat("frame ", frame.number, ":");
            for (const auto& [name, value] : values) text += " " + name + " " + number_text(value);
            std::printf("%s\n", text.c_str());
            std::fflush(stdout);
        } else {
            std::printf("%s against %s\n", frame.b.c_str(), frame.a.c_str());
            print_table(values);
        }
        exceeded |= exceeds(work, values, frame.b);
        all.push_back(std::move(values));
    }
    if (stop.asked()) return stop.exit_code();

    const Json settings = settings_json(work, exposures);
    if (work.sequence) {
        Values summary = summary_of(all);
        if (options.json) {
            Json json = {{"summary", true}, {"frames", all.size()}, {"a", diff.a}, {"b", diff.b}};
            for (const auto& [name, value] : summary) json[name] = to_json(value);
            json["settings"] = settings;
            print_line(json);
        } else {
            std::printf("%s against %s, %zu frames\n", diff.b.c_str(), diff.a.c_str(), all.size());
            print_table(summary);
        }
        exceeded |= exceeds(work, summary, diff.b);
    }
    if (!options.json) print_settings(settings);
    if (!work.maps.empty()) {
        const auto& row = *metrics::find_map(work.compare.map);
        log::info(concat("error maps of ", row.name, ": magma over 0..", row.shown_max,
                         " in PNG, the values in EXR"));
    }
    return exceeded ? kExitThreshold : kExitOk;
}

}  // namespace postchain
