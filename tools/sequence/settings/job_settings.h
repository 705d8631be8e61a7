// Job settings as text, from a command line or elsewhere. The table job_parameters() holds key,
// type, choices, default, range and help of each.
//
//   text --job_parameters()--> JobSettings --parse_job--> RunSettings
#pragma once

#include <string>

#include "chain/base/parameter.h"
#include "chain/pass/pass.h"
#include "config/diagnostic.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

enum class BitsChoice { as_input, bits_8, bits_10, bits_12, bits_16, bits_32 };

// Strings are in the forms that docs/command.md describes; empty = not given. The choices go into
// RunSettings as they are.
struct JobSettings : SourceChoices, RunChoices {
    std::string input;
    std::string behind;
    std::string frames;
    std::string cuts;
    std::string camera;
    std::string profile;
    std::string max_memory;
    std::string input_transfer = "auto";  // "auto", a curve, or "ocio:SPACE"
    std::string ocio;
    std::string ocio_colorspace;

    std::string aovs = "none";         // "none", "all", or comma-separated names
    std::string cryptomatte = "keep";  // "keep", "filter", "filter=NAMES"
    std::string fill_mask;

    Precision precision = Precision::fp32;
    std::string no_elide;  // "all", or comma-separated rules
    std::string elide;     // comma-separated rules

    std::string chunk;
    std::string output;
    std::string compression;
    bool half = false;
    std::string channels;
    std::string output_transfer = "auto";  // like input_transfer, or "view"
    BitsChoice bits = BitsChoice::as_input;
    std::string ocio_display;
    std::string ocio_view;

    bool watch = false;
    std::optional<double> idle;  // s
};

inline constexpr const char* kInputGroup = "input";
inline constexpr const char* kLayerGroup = "layers";  // layers filtered in addition to color
inline constexpr const char* kPlanGroup = "plan";
inline constexpr const char* kOutputGroup = "output";
inline constexpr const char* kWatchGroup = "watch";  // command only
// Accepts the rule names of the registry.
ParameterTable job_parameters(const PassRegistry& registry);

// By key; an empty text is not given.
std::map<std::string, ParameterValue> given_values(const JobSettings& job,
                                                   const PassRegistry& registry);

// JobSettings::max_memory in bytes. Errors (usage) name the setting.
Result<uint64_t> memory_limit_of(const std::string& text);

// Reads the images of apertures that a camera file names. Errors: those of read_aperture_image().
Status read_aperture_images(CameraFile& file);

// All settings except the version. `notes` gets the camera file's diagnostics, errors too. Errors:
// (usage) naming the setting; those of find_profile() and load_camera().
Result<RunSettings> parse_job(const JobSettings& job, const PassRegistry& registry,
                              Diagnostics& notes);

// The frames of a job by other names, such as their real ones.
void set_input(RunSettings& run, io::InputSpec input, std::optional<io::PathPattern> behind);

}  // namespace postchain::sequence
