// The settings of a job as they are written, on a command line or elsewhere, and as one table:
// key, type, choices, default, range and help of each come from job_parameters().
//
//   text --job_parameters()--> JobSettings --run_settings_of--> RunSettings
#pragma once

#include <string>

#include "chain/parameter.h"
#include "chain/pass.h"
#include "config/diagnostic.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::sequence {

enum class BitsChoice { as_input, bits_8, bits_10, bits_12, bits_16, bits_32 };

// Texts are in the forms that docs/command.md describes; an empty one is not given.
struct JobSettings {
    std::string input;
    std::string frames;
    std::string cuts;
    std::string camera;
    std::string profile;
    std::string layer;
    std::string view;
    NonfiniteColor nonfinite = NonfiniteColor::zero;
    DataWindow data_window = DataWindow::grow;
    CameraMotion camera_motion = CameraMotion::missing;
    std::string max_memory;
    std::string input_transfer = "auto";  // "auto", a curve, or "ocio:SPACE"
    std::string ocio;
    std::string ocio_colorspace;

    std::string layers = "none";  // "none", "all", or names with commas
    CryptomatteChoice cryptomatte = CryptomatteChoice::keep;

    Precision precision = Precision::fp32;
    std::string no_elide;  // "all", or names of rules with commas
    std::string elide;     // names of rules with commas

    std::string chunk;
    std::string output;
    bool mkdir = false;
    io::OnExisting on_existing = io::OnExisting::fail;
    MissingPolicy missing = MissingPolicy::error;
    ErrorPolicy on_error = ErrorPolicy::stop;
    io::HalfOverflow overflow = io::HalfOverflow::refuse;
    std::string compression;
    bool half = false;
    std::string channels;
    std::string output_transfer = "auto";  // that of input_transfer, or "view"
    BitsChoice bits = BitsChoice::as_input;
    bool strict = false;
    bool sidecar = true;
    bool png = false;
    std::string ocio_display;
    std::string ocio_view;
    std::string dump_stages;

    bool watch = false;
    std::optional<double> idle;  // s
};

// Groups of the rows: what is read, filtered, what a plan does, what is written, waited for.
inline constexpr const char* kInputGroup = "input";
inline constexpr const char* kLayerGroup = "layers";  // what is filtered besides color
inline constexpr const char* kPlanGroup = "plan";
inline constexpr const char* kOutputGroup = "output";
inline constexpr const char* kWatchGroup = "watch";  // of the command alone
// The names of the rules that may be given are those of the registry.
ParameterTable job_parameters(const PassRegistry& registry);

// How messages name a setting, and the command its option: "on_existing" -> "--on-existing".
std::string option_name(const std::string& key);

// JobSettings::max_memory in bytes. Errors (usage) with the setting's name.
Result<uint64_t> memory_limit_of(const std::string& text);

// Everything but the version. `notes` gets what the camera file's reader has to say, its errors
// too. Errors: (usage) with the setting's name; those of find_profile() and load_camera().
Result<RunSettings> run_settings_of(const JobSettings& job, const PassRegistry& registry,
                                    Diagnostics& notes);

}  // namespace postchain::sequence
