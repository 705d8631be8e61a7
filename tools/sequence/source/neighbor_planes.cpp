#include "tools/sequence/source/neighbor_planes.h"

#include <vector>

#include "chain/layers.h"
#include "tools/sequence/source/layers_apart.h"

namespace postchain::sequence {

ImageF moved(const ImageF& plane, const io::Window& from, const io::Window& to) {
    std::vector<ImageF> planes;
    for (int i = 0; i < plane.height / from.height(); ++i)
        planes.push_back(io::placed(plane_of_stack(plane, i, from.height()), from, to));
    return stack_planes(planes);
}

void add_neighbors(const std::map<Neighbor, NeighborFrame>& neighbors, RoleSet planes,
                   const io::Window& window, SourceFrame& frame) {
    std::map<Neighbor, NeighborLayers> layers;
    for (const auto& [neighbor, other] : neighbors) {
        const io::Window& there = other.header->window;
        for (Role role : kNeighborRoles) {
            if (!planes.of(neighbor).has(role)) continue;
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
    if (!layers.empty()) set_apart(layers, frame);
}

}  // namespace postchain::sequence
