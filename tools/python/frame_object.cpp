#include "tools/python/frame_object.h"

#include <algorithm>

#include "chain/plan_print.h"
#include "chain/text.h"
#include "config/profile.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/files/parameter_json.h"
#include "tools/sequence/run/plan_warnings.h"
#include "tools/sequence/run/resolved_values.h"
#include "tools/sequence/run/sequence_reader.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// Adds the planes that the frame reads of a neighbor.
Status add_neighbor(const ChainObject& chain, const PlanOptions& options, Neighbor which,
                    const Frame* neighbor, RoleSet planes, sequence::SourceFrame& source) {
    if (!neighbor) {
        source.description.missing_neighbors[which] = "not given";
        return Status();
    }
    const auto refuse = [&](const std::string& why) {
        return Status(StatusCode::usage, concat(name_of(which), ": ", why));
    };
    const io::Window &here = source.input.window, &there = neighbor->header().window;
    if (here != there)
        return refuse(concat("is ", there.width(), "x", there.height(), " pixels, the frame ",
                             here.width(), "x", here.height(),
                             "; give a frame of the same sequence"));
    const RoleSet read = planes.of(which);
    if (read.empty()) return Status();
    const RoleSet its = sequence::planes_to_read(
        neighbor->header(),
        sequence::planes_needed(chain.chain, neighbor->settings(), neighbor->header(), options));
    if (const RoleSet lacking = read - its; !lacking.empty())
        return refuse(concat("has no ", lacking.text(),
                             ", which the chain reads of it; give it, or leave the frame out"));
    const auto other = neighbor->read(its);
    if (!other.ok()) return other.status().at(name_of(which));
    for (Role role : kFileRoles) {
        if (!read.has(role)) continue;
        source.planes[role_of(which, role)] = (*other)->planes.at(role);
        source.description.planes.add(role_of(which, role));
    }
    return Status();
}

std::vector<std::string> planning_warnings(const ChainObject& chain, const PlannedArrays& planned) {
    std::vector<std::string> warnings = planned.source.warnings;
    for (auto& warning : sequence::plan_warnings(chain.chain, planned.plan, planned.source))
        warnings.push_back(std::move(warning));
    return warnings;
}

}  // namespace

std::shared_ptr<Frame> Frame::of_arrays(const FrameArrays& arrays, int number,
                                        const py::object& camera, const std::string& depth_encoding,
                                        double pixel_aspect, const py::kwargs& settings) {
    const auto& encodings = depth_encoding_names();
    const auto encoding = std::find(encodings.begin(), encodings.end(), depth_encoding);
    if (encoding == encodings.end())
        raise(Status(StatusCode::usage, concat("depth_encoding: unknown encoding '", depth_encoding,
                                               "'; known are ", joined(encodings))));
    if (!(pixel_aspect > 0 && pixel_aspect < 1e3))
        raise(Status(StatusCode::usage, "pixel_aspect: must be > 0"));
    auto frame = std::make_shared<Frame>();
    const std::string name = concat("frame ", number);
    frame->settings_ =
        job_settings("Frame", "frame.exr", "", camera, settings, &array_keys()).source;
    frame->settings_.color_frames.reset();
    frame->settings_.profile = value_of(find_profile("generic"));
    io::OpenFrame files;
    files.frame_number = number;
    files.files[Role::color] = std::make_shared<ArrayFile>(arrays, pixel_aspect, name);
    frame->header_ = value_of(sequence::header_of(frame->settings_, std::move(files)));
    frame->header_.match.options.depth = DepthEncoding(encoding - encodings.begin());
    return frame;
}

