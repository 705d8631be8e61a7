#include "tools/sequence/source/neighbor_planes.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "chain/base/text.h"
#include "chain/frame/behind.h"
#include "chain/frame/layers.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {

namespace {

// Moves a plane, or stacked planes, from the window `from` to the window `to`.
ImageF moved(const ImageF& plane, const io::Window& from, const io::Window& to) {
    std::vector<ImageF> planes;
    for (int i = 0; i < plane.height / from.height(); ++i)
        planes.push_back(io::placed(plane_of_stack(plane, i, from.height()), from, to));
    return stack_planes(planes);
}

using LayerKey = std::pair<std::string, int>;

std::vector<LayerKey> keys_of(const FrameLayers& layers) {
    std::map<std::string, int> count;
    std::vector<LayerKey> keys;
    for (const FileLayer& layer : layers.filtered)
        keys.emplace_back(layer.name, count[layer.name]++);
    return keys;
}

std::shared_ptr<const ImageF> chosen_planes(const ImageF& stack, const std::vector<size_t>& chosen,
                                            int height) {
    std::vector<ImageF> planes;
    for (size_t index : chosen) planes.push_back(plane_of_stack(stack, int(index), height));
    return std::make_shared<const ImageF>(stack_planes(planes));
}

void hand_in(SourceFrame& frame, Role role, std::shared_ptr<const ImageF> plane) {
    frame.planes[role] = std::move(plane);
    frame.description.planes.add(role);
}

// A stack of the layers filtered in `of`, as `wanted` orders them, which lacks none of them.
std::shared_ptr<const ImageF> layers_in_order(const ImageF& stack, const FrameLayers& of,
                                              const FrameLayers& wanted) {
    const auto theirs = keys_of(of);
    std::vector<size_t> places;
    for (const LayerKey& key : keys_of(wanted))
        places.push_back(size_t(std::find(theirs.begin(), theirs.end(), key) - theirs.begin()));
    return chosen_planes(stack, places, stack.height / int(theirs.size()));
}

// A neighbor in use: its header and its layer plane in the frame's window, if it has layers.
struct NeighborLayers {
    const FrameLayers* found = nullptr;
    std::shared_ptr<const ImageF> plane;
};

// Adds to `frame` the neighbors' layers that it has too, in its order. Layers that a neighbor lacks
// move from the planes to SourceFrame::separate_layers.
void split_layers(const std::map<Neighbor, NeighborLayers>& neighbors, SourceFrame& frame) {
    const auto own = frame.planes.find(Role::layers);
    if (own == frame.planes.end()) return;
    const auto all = own->second;
    const int height = frame.description.height;
    const std::vector<LayerKey> keys = keys_of(frame.header.layers);
    // For each neighbor, the index of each of the frame's layers.
    std::map<Neighbor, std::map<size_t, size_t>> places;
    for (const auto& [neighbor, layers] : neighbors) {
        const std::vector<LayerKey> theirs = keys_of(*layers.found);
        for (size_t i = 0; i < keys.size() && layers.plane; ++i)
            if (const auto at = std::find(theirs.begin(), theirs.end(), keys[i]);
                at != theirs.end())
                places[neighbor][i] = size_t(at - theirs.begin());
    }
    std::map<std::set<Neighbor>, std::vector<size_t>> groups;  // by the neighbors that lack them
    for (size_t i = 0; i < keys.size(); ++i) {
        std::set<Neighbor> without;
        for (const auto& [neighbor, layers] : neighbors)
            if (!places[neighbor].contains(i)) without.insert(neighbor);
        groups[without].push_back(i);
    }
    frame.planes.erase(Role::layers);
    frame.description.planes.remove(Role::layers);
    frame.description.layers = 0;
    for (const auto& [without, layers] : groups) {
        SharedPlanes planes;
        planes[Role::layers] =
            layers.size() == keys.size() ? all : chosen_planes(*all, layers, height);
        for (const auto& [neighbor, of_neighbor] : neighbors) {
            if (without.contains(neighbor)) continue;
            std::vector<size_t> theirs;
            for (size_t i : layers) theirs.push_back(places[neighbor].at(i));
            const size_t count = of_neighbor.found->filtered.size();
            const bool whole =
                theirs.size() == count && std::is_sorted(theirs.begin(), theirs.end());
            planes[role_of(neighbor, Role::layers)] =
                whole ? of_neighbor.plane : chosen_planes(*of_neighbor.plane, theirs, height);
        }
        if (!without.empty()) {
            frame.separate_layers.push_back({layers, std::move(planes)});
            continue;
        }
        for (auto& [role, plane] : planes) hand_in(frame, role, std::move(plane));
        frame.description.layers = int(layers.size());
    }
}

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

std::vector<std::string> layers_lacking(const FrameLayers& frame, const FrameLayers& other) {
    std::vector<std::string> lacking;
    const auto theirs = keys_of(other);
    for (const LayerKey& key : keys_of(frame))
        if (std::find(theirs.begin(), theirs.end(), key) == theirs.end())
            lacking.push_back(key.first);
    for (size_t i = 0; i < frame.filtered_cryptomattes; ++i) {
        const auto end = other.cryptomattes.begin() + std::ptrdiff_t(other.filtered_cryptomattes);
        const std::string& name = frame.cryptomattes[i].name;
        if (std::none_of(other.cryptomattes.begin(), end,
                         [&](const io::Cryptomatte& one) { return one.name == name; }))
            lacking.push_back(name);
    }
    return lacking;
}

void add_neighbors(const std::map<Neighbor, NeighborFrame>& neighbors, SourceFrame& frame) {
    const io::Window& window = frame.header.window;
    std::map<Neighbor, NeighborLayers> layers;
    for (const auto& [neighbor, other] : neighbors) {
        const io::Window& there = other.header->window;
        for (Role role : kNeighborRoles) {
            if (!frame.header.to_read.of(neighbor).has(role)) continue;
            if (role == Role::layers && other.cryptomattes)
                frame.neighbor_cryptomattes[neighbor] = other.cryptomattes;
            if (role == Role::layers) layers[neighbor].found = &other.header->layers;
            const auto found = other.planes->find(role);
            if (found == other.planes->end()) continue;  // only layers of a cryptomatte, or none
            auto plane = found->second;
            if (window != there)
                plane = std::make_shared<const ImageF>(moved(*plane, there, window));
            if (role == Role::layers) {
                layers[neighbor].plane = std::move(plane);
                continue;
            }
            frame.planes[role_of(neighbor, role)] = std::move(plane);
            frame.description.planes.add(role_of(neighbor, role));
        }
    }
    if (!layers.empty()) split_layers(layers, frame);
}

Result<FrameHeader> open_behind(const SourceSettings& settings, const std::string& path,
                                const FrameHeader& frame) {
    ASSIGN_OR_RETURN(auto behind,
                     open_source_frame(settings_of_behind(settings), {{Role::color, path}},
                                       frame.files.frame_number));
    return behind_of(std::move(behind), frame);
}

Result<FrameHeader> behind_of(FrameHeader behind, const FrameHeader& frame) {
    const std::string path = color_path(behind);
    if (!behind.match.view.empty() && behind.match.view != frame.match.view)
        return Status(StatusCode::input, concat(path, ": the layer behind has no view ",
                                                frame.match.view, "; render it with this view"));
    const io::Window own = color_part(frame).display_window,
                     its = color_part(behind).display_window;
    if (own != its)
        return Status(StatusCode::input,
                      concat(path, ": the layer behind has display window ", its.text(),
                             ", the frame ", own.text(), "; render both at one size"));
    constexpr RoleSet kPlanes = {Role::inverse_depth, Role::motion, Role::motion_back,
                                 Role::layers};
    const RoleSet needed = (frame.to_read & kPlanes) | RoleSet{Role::inverse_depth};
    RETURN_IF_ERROR(check_roles(path, behind, frame, needed));
    FrameLayers layers = frame.layers;
    layers.filtered_cryptomattes = 0;
    if (const auto lacking = layers_lacking(layers, behind.layers); !lacking.empty())
        return Status(StatusCode::input,
                      concat(path, ": the layer behind lacks these layers of the frame: ",
                             joined(lacking), "; render them too, or leave out {aovs}"_keyed));
    behind.to_read = needed | RoleSet{Role::color};
    return behind;
}

uint64_t behind_bytes(const FrameHeader& behind) {
    const uint64_t planes = uint64_t(kBehindPlanes) + behind.layers.filtered.size();
    return frame_bytes(behind, behind.to_read, io::Keep::nothing, behind.window.height()) +
           behind.window.pixels() * planes * 4 * sizeof(float);
}

Status add_behind(const SourceSettings& settings, const FrameHeader& behind, SourceFrame& frame) {
    const std::string why = frame.cryptomattes ? "cryptomattes are filtered ({cryptomatte})"_keyed
                            : frame.separate_layers.empty() ? ""
                                                            : "a neighboring frame lacks layers";
    if (!why.empty()) {
        frame.warnings.push_back(concat("filtered without the layer behind: ", why));
        return Status();
    }
    ASSIGN_OR_RETURN(auto source, read_source_frame(settings_of_behind(settings), behind,
                                                    behind.to_read, io::Keep::nothing));
    if (frame.strict_fault.ok()) frame.strict_fault = source.strict_fault;
    // The header's warnings concern layers and cryptomattes, which are the frame's.
    const auto& of_header = behind.warnings;
    for (const std::string& warning : source.warnings)
        if (std::ranges::find(of_header, warning) == of_header.end())
            frame.warnings.push_back("the layer behind: " + warning);
    SharedPlanes planes = std::move(source.planes);
    if (frame.description.layers == 0)
        planes.erase(Role::layers);
    else if (const auto layers = planes.find(Role::layers); layers != planes.end())
        layers->second = layers_in_order(*layers->second, behind.layers, frame.header.layers);
    const io::Window& window = frame.header.window;
    if (behind.window != window)
        for (auto& [role, plane] : planes)
            plane = std::make_shared<const ImageF>(moved(*plane, behind.window, window));
    frame.planes[Role::behind] = std::make_shared<const ImageF>(stack_behind(planes));
    frame.description.planes.add(Role::behind);
    return Status();
}

}  // namespace postchain::sequence
