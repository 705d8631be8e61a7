// The state that the readers of a study's chains and scenes share.
#pragma once

#include <optional>
#include <string>

#include "config/reporter.h"
#include "tools/measure/study/study_reader.h"

namespace postchain::study {

inline constexpr size_t kMaxName = 64;
// A name becomes a part of file names.
bool is_name(const std::string& text);

struct Reading {
    StudyFile& file;
    const PassRegistry& registry;
    const StudyPaths& paths;
    Reporter reporter;

    void error(const TextNode& at, const std::string& path, const std::string& message);
    void error(const TextNode& at, const std::string& path, const Status& status);
    // A string that is not empty; `above` is the path of the map.
    std::optional<std::string> text(const TextNode& map, const std::string& key,
                                    const std::string& above = {});
    // Resolves the path of the camera's aperture image. False: an error is reported.
    bool hold_image(const TextNode& at, const std::string& path, Camera& camera);
};

}  // namespace postchain::study
