#include "tools/python/frame_object.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <set>

#include "chain/base/text.h"
#include "chain/frame/layers.h"
#include "chain/plan/plan_print.h"
#include "config/profile.h"
#include "config/reporter.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/filter/filter_view.h"
#include "tools/sequence/source/neighbor_planes.h"
#include "tools/sequence/source/resolved_values.h"
#include "tools/sequence/source/sequence_reader.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// The name of a fill mask, which no caller sees.
constexpr const char* kFillMask = "postchain.fill";

// A neighbor with the planes that the frame reads.
struct ReadNeighbor {
    FramePtr frame;
    std::shared_ptr<const sequence::SourceFrame> source;
};

Result<ReadNeighbor> read_neighbor(const ChainObject& chain, const PlanOptions& options,
                                   const FramePtr& given, RoleSet read, const Frame& frame) {
    ASSIGN_OR_RETURN(const auto opened, given->with(sequence::mattes_of(chain.chain)));
    const Frame& neighbor = *opened;
    const io::Window &here = sequence::color_part(frame.header()).display_window,
                     &there = sequence::color_part(neighbor.header()).display_window;
    if (here != there)
        return Status(
            StatusCode::usage,
            concat("is ", there.width(), "x", there.height(), " pixels, the frame ", here.width(),
                   "x", here.height(), "; give a frame of the same sequence"));
    const RoleSet its = sequence::planes_to_read(
        neighbor.header(),
        sequence::planes_needed(chain.chain, neighbor.settings(), neighbor.header(), options));
    // Layers that it lacks are filtered without it. A file beside a cut lacks the vectors across
    // it.
    RoleSet may_lack = {Role::layers};
    if (neighbor.is_of_files()) may_lack.add(Role::motion_back);
    if (const RoleSet lacking = read - its - may_lack; !lacking.empty())
        return Status(StatusCode::usage,
                      concat("has no ", lacking.text(),
                             ", which the chain reads of it; give it, or leave the frame out"));
    ASSIGN_OR_RETURN(auto source, neighbor.read(its));
    return ReadNeighbor{opened, std::move(source)};
}

Status add_neighbors(const ChainObject& chain, const PlanOptions& options,
                     const FrameWithNeighbors& frames, const Frame& frame, RoleSet planes,
                     sequence::SourceFrame& source) {
    std::map<Neighbor, ReadNeighbor> read;
    std::map<Neighbor, sequence::NeighborFrame> neighbors;
    for (const auto& [which, given] :
         {std::pair{Neighbor::before, frames.before}, std::pair{Neighbor::after, frames.after}}) {
        if (!given) {
            source.description.missing_neighbors[which] = "not given";
            continue;
        }
        if (given->header().motion_crosses_cut) {
            source.description.missing_neighbors[which] = "its motion crosses a cut";
            continue;
        }
        ASSIGN_OR_RETURN(
            auto neighbor,
            read_neighbor(chain, options, given, planes.of(which), frame).at(name_of(which)));
        if (planes.of(which).empty()) continue;
        const sequence::FrameHeader& header = neighbor.frame->header();
        if (planes.of(which).has(Role::layers))
            if (const auto lacking = sequence::layers_lacking(frame.header().layers, header.layers);
                !lacking.empty())
                source.warnings.push_back(concat(name_of(which), ": lacks these layers, which are ",
                                                 "filtered without it: ", joined(lacking)));
        neighbors[which] = {&header, &neighbor.source->planes, neighbor.source->cryptomattes};
        read[which] = std::move(neighbor);
    }
    sequence::add_neighbors(neighbors, source);
    return Status();
}

