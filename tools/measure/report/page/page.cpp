#include "tools/measure/report/page/page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "tools/measure/report/images.h"
#include "tools/measure/report/report_json.h"
#include "tools/metrics/error.h"
#include "tools/page/encode.h"
#include "tools/page/page.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::report {

namespace {

namespace fs = std::filesystem;

// Error maps that follow from the pixels; those of FLIP are stored (images.h). Their scales are the
// same in every report, so that two pages can be compared.
struct PixelMap {
    const char* name;
    ImageF (*of)(const metrics::Pair&);
    double low, high;
    bool log;
};
constexpr PixelMap kPixelMaps[] = {{"relmse", metrics::relmse_map, 1e-4, 10, true},
                                   {"smape", metrics::smape_map, 0, 2, false},
                                   {"difference", metrics::difference_map, 1e-3, 10, true}};

// Place of an error on the map's scale, 0..1 inside it.
float place_of(double error, const PixelMap& map) {
    return float(map.log ? std::log(std::max(error, 1e-30) / map.low) / std::log(map.high / map.low)
                         : (error - map.low) / (map.high - map.low));
}

// A path as the address of a file beside the page.
std::string as_address(const fs::path& path) {
    static const char hex[] = "0123456789ABCDEF";
    std::string text;
    for (const char c : path.generic_string()) {
        const auto byte = static_cast<unsigned char>(c);
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') ||
                           std::string_view("-._~/").find(c) != std::string_view::npos;
        if (plain)
            text += c;
        else
            text += {'%', hex[byte >> 4], hex[byte & 15]};
    }
    return text;
}

// One image of the page.
struct Entry {
    std::string id;
    StoredImage image;
    const PixelMap* map = nullptr;  // error of `image` against `reference`
    const StoredImage* reference = nullptr;
};

// The image that a result or the input is compared with; nullptr: none is kept.
const StoredImage* reference_of(const Report& report, const StoredImage& image) {
    if (image.kind != ImageKind::color && image.kind != ImageKind::input) return nullptr;
    if (const auto* truth = report.find(ImageKind::truth, -1, image.frame)) return truth;
    if (report.reference == "a") return report.find(ImageKind::color, 0, image.frame);
    return image.variant < 0 ? nullptr
                             : report.find(ImageKind::converged, image.variant, image.frame);
}

// Every stored image, each with the error maps that follow from it.
std::vector<Entry> entries_of(const Report& report) {
    std::vector<Entry> entries;
    for (const StoredImage& image : report.images) {
        // Converged images are references of error maps only.
        if (image.kind == ImageKind::converged) continue;
        entries.push_back({concat("image-", entries.size()), image});
        if (const StoredImage* reference = reference_of(report, image))
            for (const PixelMap& map : kPixelMaps)
                entries.push_back({concat("image-", entries.size()), image, &map, reference});
    }
    return entries;
}

bool is_map(const Entry& entry) {
    return entry.map || entry.image.kind == ImageKind::error;
}

// Read by tools/page/report/images.js.
std::string manifest_of(const std::vector<Entry>& entries, const std::optional<fs::path>& assets) {
    auto images = io::Json::array();
    for (const Entry& entry : entries) {
        const StoredImage& image = entry.image;
        io::Json made = {{"id", entry.id},
                         {"kind", name_of(is_map(entry) ? ImageKind::error : image.kind)},
                         {"variant", image.variant},
                         {"frame", image.frame},
                         {"map", entry.map ? entry.map->name : image.map},
                         {"width", image.width},
                         {"height", image.height},
                         {"channels", is_map(entry) ? 1 : image.channels},
                         {"bits", is_map(entry) ? 8 : 16}};
        if (assets) made["asset"] = as_address(*assets / (entry.id + ".js"));
        images.push_back(made);
    }
    auto scales = io::Json::object();
    for (const PixelMap& map : kPixelMaps)
        scales[map.name] = {{"low", map.low}, {"high", map.high}, {"log", map.log}};
    return io::json_text({{"images", images}, {"scales", scales}});
}

Result<ImageF> loaded(const Report& report, const StoredImage& stored) {
    auto image = load_image(report, stored);
    if (!image.ok()) return image;
    const int channels = stored.kind == ImageKind::error ? 1 : 3;
    if (image->width != stored.width || image->height != stored.height ||
        image->channels != channels || stored.channels != channels)
        return Status(StatusCode::input,
                      concat(stored.path, ": is ", image->width, "x", image->height, " with ",
                             image->channels, " channels, listed as ", stored.width, "x",
                             stored.height, " with ", stored.channels));
    return image;
}

// The images of an error map, kept for the next map of the same image.
struct Compared {
    std::string path;
    ImageF test;
    metrics::Pair pair;
};

// An error map of an image on its scale; pixels that are not finite there are NaN.
Result<ImageF> pixel_map(const Report& report, const Entry& entry, Compared& last) {
    if (last.path != entry.image.path) {
        ASSIGN_OR_RETURN(auto test, loaded(report, entry.image));
        ASSIGN_OR_RETURN(const auto reference, loaded(report, *entry.reference));
        ASSIGN_OR_RETURN(auto pair, metrics::pair_of(test, reference));
        last = {entry.image.path, std::move(test), std::move(pair)};
    }
    ImageF map = entry.map->of(last.pair);
    for (size_t i = 0; i < map.pixels(); ++i) {
        map.data[i] = place_of(map.data[i], *entry.map);
        for (size_t c = 0; c < 3; ++c)
            if (!std::isfinite(last.test.data[3 * i + c])) map.data[i] = std::nanf("");
    }
    return map;
}

Result<std::string> encoded(const Report& report, const Entry& entry, Compared& last) {
    ASSIGN_OR_RETURN(const auto image,
                     entry.map ? pixel_map(report, entry, last) : loaded(report, entry.image));
    return is_map(entry) ? page::encode_map(image) : page::encode_color(image);
}

Status write(io::AtomicFile& file, std::string_view text) {
    return file.write(text.data(), text.size());
}

Status write_assets(const Report& report, const std::vector<Entry>& entries,
                    const fs::path& folder) {
    RETURN_IF_ERROR(io::make_folder(folder.string()));
    Compared last;
    for (const Entry& entry : entries) {
        ASSIGN_OR_RETURN(const auto picture, encoded(report, entry, last));
        RETURN_IF_ERROR(
            report.write((folder / (entry.id + ".js")).string(),
                         concat("postchain_asset(\"", entry.id, "\",\"", picture, "\")\n")));
    }
    return {};
}

Status write_parts(const Report& report, const std::vector<Entry>& entries,
                   const std::optional<fs::path>& assets, io::AtomicFile& file) {
    const page::Halves halves = page::halves_of("report/page.html");
    RETURN_IF_ERROR(write(file, halves.before));
    const std::string data = page::data_element("report", io::json_text(report_json(report))) +
                             page::data_element("manifest", manifest_of(entries, assets));
    RETURN_IF_ERROR(write(file, data));
    Compared last;
    for (const Entry& entry : entries) {
        if (assets) break;
        ASSIGN_OR_RETURN(const auto picture, encoded(report, entry, last));
        const auto element =
            concat("<script type=\"text/plain\" id=\"", entry.id, "\">", picture, "</script>\n");
        RETURN_IF_ERROR(write(file, element));
    }
    return write(file, halves.after);
}

}  // namespace

Status write_page(const Report& report, const std::string& path, const PageOptions& options) {
    const auto entries = entries_of(report);
    std::optional<fs::path> assets;
    if (!options.assets_folder.empty()) {
        RETURN_IF_ERROR(write_assets(report, entries, options.assets_folder));
        std::error_code error;
        const auto base = fs::absolute(path).parent_path();
        assets = fs::relative(options.assets_folder, base, error);
        if (error || assets->empty()) assets = fs::absolute(options.assets_folder);
    }
    ASSIGN_OR_RETURN(const auto permit, report.files.permit(path));
    ASSIGN_OR_RETURN(auto file, io::AtomicFile::create(path));
    if (auto status = write_parts(report, entries, assets, file); !status.ok())
        return status.at(path);
    const auto committed = file.commit(permit);
    return committed.ok() ? Status() : committed.status();
}

}  // namespace postchain::report
