#include "tools/openfx/node.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "chain/frame/behind.h"
#include "chain/frame/layers.h"
#include "chain/pass/depth_at.h"
#include "chain/pass/matte.h"
#include "config/chain_file.h"
#include "config/chain_find.h"
#include "passes/registry.h"
#include "tools/sequence/source/camera_motion.h"
#include "tools/sequence/source/memory_limit.h"
#include "tools/sequence/source/reduced_lengths.h"
#include "tools/sequence/source/surface_edges.h"

namespace postchain::openfx {
namespace {

// Beyond this a host's region is infinite.
constexpr double kInfinite = 1e6;
// Pixels of a side: most devices' limit of a texture, and the command's of a frame.
constexpr int kMaxSide = 16384;

// Canonical coordinates -> pixels.
Bounds pixels_of(const Region& region, const Moment& moment, double pixel_aspect) {
    const auto pixel = [](double at, double scale) { return int(std::lround(at * scale)); };
    const double x = moment.scale_x / pixel_aspect;
    return {pixel(region.x1, x), pixel(region.y1, moment.scale_y), pixel(region.x2, x),
            pixel(region.y2, moment.scale_y)};
}

bool is_finite(const Region& region) {
    return std::max({std::abs(region.x1), std::abs(region.y1), std::abs(region.x2),
                     std::abs(region.y2)}) < kInfinite;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find('\n', at), text.size());
        if (end > at) lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

// The farthest depth of an encoding, for pixels that an image does not have.
float farthest(const Conventions& conventions) {
    switch (conventions.options.depth) {
        case DepthEncoding::linear:
        case DepthEncoding::ray_distance:
            return 1e10f;
        case DepthEncoding::forward:
        case DepthEncoding::forward_infinite:
            return 1;
        default:
            return 0;
    }
}

// Channels of an image in a window, rows from the top. `outside`: of pixels that it does not have.
// A channel that it does not have is 1 as the fourth, an alpha, and the first one otherwise.
ImageF plane_of(const HostImage& image, const Bounds& window, std::initializer_list<int> channels,
                float outside) {
    ImageF plane(window.width(), window.height(), int(channels.size()), outside);
    const Bounds part = window.intersected(image.bounds());
    if (part.empty()) return plane;
    std::vector<float> row(size_t(part.width()) * size_t(image.channels()));
    for (int y = part.y1; y < part.y2; ++y) {
        image.read(part.x1, y, part.width(), row.data());
        float* to = plane.pixel(part.x1 - window.x1, window.y2 - 1 - y);
        const float* from = row.data();
        for (int x = part.x1; x < part.x2; ++x, from += image.channels())
            for (const int channel : channels)
                *to++ = channel < image.channels() ? from[channel]
                        : image.channels() == 3    ? 1.0f
                                                   : from[0];
    }
    return plane;
}

}  // namespace

int Moment::frame() const {
    return int(std::lround(time));
}

Result<std::shared_ptr<const CameraFile>> CameraFiles::load(const std::string& path) {
    struct stat info = {};
    ::stat(path.c_str(), &info);
    const std::string state =
        concat(path, " ", info.st_size, " ", info.st_mtim.tv_sec, " ", info.st_mtim.tv_nsec);
    const std::lock_guard lock(mutex_);
    if (file_ && read_ == state) return file_;
    ASSIGN_OR_RETURN(auto file, load_camera(path));
    RETURN_IF_ERROR(file.status());
    file_ = std::make_shared<const CameraFile>(std::move(file));
    read_ = state;
    return file_;
}

Result<Node> Node::read(const EffectType& type, Effect effect, const Moment& moment,
                        CameraFiles& files) {
    Node node(type, effect, moment);
    RETURN_IF_ERROR(node.read_clips());
    node.read_sizes();
    const Bounds& window = node.window_;
    if (std::max(window.width(), window.height()) > kMaxSide)
        return input_error(concat("the frame has ", window.width(), "x", window.height(),
                                  " pixels, and the limit is ", kMaxSide,
                                  " a side; render a smaller frame or a proxy"));
    ASSIGN_OR_RETURN(node.conventions_,
                     read_conventions(node.values_, moment.scale_x, moment.scale_y));
    node.cut_after_ = node.values_.boolean(kCut);
    node.cut_before_ = node.values_.at(moment.time - 1).boolean(kCut);
    RETURN_IF_ERROR(node.read_chain());
    RETURN_IF_ERROR(node.read_camera(files));
    node.find_wanted();
    return node;
}

Status Node::read_clips() {
    for (size_t i = 0; i < kClips; ++i) {
        if (!type_->has(Clip(i))) continue;
        PropertySet set = nullptr;
        ConnectedClip& one = clips_[i];
        if (suites().effects->get_clip(effect_, kClipNames[i], &one.handle, &set) != kOk) continue;
        const Properties properties(set);
        one.connected = properties.integer(kPropConnected, 0, 0) != 0;
        one.first = properties.number(kPropFrameRange, 0, -std::numeric_limits<double>::infinity());
        one.last = properties.number(kPropFrameRange, 1, std::numeric_limits<double>::infinity());
        if (Clip(i) == Clip::source) pixel_aspect_ = properties.number(kPropPixelAspect, 0, 1);
    }
    if (!(pixel_aspect_ > 0)) pixel_aspect_ = 1;
    if (!connected(Clip::source)) return input_error("Source: is not connected");
    return Status();
}

void Node::read_sizes() {
    Region source = {};
    suites().effects->get_clip_region(clip(Clip::source), moment_.time, &source);
    const Properties effect = properties_of(effect_);
    Region project = {effect.number(kPropProjectOffset, 0, 0),
                      effect.number(kPropProjectOffset, 1, 0), 0, 0};
    project.x2 = project.x1 + effect.number(kPropProjectSize, 0, 0);
    project.y2 = project.y1 + effect.number(kPropProjectSize, 1, 0);
    const bool has_project = project.x2 > project.x1 && project.y2 > project.y1;
    if (!is_finite(source)) source = project;
    source_ = pixels_of(source, moment_, pixel_aspect_);
    display_ = values_.integer(kFrameSize) == 0 && has_project
                   ? pixels_of(project, moment_, pixel_aspect_)
                   : source_;
    window_ = source_.united(display_);
}

Region Node::display_region() const {
    const double x = pixel_aspect_ / moment_.scale_x, y = 1 / moment_.scale_y;
    return {display_.x1 * x, display_.y1 * y, display_.x2 * x, display_.y2 * y};
}

Region Node::region() const {
    const double x = pixel_aspect_ / moment_.scale_x, y = 1 / moment_.scale_y;
    // FXAA moves no light out of the image.
    const Bounds& filled = type_->has(Clip::depth) ? window_ : source_;
    return {filled.x1 * x, filled.y1 * y, filled.x2 * x, filled.y2 * y};
}

Status Node::read_chain() {
    const Region display = display_region();
    if (type_->pass) {
        chain_.append(builtin_passes(), type_->pass->name);
        const ParameterTable& table = *type_->pass->parameters;
        const ParameterRef parameters = chain_.links[0].pass->parameters();
        for (const Parameter& row : table.rows()) {
            ASSIGN_OR_RETURN(const ParameterValue value, value_of(values_, row, display));
            RETURN_IF_ERROR(table.set(parameters, row.key, value).at(row.key));
        }
        RETURN_IF_ERROR(table.check(parameters));
    } else {
        ASSIGN_OR_RETURN(const size_t choice, values_.choice(kChain, chain_names().size() + 1));
        ChainText text;
        if (choice == 0) {
            const std::string path = values_.text(kChainFile);
            if (path.empty())
                return Status(StatusCode::chain, "chain_file: is empty; choose a file, or a chain");
            ASSIGN_OR_RETURN(text.text, read_text_file(path, StatusCode::chain));
            text.file_name = path;
        } else {
            text = *embedded_chain(chain_names()[choice - 1]);
        }
        ChainFile file = parse_chain(text, builtin_passes(), lines_of(values_.text(kOverrides)));
        RETURN_IF_ERROR(file.status());
        chain_ = std::move(file.chain);
        for (const ChainLink& link : chain_.links) {
            const ParameterTable& table = *link.type->parameters;
            const Parameter* at = table.find(kFocusAt);
            if (!at) continue;
            ASSIGN_OR_RETURN(const ParameterValue place, value_of(values_, *at, display));
            if (place == ParameterValue()) continue;
            for (const char* other : {"focus_distance", "focus"})
                RETURN_IF_ERROR(table.set(link.pass->parameters(), other, {}));
            RETURN_IF_ERROR(table.set(link.pass->parameters(), kFocusAt, place));
        }
    }
    if (connected(Clip::matte)) {
        const Parameter& effect = *link_parameters().find(kMatteEffect);
        ASSIGN_OR_RETURN(const ParameterValue value, value_of(values_, effect, display));
        const bool named = std::any_of(chain_.links.begin(), chain_.links.end(),
                                       [](const ChainLink& link) { return !link.matte.empty(); });
        for (ChainLink& link : chain_.links) {
            if (named) break;
            link.matte = kClipNames[size_t(Clip::matte)];
            const bool moves = link.pass->roles().required.has(Role::motion);
            effect.set(&link, moves || type_->pass ? value : ParameterValue());
            RETURN_IF_ERROR(link.check_matte());
        }
    }
    // A blur looks the same in a proxy.
    if (moment_.scale_x != 1) sequence::reduce_lengths(chain_, moment_.scale_x);
    return Status();
}

Status Node::read_camera(CameraFiles& files) {
    if (!type_->has(Clip::depth)) return Status();
    if (const std::string path = values_.text(kCameraFile); !path.empty()) {
        ASSIGN_OR_RETURN(camera_file_, files.load(path));
    }
    Camera camera;
    for (const Parameter* row : camera_rows(*type_)) {
        ASSIGN_OR_RETURN(const ParameterValue value, value_of(values_, *row, display_region()));
        RETURN_IF_ERROR(camera_parameters().set(&camera, row->key, value).at(row->key));
    }
    return Status();
}

Camera Node::camera_at(int offset) const {
    Camera camera;
    if (!type_->has(Clip::depth)) return camera;
    const Values values = values_.at(moment_.time + offset);
    for (const Parameter* row : camera_rows(*type_)) {
        const auto value = value_of(values, *row, display_region());
        if (value.ok() && row->check(*value).ok()) row->set(&camera, *value);
    }
    const Display display{display_.width(), display_.height(), pixel_aspect_};
    return frame_camera({}, camera_file_.get(), moment_.frame() + offset, display)
        .overlaid_by(camera);
}

FrameDescription Node::description() const {
    FrameDescription frame;
    frame.width = window_.width();
    frame.height = window_.height();
    frame.display_width = display_.width();
    frame.display_height = display_.height();
    frame.origin_x = window_.x1 - display_.x1;
    frame.origin_y = display_.y2 - window_.y2;
    frame.pixel_aspect = pixel_aspect_;
    frame.camera_place = "in the node's group Camera, or in its camera file";
    frame.frame_number = moment_.frame();
    frame.camera = camera_at(0);
    for (const ChainLink& link : chain_.links) frame.mattes.push_back(link.matte.empty() ? -1 : 0);
    return frame;
}

// As the command does: what a plan without facts reads, with and without each neighbor.
void Node::find_wanted() {
    own_ = {Role::color};
    if (connected(Clip::depth)) own_.add(Role::inverse_depth);
    if (connected(Clip::motion)) {
        own_.add(Role::motion);
        // At a cut, the vectors of one side serve as both (read_at()).
        if (conventions_.back_at >= 0 && !cut_before_ && !cut_after_) own_.add(Role::motion_back);
    }
    if (connected(Clip::matte)) own_.add(Role::mattes);
    if (connected(Clip::behind)) own_.add(Role::behind);
    FrameDescription frame = description();
    for (const ChainLink& link : chain_.links)
        for (const Place& place : link.pass->depth_places())
            frame.bounds.inverse_depth_at[place] = 0;
    const RoleSet usable = chain_.required() | chain_.optional();
    RoleSet all;
    bool planned = false;
    for (const auto& neighbors : {std::vector<Neighbor>{},
                                  {Neighbor::before},
                                  {Neighbor::after},
                                  {Neighbor::before, Neighbor::after}}) {
        frame.planes = own_;
        for (const Neighbor neighbor : neighbors)
            for (const Role role : kNeighborRoles)
                if (own_.has(role) &&
                    usable.has(postchain::role_of(neighbor, is_stacked(role) ? Role::color : role)))
                    frame.planes.add(postchain::role_of(neighbor, role));
        const auto plan = make_plan(chain_, frame, {});
        if (!plan.ok()) continue;
        planned = true;
        all = all | plan->reads;
    }
    if (!planned) all = usable;
    if (!frame.bounds.inverse_depth_at.empty()) all.add(Role::inverse_depth);
    wanted_ = RoleSet{Role::color} | (own_ & (all | RoleSet{Role::mattes}));
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kNeighborRoles)
            if (own_.has(role) && all.of(neighbor).has(role == Role::mattes ? Role::color : role)) {
                wanted_.add(role);
                wanted_.add(postchain::role_of(neighbor, role));
            }
    // Vectors at clear edges and of the sky depend on depth.
    if (wanted_.has(Role::motion) || wanted_.has(Role::motion_back))
        wanted_ = wanted_ | (own_ & RoleSet{Role::inverse_depth, Role::motion});
}