// Raises if a layer or matte has a name by which another array is read.
void check_names(const ArrayFile& file, const sequence::FrameHeader& header,
                 const py::object& layers) {
    const auto expect = [&](const std::vector<std::string>& channels, const std::string& argument) {
        for (const std::string& channel : channels)
            if (const std::string& given = file.argument_of(channel); given != argument)
                raise_usage(given, ": the channel ", channel, " is one of ", argument,
                            "; rename this array");
    };
    for (const auto& [role, where] : header.match.roles)
        expect(where.channels, role == Role::inverse_depth ? "depth" : name_of(role));
    std::set<std::string> found;
    for (const FileLayer& layer : header.layers.filtered) {
        expect(layer.channels.channels, concat("aovs['", layer.name, "']"));
        found.insert(layer.name);
    }
    if (layers.is_none()) return;
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(layers))
        if (const std::string name = py::str(key); !found.contains(name))
            raise_usage("aovs['", name,
                        "']: another plane or cryptomatte has this name; rename the AOV");
}

std::vector<std::string> planning_warnings(const ChainObject& chain, const PlannedArrays& planned,
                                           bool unsaid) {
    std::vector<std::string> warnings = planned.source.warnings;
    if (unsaid && !planned.plan.missing_neighbors.empty())
        warnings.push_back(
            concat(color_path(planned.source.header), ": ", chain.name,
                   " reads the frames before and after, which are not given: what they show of "
                   "occluded surfaces is estimated; give before= and after=, or None where there "
                   "is no such frame"));
    for (auto& warning : sequence::plan_warnings(chain.chain, planned.plan, planned.source))
        warnings.push_back(std::move(warning));
    return warnings;
}

}  // namespace

std::shared_ptr<Frame> Frame::of_arrays(const std::string& method, const FrameArrays& arrays,
                                        const py::object& given, const py::object& camera,
                                        const std::string& depth_encoding, double pixel_aspect,
                                        std::shared_ptr<const Frame> behind,
                                        const py::kwargs& settings) {
    const auto& encodings = depth_encoding_names();
    const auto encoding = std::find(encodings.begin(), encodings.end(), depth_encoding);
    if (encoding == encodings.end())
        raise_usage("depth_encoding: unknown encoding '", depth_encoding, "'; known are ",
                    joined(encodings));
    if (!(pixel_aspect > 0 && pixel_aspect < 1e3)) raise_usage("pixel_aspect: must be > 0");
    auto frame = std::make_shared<Frame>();
    frame->has_number_ = !given.is_none();
    const int number = frame->has_number_ ? frame_number_of(given) : 0;
    const std::string name = concat("frame ", number);
    frame->settings_ = job_settings(method, "frame.exr", "", camera, settings, frame_keys()).source;
    frame->settings_.color_frames.reset();
    frame->settings_.profile = value_of(find_profile("generic"));
    // Layers are what the caller calls so, whatever their names are.
    frame->settings_.profile->data = {""};
    frame->settings_.layers.aovs = "all";
    io::FrameFiles files;
    files.frame_number = number;
    const auto file = std::make_shared<ArrayFile>(arrays, pixel_aspect, name);
    files.files[Role::color] = file;
    frame->depth_encoding_ = DepthEncoding(encoding - encodings.begin());
    frame->behind_ = std::move(behind);
    if (const Status status = frame->open(std::move(files)); !status.ok()) raise(status);
    check_names(*file, frame->header_, arrays.aovs);
    return frame;
}

std::shared_ptr<Frame> Frame::of_files(const std::string& input, const py::object& number,
                                       const py::object& camera, const py::kwargs& settings) {
    auto frame = std::make_shared<Frame>();
    sequence::RunSettings job = job_settings("read", input, "", camera, settings, read_keys());
    frame->settings_ = std::move(job.source);
    std::optional<io::FrameRange> range;
    if (!number.is_none()) range = io::FrameRange{{frame_number_of(number)}};
    const io::FrameList list = value_of(io::find_frames(job.input, range));
    if (!range && list.frames.size() > 1)
        raise_usage(input, ": has ", list.frames.size(), " frames; name one with frame=");
    const int wanted = list.frames.front();
    if (list.is_missing(wanted)) raise(sequence::absent_frame(wanted, job));
    std::map<Role, std::string> files = list.files.at(wanted);
    if (const auto behind = files.extract(Role::behind)) frame->behind_path_ = behind.mapped();
    frame->header_ = value_of(sequence::open_source_frame(frame->settings_, files, wanted));
    if (!frame->behind_path_.empty()) frame->header_.has_behind = true;
    return frame;
}

