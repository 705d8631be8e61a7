// postchain.Frame: one frame of arrays or files, and filtering one.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>

#include "tools/python/array_file.h"
#include "tools/python/chain_object.h"
#include "tools/python/device.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::python {

// A frame whose planes are converted when a chain first needs them, and kept.
class Frame : public std::enable_shared_from_this<Frame> {
  public:
    // `method`: the caller's, for messages. `number`: None is 0, and no neighbor's number is held
    // against it. `camera`: a dict, a path, or None. `settings`: keys of array_keys() and
    // aov_keys(). Raise.
    static std::shared_ptr<Frame> of_arrays(const std::string& method, const FrameArrays& arrays,
                                            const pybind11::object& number,
                                            const pybind11::object& camera,
                                            const std::string& depth_encoding, double pixel_aspect,
                                            const pybind11::kwargs& settings);
    // `input`: a file, or a pattern of which `number` is a frame. `settings`: keys of read_keys().
    static std::shared_ptr<Frame> of_files(const std::string& input, const pybind11::object& number,
                                           const pybind11::object& camera,
                                           const pybind11::kwargs& settings);

    // The frame with the mattes that the chain names; this one if it names none. Errors (usage): a
    // matte that is not among the arrays; those of sequence::header_of(). Any thread.
    Result<std::shared_ptr<const Frame>> with_mattes_of(const Chain& chain) const;

    const sequence::SourceSettings& settings() const { return settings_; }
    const sequence::FrameHeader& header() const { return header_; }
    int number() const { return header_.files.frame_number; }
    bool has_number() const { return has_number_; }
    bool has_alpha() const;
    // Color and the planes of `wanted` that it has. Any thread.
    Result<std::shared_ptr<const sequence::SourceFrame>> read(RoleSet wanted) const;

  private:
    Status open(io::OpenFrame files);

    sequence::SourceSettings settings_;
    std::optional<DepthEncoding> depth_encoding_;  // of arrays
    bool has_number_ = true;
    sequence::FrameHeader header_;
    mutable std::mutex mutex_;
    mutable RoleSet read_;
    mutable std::shared_ptr<const sequence::SourceFrame> source_;
    mutable std::shared_ptr<const Frame> with_mattes_;  // of the last chain that names some
};
using FramePtr = std::shared_ptr<const Frame>;

// A frame with the frames before and after, which may be null.
struct FrameWithNeighbors {
    FramePtr frame, before, after;
    bool unsaid = false;  // whether there are such frames
};

// The planned frame: what `run` filters. Errors: those of plan_source_frame(); (usage) a neighbor
// of another size, or without a plane that the chain reads of it.
struct PlannedArrays {
    sequence::SourceFrame source;
    sequence::FramePlan plan;
};
Result<PlannedArrays> plan_arrays(const ChainObject& chain, const FrameWithNeighbors& frames,
                                  const PlanOptions& options);

// The keys of keyword arguments that decide how a frame is read, and how it is planned; others are
// refused. Raises.
PlanOptions plan_options_of(const pybind11::kwargs& settings);

// The color that the chain makes of the frame, with as many channels as its own. Errors (usage): it
// has AOVs or cryptomattes to filter. Raises; warns.
pybind11::array run_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                          const PlanOptions& options, const std::shared_ptr<Device>& device);
// postchain.Filtered: color, AOVs and cryptomattes. Raises; warns.
pybind11::object run_aovs(const ChainObject& chain, const FrameWithNeighbors& frames,
                          const PlanOptions& options, const std::shared_ptr<Device>& device);
// The plan as JSON, as `postchain plan --json` prints it. Raises; warns.
pybind11::object plan_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                            const PlanOptions& options);

}  // namespace postchain::python
