#include "tools/sequence/source/behind_planes.h"

#include <algorithm>
#include <utility>

#include "chain/behind.h"
#include "chain/text.h"
#include "tools/sequence/source/layers_apart.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/neighbor_planes.h"

namespace postchain::sequence {
namespace {

// Only its planes are used: mattes and cryptomattes are the frame's.
SourceSettings settings_of_behind(SourceSettings settings) {
    settings.behind = true;
    settings.layers.mattes.clear();
    settings.layers.cryptomatte = CryptomatteChoice::keep;
    settings.layers.ids.clear();
    settings.layers.fill_mask.clear();
    return settings;
}

Status check_roles(const std::string& path, const FrameHeader& behind, const FrameHeader& frame,
                   RoleSet needed) {
    RoleSet present = roles_in_files(behind) | RoleSet{Role::layers};
    // Objects whose samples have no vectors would get those of the camera alone.
    if (color_part(behind).deep && behind.makes_motion && !frame.makes_motion)
        present = present - RoleSet{Role::motion, Role::motion_back};
    const RoleSet lacking = needed - present;
    if (lacking.empty()) return Status();
    std::string text = concat(path, ": the layer behind has no ", lacking.text());
    for (const auto& [role, names] : behind.match.missing)
        if (lacking.has(role)) text += concat("; ", name_of(role), " was looked for as ", names);
    return Status(StatusCode::input,
                  text + (color_part(behind).deep
                              ? "; write them into the deep file, a value for each sample"
                              : "; render it with the channels that the frame has, or filter "
                                "without it"));
}

}  // namespace

Result<OpenedFrame> open_behind(const SourceSettings& settings, const std::string& path,
                                const OpenedFrame& frame) {
    OpenedFrame behind;
    behind.number = frame.number;
    behind.files = {{Role::color, path}};
    behind.stamps.push_back(io::FileStamp::of(path));
    ASSIGN_OR_RETURN(auto header,
                     open_source_frame(settings_of_behind(settings), behind.files, frame.number));
    if (!header.match.view.empty() && header.match.view != frame.header.match.view)
        return Status(StatusCode::input,
                      concat(path, ": the layer behind has no view ", frame.header.match.view));
    const io::Window own = color_part(frame.header).display_window,
                     its = color_part(header).display_window;
    if (own != its)
        return Status(StatusCode::input,
                      concat(path, ": the layer behind has display window ", its.text(),
                             ", the frame ", own.text(), "; render both at one size"));
    constexpr RoleSet kPlanes = {Role::inverse_depth, Role::motion, Role::motion_back,
                                 Role::layers};
    const RoleSet needed = (frame.planes & kPlanes) | RoleSet{Role::inverse_depth};
    RETURN_IF_ERROR(check_roles(path, header, frame.header, needed));
    FrameLayers layers = frame.header.layers;
    layers.filtered_cryptomattes = 0;
    if (const auto lacking = layers_lacking(layers, header.layers); !lacking.empty())
        return Status(StatusCode::input,
                      concat(path, ": the layer behind lacks these layers of the frame: ",
                             joined(lacking), "; render them too, or leave out --layers"));
    behind.planes = needed | RoleSet{Role::color};
    behind.header = std::move(header);
    return behind;
}

uint64_t behind_bytes(const OpenedFrame& behind) {
    const FrameHeader& header = behind.header;
    const uint64_t planes = uint64_t(kBehindPlanes) + header.layers.filtered.size();
    return frame_bytes(header, behind.planes, io::Keep::nothing, header.window.height()) +
           header.window.pixels() * planes * 4 * sizeof(float);
}

Status add_behind(const SourceSettings& settings, const OpenedFrame& behind,
                  const FrameHeader& header, SourceFrame& frame) {
    const char* why = frame.cryptomattes           ? "cryptomattes are filtered (--cryptomatte)"
                      : frame.layers_apart.empty() ? nullptr
                                                   : "a neighboring frame lacks layers";
    if (why) {
        frame.warnings.push_back(concat("filtered without the layer behind: ", why));
        return Status();
    }
    ASSIGN_OR_RETURN(auto source, read_source_frame(settings_of_behind(settings), behind.header,
                                                    behind.planes, io::Keep::nothing));
    if (frame.strict_fault.ok()) frame.strict_fault = source.strict_fault;
    // Those of the header concern layers and cryptomattes, which are the frame's.
    const auto& of_header = behind.header.warnings;
    for (const std::string& warning : source.warnings)
        if (std::ranges::find(of_header, warning) == of_header.end())
            frame.warnings.push_back("the layer behind: " + warning);
    SharedPlanes planes = std::move(source.planes);
    if (frame.description.layers == 0)
        planes.erase(Role::layers);
    else if (const auto layers = planes.find(Role::layers); layers != planes.end())
        layers->second = layers_in_order(*layers->second, behind.header.layers, header.layers);
    if (behind.header.window != header.window)
        for (auto& [role, plane] : planes)
            plane =
                std::make_shared<const ImageF>(moved(*plane, behind.header.window, header.window));
    frame.planes[Role::behind] = std::make_shared<const ImageF>(stack_behind(planes));
    frame.description.planes.add(Role::behind);
    return Status();
}

}  // namespace postchain::sequence