Status Frame::open(io::FrameFiles files) {
    ASSIGN_OR_RETURN(header_, sequence::header_of(settings_, std::move(files)));
    if (depth_encoding_) header_.match.options.depth = *depth_encoding_;
    if (behind_ || !behind_path_.empty()) header_.has_behind = true;
    return Status();
}

Result<FramePtr> Frame::with(const std::vector<std::string>& mattes, bool fill_mask) const {
    if (mattes.empty() && !fill_mask) return shared_from_this();
    const std::lock_guard lock(mutex_);
    if (with_ && with_->settings_.layers.mattes == mattes &&
        with_->settings_.layers.fill_mask.empty() != fill_mask)
        return with_;
    for (const std::string& matte : mattes)
        if (depth_encoding_ && !sequence::is_matte_of_ids(matte) &&
            !header_.files.color_file().parts()[0].find(matte))
            return Status(StatusCode::usage,
                          concat("mattes: there is no '", matte, "'; give mattes={'", matte,
                                 "': an array of height x width}"));
    auto frame = std::make_shared<Frame>();
    frame->settings_ = settings_;
    frame->settings_.layers.mattes = mattes;
    if (fill_mask) frame->settings_.layers.fill_mask = kFillMask;
    frame->depth_encoding_ = depth_encoding_;
    frame->has_number_ = has_number_;
    frame->behind_ = behind_;
    frame->behind_path_ = behind_path_;
    RETURN_IF_ERROR(frame->open(header_.files));
    with_ = std::move(frame);
    return with_;
}

Status Frame::add_behind(RoleSet planes, sequence::SourceFrame& source) const {
    if (!header_.has_behind) return Status();
    if (!planes.has(Role::behind)) {
        if (behind_ || !behind_path_.empty())
            source.warnings.push_back(
                "behind: not read: no pass of the chain takes light from the layer behind on this "
                "frame (inverse warps do)");
        return Status();
    }
    const std::string path = behind_path_.empty() ? color_path(header_) : behind_path_;
    auto behind = behind_ ? sequence::behind_of(behind_->header_, source.header)
                          : sequence::open_behind(settings_, path, source.header);
    if (!behind.ok() && !behind_ && behind_path_.empty()) {  // a deep file without one
        source.warnings.push_back(
            concat("filtered without the layer behind: ", behind.status().message()));
        return Status();
    }
    if (!behind.ok()) return behind.status();
    return sequence::add_behind(settings_, *behind, source);
}

bool Frame::has_alpha() const {
    return color_channels(header_).channels.size() == 4;
}

Result<std::shared_ptr<const sequence::SourceFrame>> Frame::read(RoleSet wanted) const {
    const std::lock_guard lock(mutex_);
    if (source_ && read_ == wanted) return source_;
    ASSIGN_OR_RETURN(auto source,
                     sequence::read_source_frame(settings_, header_, wanted, io::Keep::nothing));
    source_ = std::make_shared<const sequence::SourceFrame>(std::move(source));
    read_ = wanted;
    return source_;
}

PlanOptions plan_options_of(const py::kwargs& settings) {
    return job_settings("run", "frame.exr", "", py::none(), settings, plan_keys()).plan;
}

Result<PlannedArrays> plan_arrays(const ChainObject& chain, const FrameWithNeighbors& frames,
                                  const PlanOptions& options, bool fill_mask) {
    ASSIGN_OR_RETURN(const auto opened,
                     frames.frame->with(sequence::mattes_of(chain.chain), fill_mask));
    const Frame& frame = *opened;
    const RoleSet planes = sequence::planes_to_read(
        frame.header(),
        sequence::planes_needed(chain.chain, frame.settings(), frame.header(), options));
    ASSIGN_OR_RETURN(const auto read, frame.read(planes));
    PlannedArrays planned{*read, {}};
    planned.source.header.to_read = planes;
    RETURN_IF_ERROR(add_neighbors(chain, options, frames, frame, planes, planned.source));
    RETURN_IF_ERROR(frame.add_behind(planes, planned.source));
    ASSIGN_OR_RETURN(planned.plan,
                     sequence::plan_source_frame(chain.chain, planned.source, options));
    return planned;
}