Result<Plan> Node::plan(const FrameDescription& frame, const PlanOptions& options) const {
    auto plan = make_plan(chain_, frame, options);
    if (plan.ok()) return plan;
    const RoleSet lacking = chain_.required() - own_;
    std::string clips;
    for (const Clip clip : {Clip::depth, Clip::motion})
        if (lacking.has(role_of_clip(clip)))
            clips += concat(clips.empty() ? "; connect " : " and ", kClipNames[size_t(clip)]);
    return Status(plan.status().code(), plan.status().message() + clips);
}

std::vector<int> Node::frames_of(Clip clip) const {
    const Role role = role_of_clip(clip);
    std::vector<int> frames = {0};
    for (const Neighbor neighbor : kNeighbors)
        if (role != Role::behind && wanted_.has(role) && !wanted_.of(neighbor).empty())
            frames.push_back(frames_to(neighbor));
    return frames;
}

bool Node::varies() const {
    return std::any_of(chain_.links.begin(), chain_.links.end(), [](const ChainLink& link) {
        const Parameter* row = link.type->parameters->find("animate_noise");
        return row && row->get(link.pass->parameters()) == ParameterValue(true);
    });
}

uint64_t Node::bytes() const {
    uint64_t channels = 2 * 4;  // the result, and a copy of it
    for (const Role role : kAllRoles)
        if (wanted_.has(role))
            channels += uint64_t(channels_of(role)) * (role == Role::behind ? kBehindPlanes : 1);
    return channels * sizeof(float) * uint64_t(window_.width()) * uint64_t(window_.height());
}

