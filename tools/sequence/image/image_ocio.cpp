#include "tools/sequence/image/image_ocio.h"

#include <algorithm>

#include "tools/sequence/image/ocio_config.h"

namespace postchain::io {
namespace {

std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

Status unknown(const std::string& option, const std::string& name,
               const std::vector<std::string>& names) {
    return Status(StatusCode::usage, concat(option, ": the configuration has no '", name,
                                            "'; it has ", listed(names)));
}

// `name`, or what the configuration has for none. Errors (usage): it is not among `names`.
Result<std::string> chosen(const std::string& option, const std::string& name,
                           const char* by_default, const std::vector<std::string>& names) {
    if (name.empty()) return std::string(by_default ? by_default : "");
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    return unknown(option, name, names);
}

// The color space of this name or role.
Result<std::string> space_of(const OIIO::ColorConfig& config, const std::string& option,
                             const std::string& name) {
    const std::vector<std::string> roles = config.getRoles();
    if (std::find(roles.begin(), roles.end(), name) != roles.end())
        return std::string(config.getColorSpaceNameByRole(name));
    const std::vector<std::string> names = config.getColorSpaceNames();
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    return unknown(option, name, names);
}

// The color space of the frames.
Result<std::string> working_space(const OIIO::ColorConfig& config, const std::string& path,
                                  const std::string& name) {
    if (!name.empty()) return space_of(config, "--ocio-colorspace", name);
    const char* linear = config.getColorSpaceNameByRole("scene_linear");
    if (linear && *linear) return std::string(linear);
    return Status(StatusCode::usage,
                  concat(path,
                         ": has no role scene_linear; say with --ocio-colorspace what the frames "
                         "are in: ",
                         listed(config.getColorSpaceNames())));
}

Status apply(const OIIO::ColorProcessorHandle& processor, const std::string& what,
             OIIO::ColorConfig& config, ImageF& color) {
    if (!processor)
        return Status(StatusCode::input, concat(what, " cannot be made: ", config.geterror()));
    const auto pixel = OIIO::stride_t(size_t(color.channels) * sizeof(float));
    processor->apply(color.data.data(), color.width, color.height, 3, sizeof(float), pixel,
                     pixel * color.width);
    return {};
}

Status convert_space(ImageF& color, const OcioSpace& space, const char* option, bool to_working) {
    ASSIGN_OR_RETURN(const auto config, ocio_config(space.config));
    OIIO::ColorConfig& c = *config;
    ASSIGN_OR_RETURN(const auto working, working_space(c, space.config, space.working));
    ASSIGN_OR_RETURN(const auto stored, space_of(c, option, space.space));
    const std::string &from = to_working ? stored : working, &to = to_working ? working : stored;
    return apply(c.createColorProcessor(from, to),
                 concat(space.config, ": the way from ", from, " to ", to), c, color);
}

}  // namespace

Status from_ocio_space(ImageF& color, const OcioSpace& space) {
    return convert_space(color, space, "--input-transfer", true);
}

Status to_ocio_space(ImageF& color, const OcioSpace& space) {
    return convert_space(color, space, "--output-transfer", false);
}

Status to_ocio_view(ImageF& color, const DisplayView& view) {
    ASSIGN_OR_RETURN(const auto config, ocio_config(view.config));
    OIIO::ColorConfig& c = *config;
    ASSIGN_OR_RETURN(const auto display, chosen("--ocio-display", view.display,
                                                c.getDefaultDisplayName(), c.getDisplayNames()));
    ASSIGN_OR_RETURN(
        const auto name,
        chosen("--ocio-view", view.view, c.getDefaultViewName(display), c.getViewNames(display)));
    ASSIGN_OR_RETURN(const auto working, working_space(c, view.config, view.working));
    return apply(c.createDisplayTransform(display, name, working),
                 concat(view.config, ": the view ", name, " of ", display), c, color);
}

}  // namespace postchain::io