namespace {

struct FilteredArrays {
    sequence::FilteredView view;
    sequence::FrameLayers layers;
    std::map<std::string, ImageF> stages;
    std::vector<PassTime> times;
};

// The executor's passes are timed while it exists.
struct Timed {
    explicit Timed(Executor& given) : executor(given) { executor.set_timing(true); }
    ~Timed() { executor.set_timing(false); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;
    Executor& executor;
};

Status check_stages(const FilterRequest& request, const std::map<std::string, ImageF>& found,
                    const Plan& plan) {
    std::vector<std::string> known;
    for (const PlanTexture& texture : plan.textures)
        if (!texture.imported) known.push_back(texture.name);
    for (const std::string& name : request.stages)
        if (!found.contains(name))
            return Status(StatusCode::usage, "stages: " + unknown_word("stage", name, known));
    return Status();
}

// `request`: null for color, AOVs and cryptomattes alone.
FilteredArrays filtered_arrays(const ChainObject& chain, const FrameWithNeighbors& frames,
                               PlanOptions options, const FilterRequest* request, Device& device) {
    std::vector<std::string> warnings;
    auto filtered =
        device.run("filtering a frame", [&](Call&, Executor& executor) -> Result<FilteredArrays> {
            options.device = executor.device_class();
            ASSIGN_OR_RETURN(auto planned,
                             plan_arrays(chain, frames, options, request && request->fill_mask));
            warnings = planning_warnings(chain, planned, frames.unsaid);
            FilteredArrays arrays;
            StageObserver observer;
            if (request && (request->all_stages || !request->stages.empty()))
                observer = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                    if (request->all_stages ||
                        std::ranges::count(request->stages, texture.name) > 0)
                        arrays.stages[texture.name] = pixels;
                    return Status();
                };
            std::optional<Timed> timed;
            if (request) timed.emplace(executor);
            ASSIGN_OR_RETURN(
                arrays.view,
                sequence::filter_view(chain.chain, planned.plan, planned.source, options, executor,
                                      observer, [&] { arrays.times = executor.pass_times(); }));
            if (request) RETURN_IF_ERROR(check_stages(*request, arrays.stages, planned.plan));
            const std::string& name = color_path(planned.source.header);
            for (auto& line : sequence::lost_coverage(arrays.view.reports, name))
                warnings.push_back(std::move(line));
            if (!frames.frame->has_alpha()) arrays.view.color = without_alpha(arrays.view.color);
            arrays.layers = std::move(planned.source.header.layers);
            return arrays;
        });
    if (!filtered.ok()) raise(filtered.status());
    warn(warnings);
    return std::move(*filtered);
}

// Height x width x (id, coverage of each rank), as cryptomattes are given.
ImageF ranks_image(const io::RankedCoverage& coverage) {
    ImageF image(coverage.width, coverage.height, 2 * coverage.ranks);
    for (size_t i = 0; i < coverage.ids.size(); ++i) {
        image.data[2 * i] = std::bit_cast<float>(coverage.ids[i]);
        image.data[2 * i + 1] = coverage.coverages[i];
    }
    return image;
}

// The layers of a stack, by name.
py::dict layers_of(const ImageF& stack, const sequence::FrameLayers& layers, int height) {
    py::dict found;
    for (size_t i = 0; i < layers.filtered.size() && !stack.empty(); ++i) {
        const FileLayer& layer = layers.filtered[i];
        ImageF pixels = plane_of_stack(stack, int(i), height);
        found[py::str(layer.name)] = array_of(
            layer.channels.channels.size() == 4 ? std::move(pixels) : without_alpha(pixels));
    }
    return found;
}

// The frame that was read. Raises; warns.
std::shared_ptr<const sequence::SourceFrame> read_of(const FramePtr& frame, RoleSet planes) {
    auto source = in_background("reading a frame", [&](Call&) { return frame->read(planes); });
    if (!source.ok()) raise(source.status());
    warn((*source)->warnings);
    return *source;
}

}  // namespace

