// A blind comparison: pairs of images in random order on a page that does not say which is which,
// and the key that does.
//
//   sides x frames --make_kit()--> Kit --page_of()--> index.html, for observers
//                                      --key_text()--> key.json, for whoever evaluates
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::blind {

inline constexpr size_t kMaxTrials = 1000;

// Two sides of one frame.
struct Trial {
    int frame = 0;
    size_t left = 0, right = 0;  // indices of sides
};

struct Picture {
    int frame = 0;
    size_t side = 0;  // as many as sides: the ground truth
    std::string png;
};

struct Kit {
    std::string id;      // hash of sides, trials and images, as 16 digits; choices name it
    std::string images;  // hash
    std::vector<std::string> sides;
    std::vector<Trial> trials;  // in the order in which they are shown
};
// Every pair of sides on every frame, in an order and with sides that depend on the seed only.
Kit make_kit(const std::vector<std::string>& sides, const std::vector<int>& frames, uint64_t seed,
             const std::vector<Picture>& pictures);

std::string key_text(const Kit& kit);
// Errors (input): key_text() did not make `text`.
Result<Kit> kit_from(const std::string& text, const std::string& file_name);

// Holds each image once, in the order of their first use.
std::string page_of(const Kit& kit, const std::vector<Picture>& pictures);

}  // namespace postchain::blind
