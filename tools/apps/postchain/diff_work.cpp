#include "tools/apps/postchain/diff_work.h"

#include "tools/apps/postchain/log.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory.h"

namespace postchain {
namespace {

std::string known_metrics() {
    std::string text;
    for (const auto& row : metrics::metric_rows()) text += row.name + ", ";
    return text + kTde;
}

Status check_metric(const char* option, const std::string& name, bool sequence) {
    if (name != kTde && !metrics::find_metric(name))
        return Status(StatusCode::usage,
                      concat(option, ": unknown metric '", name, "'; known are ", known_metrics()));
    if (name == kTde && !sequence)
        return Status(StatusCode::usage, concat(option, ": tde needs two frames or more"));
    return Status();
}

Result<metrics::MetricLimit> limit_of(const std::string& text) {
    ASSIGN_OR_RETURN(auto limit, metrics::parse_limit("--fail-above", text));
    const auto* row = metrics::find_metric(limit.metric);
    if (row && !row->is_error)
        return Status(StatusCode::usage, "--fail-above: higher " + limit.metric +
                                             " is better; use an error metric, e.g. mse=0.001");
    return limit;
}

Result<std::vector<DiffFrame>> frames_of(const Options& options, const DiffOptions& diff,
                                         DiffWork& work) {
    bool& sequence = work.sequence;
    auto a = io::PathPattern::parse(diff.a);
    if (!a.ok()) return a.status().at("A");
    auto b = io::PathPattern::parse(diff.b);
    if (!b.ok()) return b.status().at("B");
    if (a->has_token() != b->has_token())
        return Status(StatusCode::usage, concat("diff: ", a->text(), " and ", b->text(),
                                                ": one is a sequence, the other a single image"));
    work.files.read(*a, "the reference");
    work.files.read(*b, "the compared image");
    if (!options.job.profile.empty()) work.files.read({options.job.profile, "the profile"});
    sequence = a->has_token();
    if (!sequence) {
        if (!options.job.frames.empty())
            return Status(StatusCode::usage,
                          "--frames: A and B are single images; give patterns (A.####.exr)");
        return std::vector<DiffFrame>{{a->literal_frame(), a->text(), b->text()}};
    }
    const auto in_a = a->discover(), in_b = b->discover();
    std::vector<int> numbers;
    if (!options.job.frames.empty()) {
        auto range = io::FrameRange::parse(options.job.frames);
        if (!range.ok()) return range.status().at("--frames");
        numbers = range->frames;
    } else {
        for (const auto& [number, path] : in_a) numbers.push_back(number);
        if (numbers.empty()) return Status(StatusCode::input, a->text() + ": " + io::why_none(*a));
        std::vector<int> more;
        for (const auto& [number, path] : in_b)
            if (!in_a.count(number)) more.push_back(number);
        if (!more.empty())
            log::warning(concat(b->text(), " has frames that ", a->text(),
                                " lacks: ", sequence::frames_text(more)));
    }
    std::vector<DiffFrame> frames;
    std::vector<int> not_in_a, not_in_b;
    for (int number : numbers) {
        const auto path_a = in_a.find(number), path_b = in_b.find(number);
        if (path_a == in_a.end()) not_in_a.push_back(number);
        if (path_b == in_b.end()) not_in_b.push_back(number);
        if (path_a != in_a.end() && path_b != in_b.end())
            frames.push_back({number, path_a->second, path_b->second});
    }
    if (not_in_a.empty() && not_in_b.empty()) return frames;
    std::string text = a->text() + " against " + b->text() + ": frames missing on disk:";
    if (!not_in_a.empty()) text += " of A " + sequence::frames_text(not_in_a);
    if (!not_in_b.empty()) text += " of B " + sequence::frames_text(not_in_b);
    return Status(StatusCode::input, text);
}

Status add_maps(const DiffOptions& diff, DiffWork& work) {
    for (const auto& text : diff.maps) {
        auto pattern = io::PathPattern::parse(text);
        if (!pattern.ok()) return pattern.status().at("--map");
        if (!text.ends_with(".png") && !text.ends_with(".exr"))
            return Status(StatusCode::usage, "--map: " + text + " is neither .png nor .exr");
        if (work.sequence && !pattern->has_token() && work.frames.size() > 1)
            return Status(StatusCode::usage,
                          "--map: " + text + " is the same file for every frame; give a pattern");
        for (const auto& frame : work.frames)
            work.files.write(io::OutputFile{pattern->format(frame.number),
                                            concat("the error map of frame ", frame.number),
                                            "name another map with --map"});
        work.maps.push_back(std::move(*pattern));
    }
    if (!diff.map_metric.empty() && !metrics::find_map(diff.map_metric)) {
        std::string known;
        for (const auto& row : metrics::map_rows()) known += (known.empty() ? "" : ", ") + row.name;
        return Status(StatusCode::usage, concat("--map-metric: unknown error map '",
                                                diff.map_metric, "'; known are ", known));
    }
    if (!work.maps.empty())
        work.compare.map = diff.map_metric.empty() ? kDefaultMap : diff.map_metric;
    RETURN_IF_ERROR(work.files.check());
    work.files.remove_left_temporaries();
    return Status();
}

// No option is without effect.
Status check_read(const DiffOptions& diff, const DiffWork& work) {
    const auto unread = [](const char* option, const char* what) {
        return Status(StatusCode::usage, concat(option, ": has an effect on ", what,
                                                " only, which is not asked for; ask for it, or "
                                                "leave the option out"));
    };
    if (!diff.map_metric.empty() && work.maps.empty()) return unread("--map-metric", "--map");
    if (!diff.tone_mapper.empty() && !work.wants("hdr_flip"))
        return unread("--tone-mapper", "hdr_flip");
    if (diff.pixels_per_degree && !work.wants("hdr_flip") && !work.wants("flip"))
        return unread("--ppd", "flip or hdr_flip");
    return Status();
}

Result<sequence::ColorFile> read_logged(const DiffWork& work, const std::string& path, int frame) {
    auto color = sequence::read_color(work.source, path, frame);
    if (color.ok()) log::detail(concat(path, ": profile ", color->profile));
    return color;
}

}  // namespace

Result<DiffWork> work_of(const Options& options, const DiffOptions& diff) {
    DiffWork work;
    work.files = io::OutputFiles(diff.on_existing);
    ASSIGN_OR_RETURN(work.frames, frames_of(options, diff, work));
    if (!options.job.profile.empty()) {
        auto profile = find_profile(options.job.profile);
        if (!profile.ok()) return profile.status().at("--profile");
        work.source.profile = std::move(*profile);
    }
    work.source.layer = options.job.layer;
    work.source.view = options.job.view;
    ASSIGN_OR_RETURN(work.source.max_memory, sequence::memory_limit_of(options.job.max_memory));
    const bool many = work.frames.size() > 1;
    for (const auto& row : metrics::metric_rows())
        if (diff.metrics.empty()) work.compare.metrics.insert(row.name);
    work.tde = diff.metrics.empty() && many;
    const auto want = [&](const char* option, const std::string& name) {
        RETURN_IF_ERROR(check_metric(option, name, many));
        if (name == kTde)
            work.tde = true;
        else
            work.compare.metrics.insert(name);
        return Status();
    };
    for (const auto& name : diff.metrics) RETURN_IF_ERROR(want("--metric", name));
    for (const auto& text : diff.fail_above) {
        ASSIGN_OR_RETURN(auto limit, limit_of(text));
        RETURN_IF_ERROR(want("--fail-above", limit.metric));
        work.limits.push_back(std::move(limit));
    }
    // If only tde is requested, the set must not be empty: that would select all metrics.
    if (work.compare.metrics.empty()) work.compare.metrics.insert("nonfinite");
    work.over = diff.over;
    if (diff.pixels_per_degree) work.compare.flip.pixels_per_degree = *diff.pixels_per_degree;
    // The parser has checked the name.
    if (!diff.tone_mapper.empty())
        work.compare.flip.tone_mapper = *metrics::find_tone_mapper(diff.tone_mapper);
    work.compare.flip.threads = threads_of(options);
    RETURN_IF_ERROR(add_maps(diff, work));
    RETURN_IF_ERROR(check_read(diff, work));
    return work;
}

Result<metrics::Pair> read_pair(const DiffWork& work, const DiffFrame& frame) {
    const std::string both = frame.both();
    auto a = read_logged(work, frame.a, frame.number);
    if (!a.ok()) return a.status().at(both);
    auto b = read_logged(work, frame.b, frame.number);
    if (!b.ok()) return b.status().at(both);
    const auto same = [&](const char* what, const io::Window& wa, const io::Window& wb) {
        if (wa == wb) return Status();
        return Status(StatusCode::input,
                      concat(both, ": ", what, " differ: ", wa.width(), "x", wa.height(), " ",
                             wa.text(), " and ", wb.width(), "x", wb.height(), " ", wb.text()));
    };
    const io::Window& display = a->input.display_window;
    RETURN_IF_ERROR(same("display windows", display, b->input.display_window));
    if (a->input.window != b->input.window) {
        log::info(concat(both, ": data windows differ, ", a->input.window.text(), " and ",
                         b->input.window.text(), ": compared in the display window ",
                         display.text(), "; missing pixels count as clear"));
        for (sequence::ColorFile* color : {&*a, &*b})
            color->rgba() = io::placed(color->rgba(), color->input.window, display);
    }
    if (work.over)
        for (sequence::ColorFile* color : {&*a, &*b})
            metrics::composite_over(color->rgba(), *work.over);
    if (a->input.description.luma_weights != b->input.description.luma_weights)
        log::warning(both + ": chromaticities differ; values are compared without conversion");
    auto pair = metrics::pair_of(b->rgba(), a->rgba());
    if (!pair.ok()) return pair.status().at(both);
    return pair;
}

Result<metrics::RgbImage> read_reference(const DiffWork& work, const DiffFrame& frame) {
    auto color = read_logged(work, frame.a, frame.number);
    if (!color.ok()) return color.status().at(frame.both());
    if (work.over) metrics::composite_over(color->rgba(), *work.over);
    auto image = metrics::rgb_image_of(color->rgba());
    if (!image.ok()) return image.status().at(frame.a);
    return image;
}

}  // namespace postchain
