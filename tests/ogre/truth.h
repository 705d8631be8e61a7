// Ground truth drawn by OGRE: the mean of the sample's scene at many times within the shutter and
// from many lens samples.
#pragma once

#include <string>

#include "chain/base/image.h"
#include "tools/samples/ogre/host.h"

namespace postchain {

struct TruthSettings {
    int samples = 256;
    double frame = 0;
    bool shutter = false,
         lens = false;        // sampled; otherwise the frame's time, the center of the lens
    int blades = 0;           // corners of the aperture; below 3: a disc
    double rotation_deg = 0;  // of the first corner, against 180 / blades from the right
    float lens_sign = 1;      // -1: a lens that is turned by half a turn, for mutants
};

// Scene-linear RGBA, row 0 at the top. The host's chain must be off.
ImageF draw_truth(host::Host& host, const TruthSettings& settings);

// A chain file's text, or null for no chain. The chain stays the guest's; a failure fails the test.
pc_chain* set_chain(host::PostchainPass& guest, const char* text);

// A whole texture: RGBA, or only depth; rows as stored.
ImageF read_texture(const Ogre::TexturePtr& texture);
// The window with the overlay, 8 bits a channel, RGB, row 0 at the top.
Image<unsigned char> read_window(host::Host& host);
// dB, after (x/(1+x))^(1/2.2).
double psnr(const ImageF& picture, const ImageF& truth);

}  // namespace postchain
