// postchain.Frame: one frame of arrays or files, and filtering one.
#pragma once

#include <pybind11/pybind11.h>

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

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
    // against it. `camera`: a dict, a path, or None. `behind`: the layer behind; null: none.
    // `settings`: keys of array_keys() and aov_keys(). Raise.
    static std::shared_ptr<Frame> of_arrays(const std::string& method, const FrameArrays& arrays,
                                            const pybind11::object& number,
                                            const pybind11::object& camera,
                                            const std::string& depth_encoding, double pixel_aspect,
                                            std::shared_ptr<const Frame> behind,
                                            const pybind11::kwargs& settings);
    // `input`: a file, or a pattern of which `number` is a frame. `settings`: keys of read_keys().
    static std::shared_ptr<Frame> of_files(const std::string& input, const pybind11::object& number,
                                           const pybind11::object& camera,
                                           const pybind11::kwargs& settings);

    // The frame with these mattes and, if wanted, a fill mask; this one without both. Errors
    // (usage): a matte that is not among the arrays; those of sequence::header_of(). Any thread.
    Result<std::shared_ptr<const Frame>> with(const std::vector<std::string>& mattes,
                                              bool fill_mask = false) const;

    const sequence::SourceSettings& settings() const { return settings_; }
    const sequence::FrameHeader& header() const { return header_; }
    int number() const { return header_.files.frame_number; }
    bool has_number() const { return has_number_; }
    bool has_alpha() const;
    // Color and the planes of `wanted` that it has. Any thread.
    Result<std::shared_ptr<const sequence::SourceFrame>> read(RoleSet wanted) const;
    // Adds the layer behind, if `planes` has it, to what was read of them. Any thread.
    Status add_behind(RoleSet planes, sequence::SourceFrame& source) const;
    // A frame of files.
    bool is_of_files() const { return !depth_encoding_; }

  private:
    Status open(io::FrameFiles files);

    sequence::SourceSettings settings_;
    std::optional<DepthEncoding> depth_encoding_;  // of arrays
    std::shared_ptr<const Frame> behind_;          // of arrays; null: none
    std::string behind_path_;                      // of files; empty: none, or color is deep
    bool has_number_ = true;
    sequence::FrameHeader header_;
    mutable std::mutex mutex_;
    mutable RoleSet read_;
    mutable std::shared_ptr<const sequence::SourceFrame> source_;
    mutable std::shared_ptr<const Frame> with_;  // the last one that with() made
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
                                  const PlanOptions& options, bool fill_mask);

// The keys of keyword arguments that decide how a frame is read, and how it is planned; others are
// refused. Raises.
PlanOptions plan_options_of(const pybind11::kwargs& settings);

// The color that the chain makes of the frame, with as many channels as its own. Errors (usage): it
// has AOVs or cryptomattes to filter. Raises; warns.
pybind11::array run_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                          const PlanOptions& options, const std::shared_ptr<Device>& device);
// The results of filter() beside color, AOVs, cryptomattes and times.
struct FilterRequest {
    bool fill_mask = false;
    bool all_stages = false;
    std::vector<std::string> stages;  // some of them
};
// postchain.Filtered. Raises; warns.
pybind11::object filter_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                              const PlanOptions& options, const FilterRequest& request,
                              const std::shared_ptr<Device>& device);
// Dicts of a frame's AOVs, of these mattes, and of the cryptomattes that are filtered. Raise; warn.
pybind11::dict aovs_of(const Frame& frame);
pybind11::dict mattes_of(const Frame& frame, const std::vector<std::string>& names);
pybind11::dict cryptomattes_of(const Frame& frame);
// The plan as JSON, as `postchain plan --json` prints it. Raises; warns.
pybind11::object plan_chain(const ChainObject& chain, const FrameWithNeighbors& frames,
                            const PlanOptions& options);

}  // namespace postchain::python
