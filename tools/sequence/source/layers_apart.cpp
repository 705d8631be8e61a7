#include "tools/sequence/source/layers_apart.h"

#include <algorithm>
#include <set>
#include <utility>

#include "chain/layers.h"

namespace postchain::sequence {
namespace {

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

std::shared_ptr<const ImageF> layers_in_order(const ImageF& stack, const FrameLayers& of,
                                              const FrameLayers& wanted) {
    const auto theirs = keys_of(of);
    std::vector<size_t> places;
    for (const LayerKey& key : keys_of(wanted))
        places.push_back(size_t(std::find(theirs.begin(), theirs.end(), key) - theirs.begin()));
    return chosen_planes(stack, places, stack.height / int(theirs.size()));
}

void set_apart(const std::map<Neighbor, NeighborLayers>& neighbors, SourceFrame& frame) {
    const auto own = frame.planes.find(Role::layers);
    if (own == frame.planes.end()) return;
    const auto all = own->second;
    const int height = frame.description.height;
    const std::vector<LayerKey> keys = keys_of(frame.layers);
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
            frame.layers_apart.push_back({layers, std::move(planes)});
            continue;
        }
        for (auto& [role, plane] : planes) hand_in(frame, role, std::move(plane));
        frame.description.layers = int(layers.size());
    }
}

Result<ImageF> filter_apart(const Chain& chain, const SourceFrame& frame,
                            const PlanOptions& options, Executor& executor,
                            const ImageF& together) {
    const int height = frame.description.height;
    std::vector<ImageF> filtered(frame.layers.filtered.size());
    for (const LayersApart& group : frame.layers_apart) {
        SharedPlanes planes = frame.planes;
        FrameDescription description = planned_description(chain, frame);
        description.layers = int(group.layers.size());
        for (Role role : {Role::layers, Role::layers_before, Role::layers_after}) {
            planes.erase(role);
            description.planes.remove(role);
            const auto plane = group.planes.find(role);
            if (plane == group.planes.end()) continue;
            planes[role] = plane->second;
            description.planes.add(role);
        }
        ASSIGN_OR_RETURN(const auto plan, make_plan(chain, description, options));
        ASSIGN_OR_RETURN(const auto result, executor.filter(plan, planes, {}));
        for (size_t i = 0; i < group.layers.size(); ++i)
            filtered[group.layers[i]] = plane_of_stack(result.at(Role::layers), int(i), height);
    }
    int next = 0;
    for (ImageF& layer : filtered)
        if (layer.empty()) layer = plane_of_stack(together, next++, height);
    return stack_planes(filtered);
}

}  // namespace postchain::sequence
