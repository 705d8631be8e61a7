// Textures read as images. Mesa's software renderers compile texelFetch() for any level of a
// texture, and a call of it takes three to five times as long as imageLoad(), which reads the same
// bits. A GPU reads textures, through caches of their own.
#pragma once

#include <string>

#include "chain/plan/device_class.h"
#include "chain/plan/plan.h"

namespace postchain::gl {

// The most units of a kind that a step may use.
inline constexpr int kMaxUnits = 16;
// The image unit of a step's texture unit 0; the images of its own bindings are below it.
inline constexpr int kFirstReadImage = 8;

// How a step reads the textures that it samples.
enum class Reads { textures, images };
inline Reads best_reads(DeviceClass device) {
    return device == DeviceClass::software ? Reads::images : Reads::textures;
}

// The step's program for textures that are read as images.
ProgramKey image_program(const Plan& plan, const Step& step);

// The source of such a program, whose includes are resolved: each sampler at `layout(binding = N)`,
// N a number or a macro, is a readonly image at unit kFirstReadImage + N, and texelFetch() is
// imageLoad().
std::string with_image_reads(const std::string& source, const ProgramKey& key);

// True if the key is one of image_program().
bool has_image_reads(const ProgramKey& key);

}  // namespace postchain::gl
