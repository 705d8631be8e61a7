// Two passes without effect, with parameters of every type.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "chain/pass/pass.h"
#include "config/diagnostic.h"
#include "config/profile_match.h"

namespace postchain::test {

enum class SmearMode { wide, narrow };

struct Smear {
    SmearMode mode = SmearMode::wide;
    int samples = 25;
    double amount = 1.5;
    int factor = 4;
    bool dither = true;
    std::optional<double> shutter_frames;
    std::optional<double> shutter_angle_deg;
    std::optional<std::array<double, 2>> middle;
};

struct Tint {
    double gain = 1;
    std::optional<double> limit = 8.0;
};

// smear: mode wide|narrow, samples odd 1..255, amount 0..10, factor 1|2|4 (read with mode: wide),
// dither, shutter_frames 0..4 excludes shutter_angle_deg, middle a point in 0..1. tint: gain > 0,
// limit 0..100 or unset.
const PassRegistry& fake_passes();

const Smear& smear(const Pass& pass);
const Tint& tint(const Pass& pass);

// The texts of all diagnostics.
std::vector<std::string> texts(const Diagnostics& diagnostics);

// "3:12 error passes[0].samples" for each: line, column, severity and path, without the sentence.
std::vector<std::string> places(const Diagnostics& diagnostics);

// A file with these parts, as "name@view: channels" with | between them; the only part may have its
// channels alone. `views`: the file's attribute "multiView".
FileChannels file_of(const std::string& text, const std::vector<std::string>& views = {});

}  // namespace postchain::test