struct Node::OneFrame {
    FramePlanes planes;
    FrameDescription description;
    InputHealth health;
    ConvertOptions options;
    ImageF stored;
    bool crosses_cut = false;
};

Result<Node::OneFrame> Node::read_at(int offset, RoleSet present, const Layer& layer) const {
    const double time = moment_.time + offset;
    const auto image_of = [&](Clip one) -> Result<HostImage> {
        const char* name = kClipNames[size_t(one)];
        auto image = HostImage::fetch(clip(one), time);
        if (!image) return input_error(concat(name, ": has no image at frame ", time));
        RETURN_IF_ERROR(image->check(name));
        return std::move(*image);
    };
    const auto covering = [&](Clip one, const Bounds& color) -> Result<HostImage> {
        ASSIGN_OR_RETURN(auto image, image_of(one));
        const Bounds needed = color.intersected(window_);
        if (!image.bounds().contains(needed))
            return input_error(concat(kClipNames[size_t(one)], ": covers pixels ",
                                      image.bounds().text(), ", and Source ", needed.text(),
                                      "; connect images of one size"));
        return image;
    };
    const bool cut_before = values_.at(time - 1).boolean(kCut),
               cut_after = values_.at(time).boolean(kCut);
    OneFrame frame;
    frame.description = description();
    frame.description.frame_number += offset;
    frame.description.camera = camera_at(offset);
    frame.options = conventions_.options;
    Bounds color;
    {
        ASSIGN_OR_RETURN(const auto image, image_of(layer.color));
        if (image.channels() < 3)
            return input_error(
                concat(kClipNames[size_t(layer.color)], ": has no color; connect RGBA or RGB"));
        color = image.bounds();
        frame.options.unpremultiplied = image.unpremultiplied() && image.channels() == 4;
        frame.planes[Role::color] = plane_of(image, window_, {0, 1, 2, 3}, 0);
        if (frame.options.unpremultiplied) frame.stored = frame.planes[Role::color];
    }
    if (present.has(Role::inverse_depth)) {
        ASSIGN_OR_RETURN(const auto image, covering(layer.depth, color));
        ImageF depth = plane_of(image, window_, {conventions_.depth_at}, farthest(conventions_));
        if (conventions_.normalized != Conventions::Normalized::no) {
            const Camera& camera = frame.description.camera;
            if (!camera.near_clip || !camera.far_clip)
                return Status(StatusCode::chain,
                              "near_clip, far_clip: needed for a normalized depth; set them in the "
                              "group Camera");
            const bool inverted = conventions_.normalized == Conventions::Normalized::near_is_1;
            const Bounds known = image.bounds();
            for (int y = 0; y < depth.height; ++y)
                for (int x = 0; x < depth.width; ++x) {
                    const int host_x = window_.x1 + x, host_y = window_.y2 - 1 - y;
                    if (!known.contains({host_x, host_y, host_x + 1, host_y + 1})) continue;
                    float& value = depth.at(x, y);
                    const double part = inverted ? 1 - double(value) : double(value);
                    value =
                        float(*camera.near_clip + part * (*camera.far_clip - *camera.near_clip));
                }
        }
        frame.planes[Role::inverse_depth] = std::move(depth);
    }
    if (present.has(Role::motion) || present.has(Role::motion_back)) {
        ASSIGN_OR_RETURN(const auto image, covering(layer.motion, color));
        int forward = conventions_.forward_at, back = conventions_.back_at;
        if (image.channels() < 2 || std::max(forward, back) + 2 > image.channels())
            return input_error(concat("Motion: has ", image.channels(), " channels, and ",
                                      kMotionChannels, " names others; connect RGBA"));
        // Vectors to or from a frame of another shot mean nothing: those of the frame's other side
        // are used in their place.
        if (cut_before) back = -1;
        if (cut_after && back >= 0) {
            forward = back;
            back = -1;
            frame.options.motion = frame.options.motion_back;
        } else {
            frame.crosses_cut = cut_after;
        }
        const auto vectors = [&](int at, const MotionConvention& motion) {
            return plane_of(image, window_, {at, at + 1}, float(motion.bias));
        };
        frame.planes[Role::motion] = vectors(forward, frame.options.motion);
        if (back >= 0 && present.has(Role::motion_back))
            frame.planes[Role::motion_back] = vectors(back, frame.options.motion_back);
    }
    ASSIGN_OR_RETURN(frame.health, convert_frame(frame.planes, frame.description, frame.options));
    sequence::fill_clear_edges(frame.planes);
    if (camera_file_ && frame.planes.contains(Role::motion)) {
        const Display display{display_.width(), display_.height(), pixel_aspect_};
        std::set<int> cuts;
        if (cut_before) cuts.insert(frame.description.frame_number - 1);
        if (cut_after) cuts.insert(frame.description.frame_number);
        const auto no_metadata = [](int) { return std::optional<io::CameraMetadata>(); };
        const int number = frame.description.frame_number;
        auto sky = sequence::sky_views(&*camera_file_, no_metadata, number, display, cuts);
        if (sky && !sky->turns()) sky.reset();
        // Cycles computes both positions of a vector with the focal length of the frame.
        if (camera_file_->zooms() && conventions_.meaning->name == "cycles")
            if (const auto zoom = sequence::zoom_of(*camera_file_, {}, number, display, cuts))
                sequence::add_zoom_motion(*zoom, sky.has_value(), frame.planes, frame.description);
        if (sky) sequence::fill_sky_motion(*sky, frame.planes, frame.description);
    }
    if (present.has(Role::mattes)) {
        ASSIGN_OR_RETURN(const auto image, image_of(Clip::matte));
        ImageF matte = plane_of(image, window_, {conventions_.matte_at}, 0);
        for (float& value : matte.data) value = value > 0 ? std::min(value, 1.0f) : 0.0f;
        frame.planes[Role::mattes] = std::move(matte);
        frame.description.planes.add(Role::mattes);
    }
    frame.description.bounds.camera_cut = frame.crosses_cut;
    return frame;
}

