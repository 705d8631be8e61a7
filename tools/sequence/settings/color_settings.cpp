#include "tools/sequence/settings/color_settings.h"

#include <cstdlib>

namespace postchain::sequence {
namespace {

std::string config_of(const JobSettings& job) {
    const char* stated = std::getenv("OCIO");
    return !job.ocio.empty() ? job.ocio : stated ? stated : "";
}

Result<std::string> config_for(const JobSettings& job, const std::string& key) {
    std::string config = config_of(job);
    if (!config.empty()) return config;
    return Status(StatusCode::usage,
                  concat(setting(key),
                         " needs an OpenColorIO configuration; name its file with {ocio}, "
                         "or set OCIO in the environment"_keyed));
}

io::DisplayView view_by(const JobSettings& job, const std::string& config) {
    return {config, job.ocio_display, job.ocio_view, job.ocio_colorspace};
}

constexpr const char* kAuto = "auto";
constexpr const char* kView = "view";
constexpr std::string_view kSpace = "ocio:";  // followed by the name of a color space
constexpr io::Curve kCurves[] = {io::Curve::linear, io::Curve::srgb, io::Curve::rec709,
                                 io::Curve::gamma22, io::Curve::cineon};

// Transfer named by `key`; none = decided by the file, then the format.
Result<std::optional<io::Transfer>> transfer_of(const JobSettings& job, const std::string& key,
                                                const std::string& text, bool takes_view) {
    using Chosen = std::optional<io::Transfer>;
    if (text.empty() || text == kAuto) return Chosen();
    std::string known = kAuto;
    for (const io::Curve curve : kCurves) {
        if (text == io::name_of(curve)) return Chosen(curve);
        known += concat(", ", io::name_of(curve));
    }
    const bool is_space = text.starts_with(kSpace) && text.size() > kSpace.size();
    if (is_space || (takes_view && text == kView)) {
        ASSIGN_OR_RETURN(const auto config, config_for(job, key));
        if (!is_space) return Chosen(view_by(job, config));
        return Chosen(io::OcioSpace{config, text.substr(kSpace.size()), job.ocio_colorspace});
    }
    return Status(
        StatusCode::usage,
        concat(setting(key), ": unknown name '", text, "'; known are ", known, ", ", kSpace,
               "SPACE",
               takes_view      ? ", view"
               : text == kView ? " (a view cannot be inverted, so it cannot describe inputs)"
                               : ""));
}

}  // namespace

Result<std::optional<io::Transfer>> input_transfer_of(const JobSettings& job) {
    return transfer_of(job, "input_transfer", job.input_transfer, false);
}

Result<std::optional<io::Transfer>> output_transfer_of(const JobSettings& job) {
    return transfer_of(job, "output_transfer", job.output_transfer, true);
}

bool needs_ocio(const JobSettings& job) {
    return job.output_transfer == kView || job.input_transfer.starts_with(kSpace) ||
           job.output_transfer.starts_with(kSpace);
}

Result<std::optional<io::DisplayView>> preview_view_of(const JobSettings& job) {
    const bool names_view = !job.ocio_display.empty() || !job.ocio_view.empty();
    const bool names_any = names_view || !job.ocio.empty() || !job.ocio_colorspace.empty();
    const bool shows = job.preview || job.output_transfer == kView;
    if (names_view && !shows)
        return Status(StatusCode::usage,
                      "{ocio_view} and {ocio_display} apply only to images that show a view; add "
                      "{png=true} or {output_transfer=view}"_keyed);
    if (names_any && !shows && !needs_ocio(job))
        return Status(
            StatusCode::usage,
            "{ocio} has no effect by itself; add {png=true}, {output_transfer} or {input_transfer}"_keyed);
    if (!job.preview || (!names_any && config_of(job).empty()))
        return std::optional<io::DisplayView>();
    const char* said = !job.ocio_view.empty()      ? "ocio_view"
                       : !job.ocio_display.empty() ? "ocio_display"
                                                   : "ocio_colorspace";
    ASSIGN_OR_RETURN(const auto config, config_for(job, said));
    return std::optional(view_by(job, config));
}

}  // namespace postchain::sequence
