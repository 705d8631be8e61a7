#include "tools/sequence/filter/cryptomatte_filter.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

// Reach of interpolation in addition to the passes' reach.
constexpr int kMarginPx = 2;

void add_box(std::map<io::CryptoId, io::Window>& boxes, io::CryptoId id, const io::Window& box) {
    const auto [place, is_new] = boxes.emplace(id, box);
    if (!is_new) place->second = place->second.united(box);
}

io::Window moved(const io::Window& box, const io::Window& from, const io::Window& to) {
    const int x = from.min_x - to.min_x, y = from.min_y - to.min_y;
    return {box.min_x + x, box.min_y + y, box.max_x + x, box.max_y + y};
}

// Ranks of a cryptomatte in one frame, and the window that they are of.
struct Ranks {
    const io::RankedCoverage* ranks;
    io::Window window;
};

// The ranks of cryptomatte `index` of the frame in its neighbors that have them.
std::map<Neighbor, Ranks> neighbors_of(const SourceFrame& frame, size_t index) {
    std::map<Neighbor, Ranks> found;
    for (const auto& [neighbor, other] : frame.neighbor_cryptomattes) {
        const auto named =
            std::find(other->names.begin(), other->names.end(), frame.cryptomattes->names[index]);
        if (named != other->names.end() && frame.planes.count(role_of(neighbor, Role::color)))
            found[neighbor] = {&other->ranks[size_t(named - other->names.begin())], other->window};
    }
    return found;
}

using Boxes = std::map<io::CryptoId, io::Window>;

// Boxes of the ids, in the frame's window, of the frame and its neighbors.
Boxes all_boxes(const SourceFrame& frame, size_t index) {
    Boxes boxes = boxes_of(frame.cryptomattes->ranks[index]);
    for (const auto& [neighbor, other] : neighbors_of(frame, index))
        for (const auto& [id, box] : boxes_of(*other.ranks))
            add_box(boxes, id, moved(box, other.window, frame.header.window));
    return boxes;
}

// Boxes of the ids that are filtered.
Boxes filtered_boxes(const SourceFrame& frame, size_t index, Boxes boxes) {
    const auto asked = frame.header.layers.filtered_ids.find(index);
    if (asked == frame.header.layers.filtered_ids.end()) return boxes;
    std::erase_if(boxes, [&](const auto& box) {
        return !std::binary_search(asked->second.begin(), asked->second.end(), box.first);
    });
    return boxes;
}

// Places of a box along a curve of quadrants: neighbors on the curve are neighbors in the frame.
uint64_t place_of(const io::Window& box) {
    uint64_t place = 0;
    const auto x = uint64_t(std::max(box.min_x + box.max_x, 0));
    const auto y = uint64_t(std::max(box.min_y + box.max_y, 0));
    for (uint64_t bit = 0; bit < 20; ++bit)
        place |= (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1);
    return place;
}

// Four slots share a layer, and a layer costs time only near its ids: those of one layer are near
// each other.
void put_near_together(std::vector<std::vector<io::CryptoId>>& slots, const Boxes& boxes) {
    std::stable_sort(slots.begin(), slots.end(), [&](const auto& a, const auto& b) {
        return place_of(boxes.at(a[0])) < place_of(boxes.at(b[0]));
    });
}

// Layers that are filtered with color: the frame's, and its fill mask.
int own_layers(const SourceFrame& frame) {
    return (frame.planes.count(Role::layers) ? frame.description.layers : 0) +
           int(!frame.header.layers.fill_mask.empty());
}

// True if extra layers with ids leave color unchanged: these layers have
// all neighbors that color has, and the frame's own layers keep their format.
bool color_goes_along(const SourceFrame& frame, const std::set<Neighbor>& neighbors,
                      const PlanOptions& options) {
    const bool layered = frame.planes.count(Role::layers) > 0;
    bool along = frame.separate_layers.empty() &&
                 (own_layers(frame) == 0 || options.precision == Precision::fp32);
    for (const Neighbor neighbor : kNeighbors)
        if (frame.planes.count(role_of(neighbor, Role::color)))
            along = along && neighbors.count(neighbor) &&
                    (!layered || frame.planes.count(role_of(neighbor, Role::layers)));
    return along;
}

// Pixels that the coverage of an id moves at most.
int reach_of_ids(const Chain& chain, const FramePlan& plan) {
    return int(std::ceil(std::min(reach_of(chain, plan), double(io::kMaxSide)))) + kMarginPx;
}

bool any_pass_runs(const Plan& plan) {
    return std::any_of(plan.passes.begin(), plan.passes.end(),
                       [](const PlanPass& pass) { return !pass.elided; });
}

}  // namespace

std::map<io::CryptoId, io::Window> boxes_of(const io::RankedCoverage& ranks) {
    std::map<io::CryptoId, io::Window> boxes;
    const size_t count = size_t(ranks.ranks);
    for (int y = 0; y < ranks.height; ++y) {
        for (int x = 0; x < ranks.width; ++x) {
            const size_t pixel = (size_t(y) * size_t(ranks.width) + size_t(x)) * count;
            for (size_t i = pixel; i < pixel + count; ++i)
                if (ranks.ids[i] != 0 && ranks.coverages[i] > 0)
                    add_box(boxes, ranks.ids[i], {x, y, x, y});
        }
    }
    return boxes;
}

