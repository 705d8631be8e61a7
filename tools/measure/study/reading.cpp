#include "tools/measure/study/reading.h"

namespace postchain::study {

bool is_name(const std::string& text) {
    return !text.empty() && text.size() <= kMaxName &&
           text.find_first_not_of(
               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
               "0123456789_-") == std::string::npos;
}

void Reading::error(const TextNode& at, const std::string& path, const std::string& message) {
    reporter.error(at, path, message);
}

void Reading::error(const TextNode& at, const std::string& path, const Status& status) {
    file.diagnostics.push_back({file.study.file, at.line, at.column, Severity::error, path,
                                status.message(), status.code()});
}

std::optional<std::string> Reading::text(const TextNode& map, const std::string& key,
                                         const std::string& above) {
    const TextNode* node = map.find(key);
    if (!node) return std::nullopt;
    if (node->is_scalar() && !node->text.empty() && node->text.find('\0') == std::string::npos)
        return node->text;
    error(*node, above + key, node->describe() + " is no text");
    return std::nullopt;
}

bool Reading::hold_image(const TextNode& at, const std::string& path, Camera& camera) {
    const std::string image = camera.aperture_image.file();
    if (image.empty()) return true;
    auto resolved = paths.file(image);
    if (!resolved.ok()) {
        error(at, path, "its aperture_image: " + resolved.status().message());
        return false;
    }
    camera.aperture_image = BokehKernel(*resolved);
    return true;
}

}  // namespace postchain::study