void Node::add_neighbors(RoleSet present, Frame& frame) const {
    const ConnectedClip& source = clips_[size_t(Clip::source)];
    for (const Neighbor neighbor : kNeighbors) {
        if (wanted_.of(neighbor).empty()) continue;
        const int offset = frames_to(neighbor), number = moment_.frame() + offset;
        std::string& why = frame.description.missing_neighbors[neighbor];
        if (moment_.time + offset < source.first || moment_.time + offset > source.last) {
            why = concat("frame ", moment_.frame(), " is the ",
                         neighbor == Neighbor::before ? "first" : "last", " of Source");
            continue;
        }
        if (neighbor == Neighbor::before ? cut_before_ : cut_after_) {
            why = concat("a cut follows frame ", std::min(number, moment_.frame()));
            continue;
        }
        auto other = read_at(offset, present, {});
        if (!other.ok()) {
            why = other.status().message();
            frame.notes.push_back(
                concat("filtered without the frame ", name_of(neighbor), ": ", why));
            continue;
        }
        if (other->crosses_cut) {
            why = concat("the motion of frame ", number, " crosses a cut");
            continue;
        }
        for (auto& [role, plane] : other->planes) {
            const Role here = postchain::role_of(neighbor, role);
            if (!wanted_.has(here)) continue;
            frame.planes[here] = std::make_shared<const ImageF>(std::move(plane));
            frame.description.planes.add(here);
        }
        frame.description.missing_neighbors.erase(neighbor);
    }
}

