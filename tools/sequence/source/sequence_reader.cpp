#include "tools/sequence/source/sequence_reader.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "chain/base/text.h"
#include "tools/sequence/source/neighbor_planes.h"

namespace postchain::sequence {

RoleSet planes_to_read(const FrameHeader& header, RoleSet wanted) {
    const RoleSet own = roles_in_files(header);
    // Mattes exist if a chain names them; they are then read with any other plane.
    RoleSet planes = RoleSet{Role::color} | (own & (wanted | RoleSet{Role::mattes}));
    for (Neighbor neighbor : kNeighbors) {
        for (Role role : kNeighborRoles) {
            const Role with = role == Role::mattes ? Role::color : role;
            if (!own.has(role) || !wanted.of(neighbor).has(with)) continue;
            planes.add(role);
            planes.add(role_of(neighbor, role));
        }
    }
    return planes;
}

io::InputSpec input_of_neighbors(io::InputSpec input) {
    input.patterns.erase(Role::behind);
    return input;
}

std::vector<io::FileStamp> FrameToRead::stamps() const {
    std::vector<io::FileStamp> stamps;
    const auto add = [&](const FrameHeader& header) {
        for (const auto& [role, stamp] : header.files.stamps) stamps.push_back(stamp);
    };
    add(*frame);
    for (const auto& [neighbor, other] : neighbors) add(*other);
    if (behind) add(*behind);
    return stamps;
}

struct SequenceReader::Entry {
    FrameHeader header;
    bool is_neighbor_only = false;  // it lacks a layer that was requested by name
    bool is_decoded = false;
    Status status;  // result of decoding
    SharedPlanes pixels;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
    Status strict_fault;
    std::optional<SourceFrame> source;  // until it is handed out
};

SequenceReader::SequenceReader(const SourceSettings& settings, io::InputSpec input,
                               PlanesOf planes_of, IsWhole whole)
    : settings_(settings),
      input_(std::move(input)),
      planes_of_(std::move(planes_of)),
      whole_(std::move(whole)) {}

SequenceReader::~SequenceReader() = default;

std::shared_ptr<const FrameHeader> SequenceReader::header_in(const std::shared_ptr<Entry>& entry) {
    return {entry, &entry->header};
}

Result<FrameToRead> SequenceReader::open(int number, const std::map<Role, std::string>& files) {
    std::erase_if(window_, [&](const auto& entry) {
        return entry.first < number - 1 || entry.first > number + 1 ||
               (entry.first == number && entry.second->is_neighbor_only);
    });
    ASSIGN_OR_RETURN(auto entry, enter(number, files));
    FrameToRead opened;
    opened.frame = header_in(entry);
    const FrameHeader& frame = *opened.frame;
    for (Neighbor neighbor : kNeighbors)
        if (!frame.to_read.of(neighbor).empty()) find_neighbor(neighbor, opened);
    // A file of its own, or the deep file of color.
    const auto own = files.find(Role::behind);
    const bool given = own != files.end();
    if (!given && !frame.has_behind) return opened;
    const std::string& path = given ? own->second : files.at(Role::color);
    if (!frame.to_read.has(Role::behind)) {
        if (given)
            opened.warnings.push_back(
                concat(path,
                       ": not read: no pass of the chain takes light from the layer behind "
                       "on this frame (inverse warps do)"));
        return opened;
    }
    if (given) RETURN_IF_ERROR(tried(path, number));
    auto behind = open_behind(settings_, path, frame);
    if (!behind.ok() && (given || behind.status().code() == StatusCode::memory))
        return behind.status();
    if (!behind.ok()) {
        opened.warnings.push_back(
            concat("filtered without the layer behind: ", behind.status().message()));
        return opened;
    }
    opened.behind = std::make_shared<const FrameHeader>(std::move(*behind));
    return opened;
}

Result<std::shared_ptr<SequenceReader::Entry>> SequenceReader::enter(
    int number, const std::map<Role, std::string>& files) {
    if (const auto found = window_.find(number); found != window_.end()) return found->second;
    // A neighbor needs no layer behind, so a frame's own is opened apart.
    std::map<Role, std::string> own = files;
    own.erase(Role::behind);
    for (const auto& [role, path] : own) RETURN_IF_ERROR(tried(path, number));
    auto entry = std::make_shared<Entry>();
    FrameHeader& header = entry->header;
    ASSIGN_OR_RETURN(header, open_source_frame(settings_, own, number));
    if (input_.patterns.contains(Role::behind)) header.has_behind = true;
    header.to_read = planes_to_read(header, planes_of_(header));
    window_[number] = entry;
    return entry;
}

std::set<Neighbor> SequenceReader::reads_with(int number,
                                              const std::map<Role, std::string>& files) {
    std::set<Neighbor> neighbors;
    const auto header = open_source_frame(settings_, files, number);
    if (!header.ok()) return neighbors;
    const RoleSet planes = planes_to_read(*header, planes_of_(*header));
    for (Neighbor neighbor : kNeighbors) {
        const int cut = neighbor == Neighbor::before ? number - 1 : number;
        const bool reads = !planes.of(neighbor).empty() || header->looked_for_cameras;
        if (reads && !settings_.cuts.contains(cut)) neighbors.insert(neighbor);
    }
    return neighbors;
}

void SequenceReader::find_neighbor(Neighbor neighbor, FrameToRead& opened) {
    const FrameHeader& frame = *opened.frame;
    const int own_number = frame.files.frame_number;
    const int number = own_number + frames_to(neighbor);
    std::string& why = opened.missing[neighbor];
    why = absence(own_number, neighbor);
    if (!why.empty()) return;
    auto other = enter(number, on_disk_->at(number));
    if (other.status().code() == StatusCode::usage) {
        // Read for its color, with whichever layers it has.
        settings_.layers.only_present = true;
        other = enter(number, on_disk_->at(number));
        settings_.layers.only_present = false;
        if (other.ok()) (*other)->is_neighbor_only = true;
    }
    if (!other.ok()) {
        why = other.status().message();
        opened.warnings.push_back(
            concat("filtered without the frame ", name_of(neighbor), ": ", why));
        return;
    }
    const FrameHeader& there = (*other)->header;
    const io::Window &own = color_part(frame).display_window,
                     &its = color_part(there).display_window;
    // Its color is used even if it lacks layers, or motion_back, as at a cut.
    const RoleSet lacking =
        frame.to_read.of(neighbor) - there.to_read - RoleSet{Role::layers, Role::motion_back};
    if (there.motion_crosses_cut)
        why = concat("the motion of frame ", number, " crosses a cut");
    else if (there.match.view != frame.match.view)
        why = concat("frame ", number, " has no view ", frame.match.view);
    else if (own != its)
        why =
            concat("frame ", number, " has display window ", its.text(), ", this one ", own.text());
    else if (!lacking.empty())
        why = concat("frame ", number, " has no ", lacking.text());
    if (!why.empty()) return;
    if (frame.to_read.of(neighbor).has(Role::layers))
        if (const auto layers = layers_lacking(frame.layers, there.layers); !layers.empty())
            opened.warnings.push_back(concat("filtered without the frame ", name_of(neighbor),
                                             ", which lacks these layers: ", joined(layers),
                                             "; render them in every frame"));
    opened.missing.erase(neighbor);
    opened.neighbors[neighbor] = header_in(*other);
}

// Why the frame does not exist; empty if it does.
std::string SequenceReader::absence(int number, Neighbor neighbor) {
    if (!input_.color().has_token()) return "the input is one file";
    if (!on_disk_) {
        auto list = io::find_frames(input_of_neighbors(input_), std::nullopt);
        on_disk_ = std::make_shared<const FramesOnDisk>(list.ok() ? std::move(list->files)
                                                                  : FramesOnDisk());
    }
    const bool before = neighbor == Neighbor::before;
    const int wanted = number + frames_to(neighbor);
    const auto beyond = before ? on_disk_->lower_bound(number) : on_disk_->upper_bound(number);
    if (beyond == (before ? on_disk_->begin() : on_disk_->end()))
        return concat("frame ", number, " is the ", before ? "first" : "last", " on disk");
    const int nearest = before ? std::prev(beyond)->first : beyond->first;
    if (nearest != wanted)
        return concat("frame ", wanted, " is not on disk, and frame ", nearest, " is not the ",
                      before ? "previous" : "next", " one");
    const int cut = before ? wanted : number;
    if (settings_.cuts.count(cut)) return concat("a cut follows frame ", cut);
    return "";
}

Status SequenceReader::decode(Entry& entry) {
    if (entry.is_decoded) return entry.status;
    entry.is_decoded = true;
    ++decoded_;
    auto source = read_source_frame(
        settings_, entry.header, entry.header.to_read,
        whole_ && whole_(entry.header.files.frame_number) ? io::Keep::all : io::Keep::nothing);
    entry.status = source.status();
    if (!source.ok()) return entry.status;
    entry.pixels = source->planes;
    entry.cryptomattes = source->cryptomattes;
    entry.strict_fault = source->strict_fault;
    entry.source = std::move(*source);
    return Status();
}

Result<SourceFrame> SequenceReader::read(const FrameToRead& opened) {
    Entry& entry = *window_.at(opened.frame->files.frame_number);
    // A held frame replaces several frames: it is read for each of them.
    if (entry.status.ok() && !entry.source) entry.is_decoded = false;
    RETURN_IF_ERROR(decode(entry));
    SourceFrame frame = std::move(*entry.source);
    entry.source.reset();
    frame.description.missing_neighbors = opened.missing;
    frame.warnings.insert(frame.warnings.end(), opened.warnings.begin(), opened.warnings.end());
    std::map<Neighbor, NeighborFrame> neighbors;
    for (const auto& [neighbor, header] : opened.neighbors) {
        Entry& other = *window_.at(header->files.frame_number);
        if (Status status = decode(other); !status.ok()) {
            // Otherwise the result would depend on the machine's memory.
            if (status.code() == StatusCode::memory) return status;
            const std::string why = status.message();
            frame.description.missing_neighbors[neighbor] = why;
            frame.warnings.push_back(
                concat("filtered without the frame ", name_of(neighbor), ": ", why));
            continue;
        }
        neighbors[neighbor] = {&other.header, &other.pixels, other.cryptomattes};
        if (frame.strict_fault.ok()) frame.strict_fault = other.strict_fault;
    }
    add_neighbors(neighbors, frame);
    compare_slow_motion(frame);
    if (opened.behind) RETURN_IF_ERROR(add_behind(settings_, *opened.behind, frame));
    if (opened.neighbors.empty()) {
        entry.pixels.clear();
        entry.cryptomattes.reset();
        entry.is_decoded = false;
    }
    return frame;
}

// plan_warnings() compares vectors far below a pixel with the color of a neighbor that the chain
// reads. If it reads none, the first such frame is compared here.
void SequenceReader::compare_slow_motion(SourceFrame& frame) {
    const double speed = frame.findings.health.fastest_stored_px;
    if (compared_slow_motion_ || !frame.description.planes.has(Role::motion) ||
        doubt_of_speed(speed, 1).empty())
        return;
    for (const Neighbor neighbor : kNeighbors)
        if (frame.planes.contains(role_of(neighbor, Role::color))) return;
    const int number = frame.description.frame_number;
    for (const Neighbor neighbor : {Neighbor::after, Neighbor::before}) {
        if (!absence(number, neighbor).empty()) continue;
        const int other = number + frames_to(neighbor);
        const std::string& path = on_disk_->at(other).at(Role::color);
        if (!tried(path, other).ok()) continue;
        auto color = read_color(settings_, path, other);
        if (!color.ok()) continue;
        compared_slow_motion_ = true;
        const double change =
            color_change(*frame.planes.at(Role::color),
                         io::placed(color->rgba, color->window, frame.header.window));
        if (const std::string doubt = doubt_of_speed(speed, change); !doubt.empty())
            frame.warnings.push_back(concat(color_path(frame.header), ": ", doubt));
        return;
    }
}

}  // namespace postchain::sequence