py::array run_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                    const PlanOptions& options, const std::shared_ptr<Device>& device) {
    if (frames.frame->header().layers.any_filtered())
        raise_usage("run: the frame has AOVs or cryptomattes to filter; call filter()");
    return array_of(
        std::move(filtered_arrays(chain, frames, options, nullptr, *device).view.color));
}

py::object filter_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                        const PlanOptions& options, const FilterRequest& request,
                        const std::shared_ptr<Device>& device) {
    FilteredArrays filtered = filtered_arrays(chain, frames, options, &request, *device);
    sequence::FilteredView& view = filtered.view;
    const py::dict layers = layers_of(view.layers, filtered.layers, view.color.height);
    py::dict cryptomattes, stages, times;
    for (size_t i = 0; i < view.cryptomattes.size(); ++i)
        cryptomattes[py::str(filtered.layers.cryptomattes[i].name)] =
            array_of(ranks_image(view.cryptomattes[i]));
    for (auto& [name, pixels] : filtered.stages)
        stages[py::str(name)] = array_of(std::move(pixels));
    for (const PassTime& one : filtered.times)
        times[py::str(concat(one.pass, ".", one.name))] = one.milliseconds;
    const py::object mask = view.fill_mask.empty()
                                ? py::object(py::none())
                                : py::object(array_of(without_alpha(view.fill_mask)));
    return py::module_::import("postchain._filtered")
        .attr("Filtered")(array_of(std::move(view.color)), layers, cryptomattes, mask, stages,
                          times);
}

py::dict aovs_of(const Frame& frame) {
    const auto source = read_of(frame.shared_from_this(), {Role::color, Role::layers});
    const auto stack = source->planes.find(Role::layers);
    return stack == source->planes.end()
               ? py::dict()
               : layers_of(*stack->second, source->header.layers, source->description.height);
}

py::dict mattes_of(const Frame& frame, const std::vector<std::string>& names) {
    if (names.empty()) raise_usage("mattes: no name is given; give those of the mattes to read");
    const auto source = read_of(value_of(frame.with(names)), {Role::color, Role::mattes});
    py::dict mattes;
    for (size_t i = 0; i < names.size(); ++i)
        mattes[py::str(names[i])] = array_of(
            plane_of_stack(*source->planes.at(Role::mattes), int(i), source->description.height));
    return mattes;
}

py::dict cryptomattes_of(const Frame& frame) {
    const auto source = read_of(frame.shared_from_this(), {Role::color, Role::layers});
    py::dict found;
    if (!source->cryptomattes) return found;
    for (size_t i = 0; i < source->cryptomattes->names.size(); ++i)
        found[py::str(source->cryptomattes->names[i])] =
            array_of(ranks_image(source->cryptomattes->ranks[i]));
    return found;
}

py::object plan_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                      const PlanOptions& options) {
    std::vector<std::string> warnings;
    auto json = in_background("planning a frame", [&](Call&) -> Result<io::Json> {
        ASSIGN_OR_RETURN(auto planned, plan_arrays(chain, frames, options, false));
        warnings = planning_warnings(chain, planned, frames.unsaid);
        io::Json plan = io::json_from(plan_json(planned.plan));
        plan["resolved"] = sequence::resolved_json(
            sequence::resolve_values(chain.chain, planned.source, planned.plan));
        return plan;
    });
    if (!json.ok()) raise(json.status());
    warn(warnings);
    return python_of(*json);
}

}  // namespace postchain::python
