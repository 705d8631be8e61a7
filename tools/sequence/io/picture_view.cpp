#include "tools/sequence/io/picture_view.h"

#include <OpenImageIO/color.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>

namespace postchain::io {
namespace {

std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

// `name`, or what the configuration has for none. Errors (usage): it is not among `names`.
Result<std::string> chosen(const std::string& option, const std::string& name,
                           const char* by_default, const std::vector<std::string>& names) {
    if (name.empty()) return std::string(by_default ? by_default : "");
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    return Status(StatusCode::usage, concat(option, ": the configuration has no '", name,
                                            "'; it has ", listed(names)));
}

// One for each file; reading one takes long.
Result<OIIO::ColorConfig*> config_of(const std::string& path) {
    static std::mutex mutex;
    static std::map<std::string, std::unique_ptr<OIIO::ColorConfig>> configs;
    const std::lock_guard lock(mutex);
    std::unique_ptr<OIIO::ColorConfig>& config = configs[path];
    if (!config) {
        std::error_code error;
        if (!std::filesystem::is_regular_file(path, error))
            return Status(StatusCode::input, path + ": no OpenColorIO configuration: no such file");
        auto made = std::make_unique<OIIO::ColorConfig>(path);
        if (made->has_error() || made->getNumDisplays() == 0) {
            std::string why = made->geterror();
            std::replace(why.begin(), why.end(), '\n', ' ');
            return Status(StatusCode::input,
                          concat(path, ": no OpenColorIO configuration that can be used: ",
                                 why.empty() ? "it has no display" : why));
        }
        config = std::move(made);
    }
    return config.get();
}

}  // namespace

Result<Image<uint8_t>> shown_by_view(const ImageF& color, const DisplayView& view) {
    const auto config = config_of(view.config);
    if (!config.ok()) return config.status();
    OIIO::ColorConfig& c = **config;
    const auto display =
        chosen("--ocio-display", view.display, c.getDefaultDisplayName(), c.getDisplayNames());
    if (!display.ok()) return display.status();
    const auto name =
        chosen("--ocio-view", view.view, c.getDefaultViewName(*display), c.getViewNames(*display));
    if (!name.ok()) return name.status();
    const auto space = chosen("--ocio-colorspace", view.space,
                              c.getColorSpaceNameByRole("scene_linear"), c.getColorSpaceNames());
    if (!space.ok()) return space.status();
    if (space->empty())
        return Status(StatusCode::usage,
                      concat(view.config,
                             ": has no role scene_linear; say with --ocio-colorspace "
                             "what the frames are in: ",
                             listed(c.getColorSpaceNames())));
    ImageF rgb(color.width, color.height, 3);
    for (size_t i = 0; i < color.pixels(); ++i)
        for (size_t k = 0; k < 3; ++k) {
            const float value =
                color.data[i * size_t(color.channels) + (color.channels >= 3 ? k : 0)];
            rgb.data[3 * i + k] = std::isfinite(value) ? value : 0;
        }
    const OIIO::ImageSpec spec(rgb.width, rgb.height, 3, OIIO::TypeDesc::FLOAT);
    const OIIO::ImageBuf from(spec, rgb.data.data());
    OIIO::ImageBuf to;
    if (!OIIO::ImageBufAlgo::ociodisplay(to, from, *display, *name, *space, "", false, "", "", &c))
        return Status(StatusCode::input, concat(view.config, ": the view ", *name, " of ", *display,
                                                " cannot be made: ", to.geterror()));
    if (!to.get_pixels(OIIO::ROI::All(), OIIO::TypeDesc::FLOAT, rgb.data.data()))
        return Status(StatusCode::internal, "a view without pixels: " + to.geterror());
    Image<uint8_t> bytes(rgb.width, rgb.height, 3);
    for (size_t i = 0; i < bytes.data.size(); ++i) {
        const float v = rgb.data[i];
        bytes.data[i] = uint8_t(std::lround(255 * (v > 0 ? std::min(v, 1.0f) : 0.0f)));
    }
    return bytes;
}

}  // namespace postchain::io