std::vector<std::vector<io::CryptoId>> slots_of(const std::map<io::CryptoId, io::Window>& boxes,
                                                int apart_px) {
    std::vector<io::CryptoId> ids;
    for (const auto& [id, box] : boxes) ids.push_back(id);
    // Largest first; on a tie, the smaller id.
    std::stable_sort(ids.begin(), ids.end(), [&](io::CryptoId a, io::CryptoId b) {
        return boxes.at(a).pixels() > boxes.at(b).pixels();
    });
    std::vector<std::vector<io::CryptoId>> slots;
    for (io::CryptoId id : ids) {
        const io::Window around = boxes.at(id).grown(apart_px);
        const auto is_free = [&](const std::vector<io::CryptoId>& slot) {
            return std::all_of(slot.begin(), slot.end(), [&](io::CryptoId other) {
                return boxes.at(other).intersected(around).empty();
            });
        };
        const auto slot = std::find_if(slots.begin(), slots.end(), is_free);
        if (slot == slots.end())
            slots.push_back({id});
        else
            slot->push_back(id);
    }
    return slots;
}

void add_coverage(const io::RankedCoverage& ranks, const io::Window& of, const io::Window& to,
                  const std::map<io::CryptoId, size_t>& slots, ImageF& stack) {
    const io::Window both = of.intersected(to);
    const size_t count = size_t(ranks.ranks);
    io::CryptoId last = 0;
    auto found = slots.end();
    for (int y = both.min_y; y <= both.max_y && !both.empty(); ++y) {
        for (int x = both.min_x; x <= both.max_x; ++x) {
            const size_t pixel =
                (size_t(y - of.min_y) * size_t(ranks.width) + size_t(x - of.min_x)) * count;
            for (size_t i = pixel; i < pixel + count; ++i) {
                const float coverage = ranks.coverages[i];
                if (!(coverage > 0) || !std::isfinite(coverage) || ranks.ids[i] == 0) continue;
                if (ranks.ids[i] != last) found = slots.find(last = ranks.ids[i]);
                if (found == slots.end()) continue;
                const int layer = int(found->second / 4), channel = int(found->second % 4);
                stack.at(x - to.min_x, y - to.min_y + layer * to.height(), channel) += coverage;
            }
        }
    }
}

std::vector<CoverageRun> coverage_runs(const Chain& chain, const FramePlan& plan,
                                       const SourceFrame& frame, const PlanOptions& options) {
    std::vector<CoverageRun> runs;
    if (!frame.cryptomattes || !any_pass_runs(plan)) return runs;
    const int reach_px = reach_of_ids(chain, plan);
    std::map<std::set<Neighbor>, std::vector<CoverageSlot>> groups;
    for (size_t i = 0; i < frame.cryptomattes->ranks.size(); ++i) {
        const Boxes boxes = filtered_boxes(frame, i, all_boxes(frame, i));
        auto slots = slots_of(boxes, 2 * reach_px);
        put_near_together(slots, boxes);
        std::set<Neighbor> neighbors;
        for (const auto& [neighbor, ranks] : neighbors_of(frame, i)) neighbors.insert(neighbor);
        for (auto& ids : slots) groups[neighbors].push_back({i, std::move(ids)});
    }
    for (auto& [neighbors, slots] : groups) {
        bool with_color = color_goes_along(frame, neighbors, options);
        const size_t at_once = 4 * size_t(layers_at_once(frame.header.window.pixels()));
        for (size_t first = 0; first < slots.size(); first += at_once) {
            const size_t end = std::min(slots.size(), first + at_once);
            runs.push_back(
                {neighbors,
                 {slots.begin() + std::ptrdiff_t(first), slots.begin() + std::ptrdiff_t(end)},
                 with_color});
            with_color = false;
        }
    }
    return runs;
}

FrameDescription described(const CoverageRun& run, const SourceFrame& frame,
                           FrameDescription description) {
    if (run.with_color && !frame.header.layers.fill_mask.empty())
        description = with_fill_mask(std::move(description));
    description.layers = run.layers() + (run.with_color ? own_layers(frame) : 0);
    description.bounds.layers_are_half = false;
    description.planes.add(Role::layers);
    for (const Neighbor neighbor : kNeighbors) {
        description.planes.remove(role_of(neighbor, Role::layers));
        if (run.neighbors.count(neighbor)) description.planes.add(role_of(neighbor, Role::layers));
    }
    return description;
}

