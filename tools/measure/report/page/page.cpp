#include "tools/measure/report/page/page.h"

#include <filesystem>
#include <optional>

#include "shaders/embedded.h"
#include "tools/measure/report/images.h"
#include "tools/measure/report/page/encode.h"
#include "tools/measure/report/report_json.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/json.h"

namespace postchain {
const std::vector<EmbeddedFile>& embedded_page();
}

namespace postchain::report {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDataMark = "<!--DATA-->";

// JSON inside a script element must not end it: "<" occurs in strings only.
std::string in_script(const std::string& json) {
    std::string text;
    text.reserve(json.size());
    for (const char c : json)
        if (c == '<')
            text += "\\u003c";
        else
            text += c;
    return text;
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

// Pictures that several variants share are one file, and stand in the page once.
size_t first_with_path_of(const Report& report, size_t index) {
    size_t first = 0;
    while (report.images[first].path != report.images[index].path) ++first;
    return first;
}

std::string id_of(const Report& report, size_t index) {
    return concat("image-", first_with_path_of(report, index));
}

int bits_of(const StoredImage& image) {
    return image.kind == ImageKind::error ? 8 : 16;
}

// What src/images.js finds pictures by.
std::string manifest_of(const Report& report, const std::optional<fs::path>& assets) {
    auto images = io::Json::array();
    for (size_t i = 0; i < report.images.size(); ++i) {
        const auto& image = report.images[i];
        io::Json entry = {{"id", id_of(report, i)},   {"kind", name_of(image.kind)},
                          {"variant", image.variant}, {"frame", image.frame},
                          {"map", image.map},         {"width", image.width},
                          {"height", image.height},   {"channels", image.channels},
                          {"bits", bits_of(image)}};
        if (assets) entry["asset"] = as_address(*assets / (id_of(report, i) + ".js"));
        images.push_back(entry);
    }
    return io::json_text({{"images", images}});
}

Result<std::string> encoded(const Report& report, const StoredImage& stored) {
    auto loaded = load_image(report, stored);
    if (!loaded.ok()) return loaded.status();
    const auto& image = *loaded;
    const int channels = stored.kind == ImageKind::error ? 1 : 3;
    if (image.width != stored.width || image.height != stored.height ||
        image.channels != channels || stored.channels != channels)
        return Status(StatusCode::input,
                      concat(stored.path, ": is ", image.width, "x", image.height, " with ",
                             image.channels, " channels, listed as ", stored.width, "x",
                             stored.height, " with ", stored.channels));
    return stored.kind == ImageKind::error ? encode_map(image) : encode_color(image);
}

Status write(io::AtomicFile& file, std::string_view text) {
    return file.write(text.data(), text.size());
}

Status write_assets(const Report& report, const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return Status(StatusCode::output, concat(folder.string(), ": ", error.message()));
    for (size_t i = 0; i < report.images.size(); ++i) {
        if (first_with_path_of(report, i) != i) continue;
        const auto picture = encoded(report, report.images[i]);
        if (!picture.ok()) return picture.status();
        const Status written = report.write(
            (folder / (id_of(report, i) + ".js")).string(),
            concat("postchain_asset(\"", id_of(report, i), "\",\"", *picture, "\")\n"));
        if (!written.ok()) return written;
    }
    return {};
}

Status write_parts(const Report& report, const std::optional<fs::path>& assets,
                   io::AtomicFile& file) {
    const std::string_view page = embedded_page().front().text;
    const size_t mark = page.find(kDataMark);
    if (mark == std::string_view::npos)
        return Status(StatusCode::internal, "the page has no place for the report");

    const std::string data = concat("<script type=\"application/json\" id=\"report\">",
                                    in_script(report_as_json(report)),
                                    "</script>\n<script type=\"application/json\" id=\"manifest\">",
                                    in_script(manifest_of(report, assets)), "</script>\n");
    if (auto status = write(file, page.substr(0, mark)); !status.ok()) return status;
    if (auto status = write(file, data); !status.ok()) return status;
    for (size_t i = 0; !assets && i < report.images.size(); ++i) {
        if (first_with_path_of(report, i) != i) continue;
        const auto picture = encoded(report, report.images[i]);
        if (!picture.ok()) return picture.status();
        const auto element = concat("<script type=\"text/plain\" id=\"", id_of(report, i), "\">",
                                    *picture, "</script>\n");
        if (auto status = write(file, element); !status.ok()) return status;
    }
    return write(file, page.substr(mark + kDataMark.size()));
}

}  // namespace

Status write_page(const Report& report, const std::string& path, const PageOptions& options) {
    std::optional<fs::path> assets;
    if (!options.assets_folder.empty()) {
        if (auto status = write_assets(report, options.assets_folder); !status.ok()) return status;
        std::error_code error;
        const auto base = fs::absolute(path).parent_path();
        assets = fs::relative(options.assets_folder, base, error);
        if (error || assets->empty()) assets = fs::absolute(options.assets_folder);
    }
    const auto permit = report.files.permit(path);
    if (!permit.ok()) return permit.status();
    auto file = io::AtomicFile::create(path);
    if (!file.ok()) return file.status();
    if (auto status = write_parts(report, assets, *file); !status.ok()) return status.at(path);
    const auto committed = file->commit(*permit);
    return committed.ok() ? Status() : committed.status();
}

}  // namespace postchain::report
