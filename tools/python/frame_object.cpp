#include "tools/python/frame_object.h"

#include <algorithm>
#include <bit>
#include <set>

#include "chain/base/text.h"
#include "chain/frame/layers.h"
#include "chain/plan/plan_print.h"
#include "config/profile.h"
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

// A neighbor with the planes that the frame reads.
struct ReadNeighbor {
    FramePtr frame;
    std::shared_ptr<const sequence::SourceFrame> source;
};

Result<ReadNeighbor> read_neighbor(const ChainObject& chain, const PlanOptions& options,
                                   const FramePtr& given, RoleSet read, const Frame& frame) {
    ASSIGN_OR_RETURN(const auto opened, given->with_mattes_of(chain.chain));
    const Frame& neighbor = *opened;
    const io::Window &here = frame.header().window, &there = neighbor.header().window;
    if (here != there)
        return Status(
            StatusCode::usage,
            concat("is ", there.width(), "x", there.height(), " pixels, the frame ", here.width(),
                   "x", here.height(), "; give a frame of the same sequence"));
    const RoleSet its = sequence::planes_to_read(
        neighbor.header(),
        sequence::planes_needed(chain.chain, neighbor.settings(), neighbor.header(), options));
    // Layers that it lacks are filtered without it.
    if (const RoleSet lacking = read - its - RoleSet{Role::layers}; !lacking.empty())
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
    sequence::add_neighbors(neighbors, planes, frame.header().window, source);
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
    for (const auto& [role, where] : header.assignment)
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
            concat(planned.source.input.files.color_file().path(), ": ", chain.name,
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
    io::OpenFrame files;
    files.frame_number = number;
    const auto file = std::make_shared<ArrayFile>(arrays, pixel_aspect, name);
    files.files[Role::color] = file;
    frame->depth_encoding_ = DepthEncoding(encoding - encodings.begin());
    if (const Status status = frame->open(std::move(files)); !status.ok()) raise(status);
    check_names(*file, frame->header_, arrays.aovs);
    return frame;
}

std::shared_ptr<Frame> Frame::of_files(const std::string& input, const py::object& number,
                                       const py::object& camera, const py::kwargs& settings) {
    auto frame = std::make_shared<Frame>();
    sequence::RunSettings job = job_settings("read", input, "", camera, settings, read_keys());
    frame->settings_ = std::move(job.source);
    if (job.input.patterns.contains(Role::behind))
        raise_usage(input,
                    ": a Frame has no layer behind; filter the files with "
                    "run_sequence()");
    std::optional<io::FrameRange> range;
    if (!number.is_none()) range = io::FrameRange{{frame_number_of(number)}};
    const io::FrameList list = value_of(io::find_frames(job.input, range));
    if (!range && list.frames.size() > 1)
        raise_usage(input, ": has ", list.frames.size(), " frames; name one with frame=");
    const int wanted = list.frames.front();
    if (list.is_missing(wanted))
        raise(Status(StatusCode::input,
                     concat(job.input.color().format(wanted), ": frame is not on disk")));
    frame->header_ =
        value_of(sequence::open_source_frame(frame->settings_, list.files.at(wanted), wanted));
    return frame;
}

Status Frame::open(io::OpenFrame files) {
    ASSIGN_OR_RETURN(header_, sequence::header_of(settings_, std::move(files)));
    if (depth_encoding_) header_.match.options.depth = *depth_encoding_;
    return Status();
}

Result<FramePtr> Frame::with_mattes_of(const Chain& chain) const {
    const auto mattes = sequence::mattes_of(chain);
    if (mattes.empty()) return shared_from_this();
    const std::lock_guard lock(mutex_);
    if (with_mattes_ && with_mattes_->settings_.layers.mattes == mattes) return with_mattes_;
    for (const std::string& matte : mattes)
        if (depth_encoding_ && !sequence::is_matte_of_ids(matte) &&
            !header_.files.color_file().parts()[0].find(matte))
            return Status(StatusCode::usage,
                          concat("mattes: the chain names '", matte, "'; give mattes={'", matte,
                                 "': an array of height x width}"));
    auto frame = std::make_shared<Frame>();
    frame->settings_ = settings_;
    frame->settings_.layers.mattes = mattes;
    frame->depth_encoding_ = depth_encoding_;
    RETURN_IF_ERROR(frame->open(header_.files));
    with_mattes_ = std::move(frame);
    return with_mattes_;
}

bool Frame::has_alpha() const {
    return header_.assignment.at(Role::color).channels.size() == 4;
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
                                  const PlanOptions& options) {
    ASSIGN_OR_RETURN(const auto opened, frames.frame->with_mattes_of(chain.chain));
    const Frame& frame = *opened;
    const RoleSet planes = sequence::planes_to_read(
        frame.header(),
        sequence::planes_needed(chain.chain, frame.settings(), frame.header(), options));
    ASSIGN_OR_RETURN(const auto read, frame.read(planes));
    PlannedArrays planned{*read, {}};
    RETURN_IF_ERROR(add_neighbors(chain, options, frames, frame, planes, planned.source));
    ASSIGN_OR_RETURN(planned.plan,
                     sequence::plan_source_frame(chain.chain, planned.source, options));
    return planned;
}

namespace {

struct FilteredArrays {
    sequence::FilteredView view;
    sequence::FrameLayers layers;
};

FilteredArrays filtered_arrays(const ChainObject& chain, const FrameWithNeighbors& frames,
                               const PlanOptions& options, Device& device) {
    std::vector<std::string> warnings;
    auto filtered =
        device.run("filtering a frame", [&](Call&, Executor& executor) -> Result<FilteredArrays> {
            ASSIGN_OR_RETURN(auto planned, plan_arrays(chain, frames, options));
            warnings = planning_warnings(chain, planned, frames.unsaid);
            ASSIGN_OR_RETURN(auto view, sequence::filter_view(chain.chain, planned.plan,
                                                              planned.source, options, executor));
            const std::string& name = planned.source.input.files.color_file().path();
            for (auto& line : sequence::lost_coverage(view.reports, name))
                warnings.push_back(std::move(line));
            if (!frames.frame->has_alpha()) view.color = without_alpha(view.color);
            return FilteredArrays{std::move(view), std::move(planned.source.layers)};
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

}  // namespace

py::array run_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                    const PlanOptions& options, const std::shared_ptr<Device>& device) {
    if (frames.frame->header().layers.any_filtered())
        raise_usage("run: the frame has AOVs or cryptomattes to filter; call run_aovs()");
    return array_of(std::move(filtered_arrays(chain, frames, options, *device).view.color));
}

py::object run_aovs(const ChainObject& chain, const FrameWithNeighbors& frames,
                    const PlanOptions& options, const std::shared_ptr<Device>& device) {
    FilteredArrays filtered = filtered_arrays(chain, frames, options, *device);
    sequence::FilteredView& view = filtered.view;
    py::dict layers, cryptomattes;
    for (size_t i = 0; i < filtered.layers.filtered.size(); ++i) {
        const FileLayer& layer = filtered.layers.filtered[i];
        ImageF pixels = plane_of_stack(view.layers, int(i), view.color.height);
        layers[py::str(layer.name)] = array_of(
            layer.channels.channels.size() == 4 ? std::move(pixels) : without_alpha(pixels));
    }
    for (size_t i = 0; i < view.cryptomattes.size(); ++i)
        cryptomattes[py::str(filtered.layers.cryptomattes[i].name)] =
            array_of(ranks_image(view.cryptomattes[i]));
    return py::module_::import("postchain._filtered")
        .attr("Filtered")(array_of(std::move(view.color)), layers, cryptomattes);
}

py::object plan_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                      const PlanOptions& options) {
    std::vector<std::string> warnings;
    auto json = in_background("planning a frame", [&](Call&) -> Result<io::Json> {
        ASSIGN_OR_RETURN(auto planned, plan_arrays(chain, frames, options));
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