CryptomatteFilter::CryptomatteFilter(const Chain& chain, const FramePlan& plan,
                                     const SourceFrame& frame, SharedPlanes planes,
                                     const PlanOptions& options, Executor& executor)
    : chain_(chain),
      plan_(plan),
      frame_(frame),
      planes_(std::move(planes)),
      options_(options),
      executor_(executor),
      runs_(coverage_runs(chain, plan, frame, options)) {
    if (!any_pass_runs(plan)) return;
    reach_px_ = reach_of_ids(chain, plan);
    const io::Window& window = frame.header.window;
    for (size_t i = 0; i < frame.cryptomattes->ranks.size(); ++i) {
        Boxes boxes = all_boxes(frame, i);
        const size_t all_ids = boxes.size();
        states_.push_back(
            {filtered_boxes(frame, i, std::move(boxes)), all_ids, 0,
             io::Reranking(window.width(), window.height(), frame.cryptomattes->ranks[i].ranks)});
    }
    for (const CoverageRun& run : runs_)
        for (const CoverageSlot& slot : run.slots) ++states_[slot.cryptomatte].planes;
}

Result<FramePlanes> CryptomatteFilter::filter_color(const StageObserver& observer) {
    for (const CoverageRun& run : runs_)
        if (run.with_color) return filter(run, observer);
    return executor_.filter(plan_, planes_, observer);
}

Result<std::vector<io::RankedCoverage>> CryptomatteFilter::filter_rest(
    std::vector<CryptomatteReport>& reports) {
    for (const CoverageRun& run : runs_) {
        if (run.with_color) continue;
        if (auto result = filter(run, {}); !result.ok()) return result.status().at("cryptomatte");
    }
    std::vector<io::RankedCoverage> filtered;
    for (size_t i = 0; i < states_.size(); ++i) {
        const CryptomatteState& state = states_[i];
        reports.push_back({frame_.header.layers.cryptomattes[i].name, state.boxes.size(),
                           state.all_ids - state.boxes.size(), state.planes,
                           state.ranking.pixels_short(), state.ranking.largest_lost()});
        filtered.push_back(state.ranking.result());
    }
    return filtered;
}

// The run's ids below the frame's own layers, if color goes along.
ImageF CryptomatteFilter::stacked(const CoverageRun& run, std::optional<Neighbor> neighbor) const {
    const io::Window& window = frame_.header.window;
    const int own = run.with_color ? own_layers(frame_) : 0;
    ImageF stack(window.width(), window.height() * (own + run.layers()), 4);
    const Role role = neighbor ? role_of(*neighbor, Role::layers) : Role::layers;
    if (own > 0) {
        const ImageF& plane = *planes_.at(role);
        std::copy(plane.data.begin(), plane.data.end(), stack.data.begin());
    }
    for (size_t i = 0; i < states_.size(); ++i) {
        std::map<io::CryptoId, size_t> places;
        for (size_t slot = 0; slot < run.slots.size(); ++slot)
            if (run.slots[slot].cryptomatte == i)
                for (const io::CryptoId id : run.slots[slot].ids)
                    places[id] = 4 * size_t(own) + slot;
        if (places.empty()) continue;
        const Ranks ranks = neighbor ? neighbors_of(frame_, i).at(*neighbor)
                                     : Ranks{&frame_.cryptomattes->ranks[i], window};
        add_coverage(*ranks.ranks, ranks.window, window, places, stack);
    }
    return stack;
}

Result<FramePlanes> CryptomatteFilter::filter(const CoverageRun& run,
                                              const StageObserver& observer) {
    SharedPlanes planes = planes_;
    planes[Role::layers] = std::make_shared<const ImageF>(stacked(run, {}));
    for (const Neighbor neighbor : kNeighbors) {
        planes.erase(role_of(neighbor, Role::layers));
        if (run.neighbors.count(neighbor))
            planes[role_of(neighbor, Role::layers)] =
                std::make_shared<const ImageF>(stacked(run, neighbor));
    }
    ASSIGN_OR_RETURN(auto plan,
                     make_plan(chain_, described(run, frame_, plan_.description), options_));
    ASSIGN_OR_RETURN(auto result, executor_.filter(plan, planes, observer));
    ImageF& layers = result.at(Role::layers);
    const int own = run.with_color ? own_layers(frame_) : 0;
    const int width = frame_.header.window.width(), height = frame_.header.window.height();
    for (size_t slot = 0; slot < run.slots.size(); ++slot) {
        CryptomatteState& state = states_[run.slots[slot].cryptomatte];
        for (const io::CryptoId id : run.slots[slot].ids)
            state.ranking.add(
                id, layers, int(slot % 4),
                state.boxes.at(id).grown(reach_px_).intersected({0, 0, width - 1, height - 1}),
                (own + int(slot / 4)) * height);
    }
    if (own == 0) {
        result.erase(Role::layers);
    } else {
        layers.height = own * height;
        layers.data.resize(layers.pixels() * 4);
    }
    return result;
}

ImageF stored_level(const io::RankedCoverage& ranks, int level) {
    ImageF image(ranks.width, ranks.height, 4);
    for (size_t pixel = 0; pixel < image.pixels(); ++pixel) {
        const size_t from = pixel * size_t(ranks.ranks) + size_t(2 * level);
        for (size_t i = 0; i < 2; ++i) {
            image.data[4 * pixel + 2 * i] = std::bit_cast<float>(ranks.ids[from + i]);
            image.data[4 * pixel + 2 * i + 1] = ranks.coverages[from + i];
        }
    }
    return image;
}

}  // namespace postchain::sequence
