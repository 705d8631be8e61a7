#include "chain/gl/image_reads.h"

#include <map>
#include <sstream>
#include <string_view>

#include "chain/base/status.h"

namespace postchain::gl {
namespace {

constexpr const char* kSwitch = "READS_IMAGES";

// After #version, ahead of the source.
constexpr const char* kMacros =
    "#define sampler2D readonly image2D\n"
    "#define usampler2D readonly uimage2D\n"
    "#define sampler2DArray readonly image2DArray\n"
    "#define usampler2DArray readonly uimage2DArray\n"
    "#define texelFetch(plane, at, level) imageLoad(plane, at)\n"
    "#define textureSize(plane, level) imageSize(plane)\n"
    "#line 2 0\n";

std::string define_of_unit(int unit) {
    return concat("IMAGE_", unit);
}

// A unit is a number, or a macro that stands for one.
int unit_of(const std::string& text, const std::map<std::string, std::string>& macros) {
    const auto macro = macros.find(text);
    return std::stoi(macro == macros.end() ? text : macro->second);
}

}  // namespace

ProgramKey image_program(const Plan& plan, const Step& step) {
    ProgramKey key = step.program;
    key.defines[kSwitch] = "1";
    for (const Binding& binding : step.bindings)
        if (binding.access == Access::sample_nearest)
            key.defines[define_of_unit(binding.unit)] =
                name_of(plan.textures[size_t(binding.texture)].format);
    return key;
}

bool has_image_reads(const ProgramKey& key) {
    return key.defines.contains(kSwitch);
}

std::string with_image_reads(const std::string& source, const ProgramKey& key) {
    constexpr std::string_view kBinding = "layout(binding = ", kUniform = ") uniform ";
    std::istringstream lines(source);
    std::string line;
    std::map<std::string, std::string> macros;
    std::getline(lines, line);
    std::string out = line + "\n" + kMacros;
    while (std::getline(lines, line)) {
        if (line.starts_with("#define ")) {
            std::istringstream words(line);
            std::string define, name, value;
            if (words >> define >> name >> value) macros[name] = value;
        }
        const size_t uniform = line.find(kUniform);
        if (line.starts_with(kBinding) && uniform != line.npos &&
            line.find("sampler2D", uniform) != line.npos) {
            const int unit =
                unit_of(line.substr(kBinding.size(), uniform - kBinding.size()), macros);
            const auto format = key.defines.find(define_of_unit(unit));
            const bool bits = line.find("usampler") != line.npos;
            // The macros make the type an image. One that the step does not bind is not read.
            line = concat(kBinding, kFirstReadImage + unit, ", ",
                          format != key.defines.end() ? format->second
                          : bits                      ? "rgba32ui"
                                                      : "rgba32f",
                          line.substr(uniform));
        }
        out += line + "\n";
    }
    return out;
}

}  // namespace postchain::gl