std::shared_ptr<Frame> Frame::of_files(const std::string& input, const py::object& number,
                                       const py::object& camera, const py::kwargs& settings) {
    auto frame = std::make_shared<Frame>();
    sequence::RunSettings job = job_settings("read", input, "", camera, settings, &file_keys());
    frame->settings_ = std::move(job.source);
    std::optional<io::FrameRange> range;
    if (!number.is_none()) range = io::FrameRange{{frame_number_of(number)}};
    const io::FrameList list = value_of(io::find_frames(job.input, range));
    if (!range && list.frames.size() > 1)
        raise(Status(StatusCode::usage,
                     concat(input, ": has ", list.frames.size(), " frames; name one with frame=")));
    const int wanted = list.frames.front();
    if (list.is_missing(wanted))
        raise(Status(StatusCode::input,
                     concat(job.input.color().format(wanted), ": frame is not on disk")));
    frame->header_ =
        value_of(sequence::open_source_frame(frame->settings_, list.files.at(wanted), wanted));
    return frame;
}

bool Frame::has_alpha() const {
    return header_.assignment.at(Role::color).channels.size() == 4;
}

Result<std::shared_ptr<const sequence::SourceFrame>> Frame::read(RoleSet wanted) const {
    const std::lock_guard lock(mutex_);
    if (source_ && read_ == wanted) return source_;
    auto source = sequence::read_source_frame(settings_, header_, wanted, io::Keep::nothing);
    if (!source.ok()) return source.status();
    source_ = std::make_shared<const sequence::SourceFrame>(std::move(*source));
    read_ = wanted;
    return source_;
}

PlanOptions plan_options_of(const py::kwargs& settings) {
    return job_settings("run", "frame.exr", "", py::none(), settings, &plan_keys()).plan;
}

Result<PlannedArrays> plan_arrays(const ChainObject& chain, const FrameWithNeighbors& frames,
                                  const PlanOptions& options) {
    if (const auto mattes = sequence::mattes_of(chain.chain); !mattes.empty())
        return Status(StatusCode::usage,
                      concat("chain: matte '", mattes.front(),
                             "': arrays have no mattes; filter the files with run_sequence()"));
    const Frame& frame = *frames.frame;
    const RoleSet planes = sequence::planes_to_read(
        frame.header(),
        sequence::planes_needed(chain.chain, frame.settings(), frame.header(), options));
    const auto read = frame.read(planes);
    if (!read.ok()) return read.status();
    PlannedArrays planned{**read, {}};
    for (const auto& [which, neighbor] : {std::pair{Neighbor::before, frames.before.get()},
                                          std::pair{Neighbor::after, frames.after.get()}})
        if (const Status status =
                add_neighbor(chain, options, which, neighbor, planes, planned.source);
            !status.ok())
            return status;
    auto plan = sequence::plan_source_frame(chain.chain, planned.source, options);
    if (!plan.ok()) return plan.status();
    planned.plan = std::move(*plan);
    return planned;
}

py::array run_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                    const PlanOptions& options, const std::shared_ptr<Device>& device) {
    std::vector<std::string> warnings;
    auto color = device->run("filtering a frame", [&](Call&, Executor& executor) -> Result<ImageF> {
        auto planned = plan_arrays(chain, frames, options);
        if (!planned.ok()) return planned.status();
        warnings = planning_warnings(chain, *planned);
        auto filtered = executor.filter(planned->plan, planned->source.planes);
        if (!filtered.ok()) return filtered.status();
        ImageF result = std::move(filtered->at(Role::color));
        return frames.frame->has_alpha() ? std::move(result) : without_alpha(result);
    });
    if (!color.ok()) raise(color.status());
    warn(warnings);
    return array_of(std::move(*color));
}

py::object plan_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                      const PlanOptions& options) {
    std::vector<std::string> warnings;
    auto json = in_background("planning a frame", [&](Call&) -> Result<io::Json> {
        auto planned = plan_arrays(chain, frames, options);
        if (!planned.ok()) return planned.status();
        warnings = planning_warnings(chain, *planned);
        io::Json plan = io::json_from(plan_json(planned->plan));
        plan["resolved"] = sequence::resolved_json(
            sequence::resolve_values(chain.chain, planned->source, planned->plan));
        return plan;
    });
    if (!json.ok()) raise(json.status());
    warn(warnings);
    return python_of(*json);
}

}  // namespace postchain::python
