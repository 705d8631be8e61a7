#include "tools/sequence/record/fingerprint.h"

#include <filesystem>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/record/sidecar.h"

namespace postchain::sequence {

namespace fs = std::filesystem;

namespace {

// Sizes and times of an OpenColorIO configuration and the tables it names, and its variables.
std::string text_of_config(const std::string& config) {
    io::OcioSources sources = {{config}, {}};
    const auto module = io::image_module(StatusCode::input);
    if (module.ok())
        if (auto found = (*module)->ocio_sources(config); found.ok()) sources = std::move(*found);
    std::string text;
    for (const auto& [name, value] : sources.variables)
        text += concat("variable ", name, " ", quoted(value), "\n");
    for (const std::string& path : sources.files) {
        const auto file = io::FileStamp::of(path);
        text += concat("configuration ", file.bytes, " ", file.time, "\n");
    }
    return text;
}

// Everything that decides a frame's canonical planes, in addition to SourceSettings.
std::string text_of_frame(const FrameHeader& header) {
    std::string text = header.camera.text() + "\n";
    if (header.sky) text += header.sky->text() + "\n";
    if (header.zoom)
        text += concat("zoom ", text_of(ParameterValue(header.zoom->before)), " ",
                       text_of(ParameterValue(header.zoom->after)), "\n");
    if (header.makes_motion) {
        text += "motion from the camera";
        for (const SkyView* view : {&header.sky->now, &header.sky->before, &header.sky->after})
            for (double value : *view->position) text += " " + text_of(ParameterValue(value));
        text += "\n";
    }
    const auto& options = header.match.options;
    for (const auto* motion : {&options.motion, &options.motion_back})
        text += concat(int(motion->unit), " ", motion->scale_x, " ", motion->scale_y, " ",
                       motion->bias, " ", motion->sentinel, "\n");
    text += concat(int(options.depth), " ", options.unpremultiplied, "\n");
    if (const io::Window& own = color_part(header).data_window; header.window != own)
        text += "window " + header.window.text() + "\n";
    for (const auto& [role, where] : header.match.roles) {
        text += concat(postchain::name_of(role), " ", where.part);
        for (const auto& channel : where.channels) text += " " + channel;
        text += "\n";
    }
    text += header.layers.text();
    for (const std::string& view : header.match.other_views) text += "view " + view + "\n";
    for (const auto& [role, file] : header.files.stamps)
        text +=
            concat(fs::path(file.path).filename().string(), " ", file.bytes, " ", file.time, "\n");
    return text;
}

}  // namespace

std::string provenance_of(const std::string& fingerprint, bool strict) {
    return fingerprint + (strict ? " strict" : "");
}

std::string preview_provenance_of(const std::string& fingerprint, const RunSettings& settings) {
    std::string text = "curve";
    if (settings.view)
        text = io::description_of(*settings.view) + "\n" + text_of_config(settings.view->config);
    return concat(fingerprint, " shown ", hex_of(hash_text(text)));
}

Status check_whole(io::ExrFile& file) {
    for (size_t part = 0; part < file.parts().size(); ++part) {
        if (file.parts()[part].deep) continue;
        RETURN_IF_ERROR(file.read_part(int(part)).status());
    }
    return Status();
}

bool is_done(const std::string& output, const std::string& fingerprint,
             const RunSettings& settings) {
    std::error_code error;
    if (settings.preview && io::preview_provenance(io::preview_path(output)) !=
                                preview_provenance_of(fingerprint, settings))
        return false;
    const std::string sidecar = sidecar_path(output);
    const auto json = io::read_json(text_of_file(sidecar), sidecar);
    const auto sidecar_says = [&](const std::string& provenance, uint64_t bytes) {
        return json.ok() && json->is_object() && json->value("work", io::Json()) == provenance &&
               json->value("output_bytes", io::Json()) == bytes;
    };
    const std::string made[] = {provenance_of(fingerprint, settings.strict),
                                provenance_of(fingerprint, true)};
    // Not every format other than EXR can hold an attribute, so only the sidecar is checked.
    if (io::image_format_of(output)) {
        const auto bytes = fs::file_size(output, error);
        return !error && (sidecar_says(made[0], bytes) || sidecar_says(made[1], bytes));
    }
    auto existing = io::ExrFile::open(output);
    if (!existing.ok()) return false;
    std::string provenance;
    for (const auto& part : existing->parts()) {
        const auto found = part.attributes.find("postchain");
        if (found == part.attributes.end()) continue;
        for (const std::string& one : made)
            if (found->second == one) provenance = one;
    }
    if (provenance.empty()) return false;
    if (!settings.sidecar) return check_whole(*existing).ok();
    return sidecar_says(provenance, existing->file_bytes());
}

std::string fingerprint_of(const Chain& chain, const RunSettings& settings,
                           const FrameToRead& opened) {
    const int frame = opened.frame->files.frame_number;
    std::string text =
        concat(chain.text(), name_of(settings.plan.precision), " frame ", frame, "\n",
               text_of_frame(*opened.frame), int(settings.source.nonfinite_color), " ",
               settings.overflow ? int(*settings.overflow) : -1, "\n");
    const io::ExrSettings& exr = settings.exr;
    if (exr.compression)
        text += concat("compression ", io::name_of(exr.compression->method), " ",
                       exr.compression->level.value_or(-1), "\n");
    if (exr.half) text += "half\n";
    const auto& transfer = settings.source.input_transfer;
    if (transfer) text += concat("input ", io::description_of(*transfer), "\n");
    if (settings.picture.transfer)
        text += concat("output ", io::description_of(*settings.picture.transfer), "\n");
    for (const auto* used : {transfer ? &*transfer : nullptr,
                             settings.picture.transfer ? &*settings.picture.transfer : nullptr})
        if (const std::string config = used ? io::config_of(*used) : ""; !config.empty())
            text += text_of_config(config);
    if (settings.picture.bits != 0) text += concat("bits ", settings.picture.bits, "\n");
    for (const std::string& channel : exr.channels) text += concat("channel ", channel, "\n");
    // The only rule on by default that changes pixels.
    const RuleNames rules = settings.plan.rules(chain);
    for (const auto& rule : settings.plan.rules_on)
        if (rules.count(rule)) text += rule + "\n";
    if (opened.frame->motion_crosses_cut && rules.count(kRuleCameraCut)) text += "camera cut\n";
    for (const auto& [neighbor, other] : opened.neighbors)
        text += concat(postchain::name_of(neighbor), " ", text_of_frame(*other));
    if (opened.behind) text += concat("behind ", text_of_frame(*opened.behind));
    return concat("postchain ", settings.version, " chain ", hex_of(chain.hash()), " work ",
                  hex_of(hash_text(text)));
}

}  // namespace postchain::sequence
