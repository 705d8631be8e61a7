#include "tools/sequence/image/ocio_config.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <regex>
#include <set>
#include <vector>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "tools/sequence/files/file_stamp.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;
namespace ocio = OCIO_NAMESPACE;

Status unusable(const std::string& path, std::string why) {
    std::replace(why.begin(), why.end(), '\n', ' ');
    return Status(StatusCode::input, concat(path, ": not a usable OpenColorIO configuration: ", why,
                                            "; check it with ociocheck"));
}

void add_sources(const ocio::ConstTransformRcPtr& transform, std::set<std::string>& sources) {
    if (const auto group = OCIO_DYNAMIC_POINTER_CAST<const ocio::GroupTransform>(transform))
        for (int i = 0; i < group->getNumTransforms(); ++i)
            add_sources(group->getTransform(i), sources);
    else if (const auto file = OCIO_DYNAMIC_POINTER_CAST<const ocio::FileTransform>(transform))
        sources.insert(file->getSrc());
}

// The files named by the file transforms of a configuration, as written.
std::set<std::string> sources_of(const ocio::Config& config) {
    std::set<std::string> sources;
    const auto spaces = ocio::SEARCH_REFERENCE_SPACE_ALL;
    for (int i = 0; i < config.getNumColorSpaces(spaces, ocio::COLORSPACE_ALL); ++i) {
        const auto space =
            config.getColorSpace(config.getColorSpaceNameByIndex(spaces, ocio::COLORSPACE_ALL, i));
        add_sources(space->getTransform(ocio::COLORSPACE_DIR_TO_REFERENCE), sources);
        add_sources(space->getTransform(ocio::COLORSPACE_DIR_FROM_REFERENCE), sources);
    }
    for (int i = 0; i < config.getNumLooks(); ++i) {
        const auto look = config.getLook(config.getLookNameByIndex(i));
        add_sources(look->getTransform(), sources);
        add_sources(look->getInverseTransform(), sources);
    }
    for (int i = 0; i < config.getNumViewTransforms(); ++i) {
        const auto view = config.getViewTransform(config.getViewTransformNameByIndex(i));
        add_sources(view->getTransform(ocio::VIEWTRANSFORM_DIR_TO_REFERENCE), sources);
        add_sources(view->getTransform(ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE), sources);
    }
    for (int i = 0; i < config.getNumNamedTransforms(ocio::NAMEDTRANSFORM_ALL); ++i) {
        const auto named = config.getNamedTransform(
            config.getNamedTransformNameByIndex(ocio::NAMEDTRANSFORM_ALL, i));
        add_sources(named->getTransform(ocio::TRANSFORM_DIR_FORWARD), sources);
        add_sources(named->getTransform(ocio::TRANSFORM_DIR_INVERSE), sources);
    }
    return sources;
}

// A table is looked for in every folder of the search path, relative ones from the configuration's
// own folder.
std::vector<std::string> files_of(const ocio::Config& config, const std::string& path) {
    const auto context = config.getCurrentContext();
    const fs::path home = fs::absolute(path).parent_path();
    std::vector<fs::path> folders;
    for (int i = 0; i < context->getNumSearchPaths(); ++i)
        folders.push_back(home / context->resolveStringVar(context->getSearchPath(i)));
    if (folders.empty()) folders.push_back(home);
    std::vector<std::string> files = {fs::absolute(path).string()};
    for (const std::string& source : sources_of(config)) {
        const fs::path name = context->resolveStringVar(source.c_str());
        if (name.is_absolute()) {
            files.push_back(name.string());
            continue;
        }
        for (const fs::path& folder : folders) files.push_back((folder / name).string());
    }
    return files;
}

// Environment variables that a text names, as $NAME, ${NAME} or %NAME%.
std::map<std::string, std::string> variables_of(const ocio::Config& config,
                                                const std::string& path) {
    const std::string text = text_of_file(path);
    static const std::regex named(R"(\$\{?(\w+)|%(\w+)%)");
    std::map<std::string, std::string> variables;
    const auto context = config.getCurrentContext();
    for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it) {
        const std::string name = (*it)[1].matched ? (*it)[1] : (*it)[2];
        variables[name] = context->resolveStringVar(("${" + name + "}").c_str());
    }
    return variables;
}

struct CachedConfig {
    std::vector<FileStamp> stamps;  // its file, then every table that it names
    std::map<std::string, std::string> variables;
    std::shared_ptr<OIIO::ColorConfig> config;  // none until it is asked for
};

Result<CachedConfig> read(const std::string& path) {
    std::error_code error;
    if (!fs::is_regular_file(path, error))
        return Status(StatusCode::input,
                      path + ": no such file; name an OpenColorIO configuration that exists");
    if (const ReadableFile opened(path); !opened.ok())
        return Status(StatusCode::input, path + ": " + opened.fault());
    try {
        CachedConfig entry;
        const auto config = ocio::Config::CreateFromFile(path.c_str());
        for (const std::string& file : files_of(*config, path)) {
            // OpenColorIO opens its tables itself, and would wait for a pipe.
            if (const ReadableFile opened(file); !opened.ok() && fs::exists(file, error))
                return Status(StatusCode::input, path + ": " + file + ": " + opened.fault());
            entry.stamps.push_back(FileStamp::of(file));
        }
        entry.variables = variables_of(*config, path);
        return entry;
    } catch (const ocio::Exception& exception) {
        return unusable(path, exception.what());
    }
}

bool is_same(const FileStamp& stamp) {
    return FileStamp::of(stamp.path) == stamp;
}