Status Node::read_behind(Frame& frame) const {
    if (!connected(Clip::behind_depth))
        return input_error("BehindDepth: is not connected; Behind needs a depth of its own");
    RoleSet present = {Role::color, Role::inverse_depth};
    if (connected(Clip::behind_motion))
        present = present | (wanted_ & RoleSet{Role::motion, Role::motion_back});
    auto read = read_at(0, present, {Clip::behind, Clip::behind_depth, Clip::behind_motion});
    if (!read.ok()) return read.status().at("the layer behind");
    frame.planes[Role::behind] = std::make_shared<const ImageF>(stack_behind(read->planes));
    frame.description.planes.add(Role::behind);
    return Status();
}

Result<Node::Frame> Node::read_frame() const {
    const uint64_t limit = sequence::default_memory_limit();
    if (bytes() > limit)
        return Status(StatusCode::memory,
                      concat("the frame and its neighbors take ", sequence::bytes_text(bytes()),
                             ", and the limit is ", sequence::bytes_text(limit),
                             "; render a smaller frame, or set neighbors to none"));
    const RoleSet present = wanted_ & (RoleSet{Role::color, Role::inverse_depth, Role::motion,
                                               Role::motion_back, Role::mattes});
    ASSIGN_OR_RETURN(auto one, read_at(0, present, {}));
    Frame frame;
    for (auto& [role, plane] : one.planes)
        frame.planes[role] = std::make_shared<const ImageF>(std::move(plane));
    frame.description = std::move(one.description);
    frame.health = one.health;
    frame.options = one.options;
    frame.stored = std::move(one.stored);
    add_neighbors(present, frame);
    if (wanted_.has(Role::behind)) RETURN_IF_ERROR(read_behind(frame));
    find_depths(chain_, frame.planes, frame.description);
    find_speeds(chain_, frame.planes, frame.description);
    return frame;
}

}  // namespace postchain::openfx
