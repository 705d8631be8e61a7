#include "tools/sequence/run/cryptomatte_filter.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/sequence/run/written_window.h"

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

// One cryptomatte of a frame and of its available neighbors.
struct Sources {
    const io::RankedCoverage* own = nullptr;
    std::map<Neighbor, std::pair<const io::RankedCoverage*, io::Window>> neighbors;
};

Sources sources_of(const SourceFrame& frame, size_t index) {
    Sources sources{&frame.cryptomattes->ranks[index], {}};
    for (const auto& [neighbor, other] : frame.neighbor_cryptomattes) {
        const auto named =
            std::find(other->names.begin(), other->names.end(), frame.cryptomattes->names[index]);
        if (named != other->names.end() && frame.planes.count(role_of(neighbor, Role::color)))
            sources.neighbors[neighbor] = {&other->ranks[size_t(named - other->names.begin())],
                                           other->window};
    }
    return sources;
}

class OneFilter {
  public:
    OneFilter(const Chain& chain, const SourceFrame& frame, const PlanOptions& options,
              Executor& executor, const Sources& sources, int reach_px)
        : chain_(chain),
          frame_(frame),
          options_(options),
          executor_(executor),
          sources_(sources),
          reach_px_(reach_px),
          window_(frame.input.window),
          boxes_(boxes_of(*sources.own)) {
        for (const auto& [neighbor, other] : sources.neighbors)
            for (const auto& [id, box] : boxes_of(*other.first))
                add_box(boxes_, id, moved(box, other.second, window_));
    }

    Result<io::RankedCoverage> filter(CryptomatteReport& report) {
        const auto slots = slots_of(boxes_, 2 * reach_px_);
        const size_t layers =
            std::min(size_t(layers_at_once(window_.pixels())), (slots.size() + 3) / 4);
        io::Reranking ranking(window_.width(), window_.height(), sources_.own->ranks);
        for (size_t first = 0; first < slots.size(); first += 4 * layers) {
            const size_t end = std::min(slots.size(), first + 4 * layers);
            if (Status status = filter_slots(slots, first, end, int(layers), ranking); !status.ok())
                return status;
        }
        report.ids = boxes_.size();
        report.planes = slots.size();
        report.pixels_short = ranking.pixels_short();
        report.largest_lost = ranking.largest_lost();
        return ranking.result();
    }

  private:
    Status filter_slots(const std::vector<std::vector<io::CryptoId>>& slots, size_t first,
                        size_t end, int layers, io::Reranking& ranking) {
        std::map<io::CryptoId, size_t> place;
        for (size_t slot = first; slot < end; ++slot)
            for (io::CryptoId id : slots[slot]) place[id] = slot - first;
        SharedPlanes planes = frame_.planes;
        FrameDescription description = planned_description(chain_, frame_);
        description.layers = layers;
        description.bounds.layers_are_half = false;
        const auto hand_in = [&](Role role, ImageF stack) {
            planes[role] = std::make_shared<const ImageF>(std::move(stack));
            description.planes.add(role);
        };
        hand_in(Role::layers, coverage_layers(*sources_.own, window_, window_, place, layers));
        for (Neighbor neighbor : kNeighbors) {
            const Role role = role_of(neighbor, Role::layers);
            planes.erase(role);
            description.planes.remove(role);
            if (const auto other = sources_.neighbors.find(neighbor);
                other != sources_.neighbors.end())
                hand_in(role, coverage_layers(*other->second.first, other->second.second, window_,
                                              place, layers));
        }
        auto plan = make_plan(chain_, description, options_);
        if (!plan.ok()) return plan.status();
        auto result = executor_.filter(*plan, planes, {});
        if (!result.ok()) return result.status();
        const ImageF& filtered = result->at(Role::layers);
        const int height = window_.height();
        for (const auto& [id, slot] : place) {
            const io::Window reached =
                boxes_.at(id).grown(reach_px_).intersected({0, 0, window_.width() - 1, height - 1});
            ranking.add(id, filtered, int(slot % 4), reached, int(slot / 4) * height);
        }
        return Status();
    }

    const Chain& chain_;
    const SourceFrame& frame_;
    const PlanOptions& options_;
    Executor& executor_;
    const Sources& sources_;
    const int reach_px_;
    const io::Window window_;
    std::map<io::CryptoId, io::Window> boxes_;
};

}  // namespace

int layers_at_once(uint64_t pixels) {
    const uint64_t layer = pixels * 4 * sizeof(float);
    return int(std::clamp<uint64_t>((uint64_t(1) << 28) / layer, 1, 16));
}

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

ImageF coverage_layers(const io::RankedCoverage& ranks, const io::Window& of, const io::Window& to,
                       const std::map<io::CryptoId, size_t>& slots, int layers) {
    ImageF stack(to.width(), to.height() * layers, 4);
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
    return stack;
}

Result<std::vector<io::RankedCoverage>> filter_cryptomattes(
    const Chain& chain, const Plan& plan, const SourceFrame& frame, const PlanOptions& options,
    Executor& executor, std::vector<CryptomatteReport>& reports) {
    std::vector<io::RankedCoverage> filtered;
    const int reach_px =
        int(std::ceil(std::min(reach_of(chain, plan, frame), double(io::kMaxSide)))) + kMarginPx;
    for (size_t i = 0; i < frame.cryptomattes->ranks.size(); ++i) {
        const Sources sources = sources_of(frame, i);
        CryptomatteReport report;
        report.name = frame.layers.cryptomattes[i].name;
        OneFilter filter(chain, frame, options, executor, sources, reach_px);
        auto ranks = filter.filter(report);
        if (!ranks.ok()) return ranks.status().at("cryptomatte " + report.name);
        filtered.push_back(std::move(*ranks));
        reports.push_back(std::move(report));
    }
    return filtered;
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