std::mutex mutex;  // guards the cache

// The cache entry of this path, as its files are now; `mutex` is held.
Result<CachedConfig*> cached(const std::string& path) {
    static std::map<std::string, CachedConfig> all;  // reading one takes long
    const auto known = all.find(path);
    if (known != all.end()) {
        const auto& stamps = known->second.stamps;
        if (std::all_of(stamps.begin(), stamps.end(), is_same)) return &known->second;
        all.erase(known);
        ocio::ClearAllCaches();  // OpenColorIO keeps tables by their names
    }
    ASSIGN_OR_RETURN(auto entry, read(path));
    return &all.emplace(path, std::move(entry)).first->second;
}

}  // namespace

Result<OcioSources> ocio_sources(const std::string& path) {
    const std::lock_guard lock(mutex);
    ASSIGN_OR_RETURN(const auto entry, cached(path));
    OcioSources sources;
    for (const FileStamp& stamp : entry->stamps) sources.files.push_back(stamp.path);
    sources.variables = entry->variables;
    return sources;
}

Result<std::shared_ptr<OIIO::ColorConfig>> ocio_config(const std::string& path) {
    const std::lock_guard lock(mutex);
    ASSIGN_OR_RETURN(const auto entry, cached(path));
    std::shared_ptr<OIIO::ColorConfig>& config = entry->config;
    if (!config) {
        auto made = std::make_shared<OIIO::ColorConfig>(path);
        if (made->has_error()) return unusable(path, made->geterror());
        if (made->getNumDisplays() == 0) return unusable(path, "it has no display");
        config = std::move(made);
    }
    return config;
}

namespace {

Status unknown(const std::string& key, const std::string& name,
               const std::vector<std::string>& names) {
    return Status(StatusCode::usage, concat(setting(key), ": the configuration has no '", name,
                                            "'; it has ", joined(names)));
}

// `name`, or what the configuration has for none. Errors (usage): it is not among `names`.
Result<std::string> chosen(const std::string& key, const std::string& name, const char* by_default,
                           const std::vector<std::string>& names) {
    if (name.empty()) return std::string(by_default ? by_default : "");
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    return unknown(key, name, names);
}

// By the list of roles: OpenImageIO makes up a name for one that is missing.
std::optional<std::string> space_of_role(const OIIO::ColorConfig& config, const std::string& role) {
    const std::vector<std::string> roles = config.getRoles();
    if (std::find(roles.begin(), roles.end(), role) == roles.end()) return std::nullopt;
    return config.getColorSpaceNameByRole(role);
}

// The color space of this name or role.
Result<std::string> space_of(const OIIO::ColorConfig& config, const std::string& key,
                             const std::string& name) {
    if (auto space = space_of_role(config, name)) return std::move(*space);
    const std::vector<std::string> names = config.getColorSpaceNames();
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    return unknown(key, name, names);
}

// The color space of the frames.
Result<std::string> working_space(const OIIO::ColorConfig& config, const std::string& path,
                                  const std::string& name) {
    if (!name.empty()) return space_of(config, "ocio_colorspace", name);
    if (auto linear = space_of_role(config, "scene_linear")) return std::move(*linear);
    return Status(StatusCode::usage,
                  concat(path,
                         ": has no role scene_linear; say with {ocio_colorspace} what the frames "
                         "are in: "_keyed,
                         joined(config.getColorSpaceNames())));
}

Status apply(const OIIO::ColorProcessorHandle& processor, const std::string& what,
             OIIO::ColorConfig& config, ImageF& color) {
    if (!processor)
        return Status(StatusCode::input, concat(what, " cannot be made: ", config.geterror(),
                                                "; check the names and the configuration"));
    const auto pixel = OIIO::stride_t(size_t(color.channels) * sizeof(float));
    processor->apply(color.data.data(), color.width, color.height, 3, sizeof(float), pixel,
                     pixel * color.width);
    return {};
}

Status convert_space(ImageF& color, const OcioSpace& space, const char* key, bool to_working) {
    ASSIGN_OR_RETURN(const auto config, ocio_config(space.config));
    OIIO::ColorConfig& c = *config;
    ASSIGN_OR_RETURN(const auto working, working_space(c, space.config, space.working));
    ASSIGN_OR_RETURN(const auto stored, space_of(c, key, space.space));
    const std::string &from = to_working ? stored : working, &to = to_working ? working : stored;
    return apply(c.createColorProcessor(from, to),
                 concat(space.config, ": the way from ", from, " to ", to), c, color);
}

}  // namespace

Status from_ocio_space(ImageF& color, const OcioSpace& space) {
    return convert_space(color, space, "input_transfer", true);
}

Status to_ocio_space(ImageF& color, const OcioSpace& space) {
    return convert_space(color, space, "output_transfer", false);
}

Status to_ocio_view(ImageF& color, const DisplayView& view) {
    ASSIGN_OR_RETURN(const auto config, ocio_config(view.config));
    OIIO::ColorConfig& c = *config;
    ASSIGN_OR_RETURN(const auto display, chosen("ocio_display", view.display,
                                                c.getDefaultDisplayName(), c.getDisplayNames()));
    ASSIGN_OR_RETURN(const auto name, chosen("ocio_view", view.view, c.getDefaultViewName(display),
                                             c.getViewNames(display)));
    ASSIGN_OR_RETURN(const auto working, working_space(c, view.config, view.working));
    return apply(c.createDisplayTransform(display, name, working),
                 concat(view.config, ": the view ", name, " of ", display), c, color);
}

}  // namespace postchain::io
