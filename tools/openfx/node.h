// The state of an effect's parameters and clips at a time: chain, camera and conventions; and the
// frame that the host has there, as canonical planes with those of the frames before and after.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/frame/convert.h"
#include "chain/pass/planner.h"
#include "config/camera_file.h"
#include "tools/openfx/conventions.h"
#include "tools/openfx/effects.h"

namespace postchain::openfx {

// A time and scale that the host asks about.
struct Moment {
    double time = 0;
    double scale_x = 1, scale_y = 1;  // of the render: below 1 for a proxy

    int frame() const;
};

// The camera file that was read last, kept while it does not change.
class CameraFiles {
  public:
    Result<std::shared_ptr<const CameraFile>> load(const std::string& path);

  private:
    std::mutex mutex_;
    std::string read_;  // path, size and time of change
    std::shared_ptr<const CameraFile> file_;
};

class Node {
  public:
    // Reads the parameters. Errors (chain, input): their values, a chain file, a camera file.
    static Result<Node> read(const EffectType& type, Effect effect, const Moment& moment,
                             CameraFiles& files);

    const Chain& chain() const { return chain_; }
    const Conventions& conventions() const { return conventions_; }
    // Planes that its connected clips bring, and those that are made from the camera.
    RoleSet own() const { return own_; }
    // Planes to read of the frame, and of its neighbors under their names there.
    RoleSet wanted() const { return wanted_; }
    // The frames to read of a clip, relative to this one.
    std::vector<int> frames_of(Clip clip) const;
    // Without pixels, and with unknown bounds.
    FrameDescription description() const;
    // make_plan(); an error also names the clips that would bring the planes it lacks.
    Result<Plan> plan(const FrameDescription& frame, const PlanOptions& options) const;
    // The rectangle that a result can fill, and that of the frame, pixels.
    Bounds window() const { return window_; }
    // `window` in the host's canonical coordinates.
    Region region() const;
    // Whether the noise changes with the frame number.
    bool varies() const;

    struct Frame {
        SharedPlanes planes;
        FrameDescription description;
        InputHealth health;
        ConvertOptions options;
        ImageF stored;  // color as the host has it, if it is not premultiplied
        std::vector<std::string> notes;
    };
    // Reads the frame and its neighbors. Errors (input): a clip without an image, of integers, or
    // one that does not cover Source; (memory): more than the machine has.
    Result<Frame> read_frame() const;

  private:
    struct OneFrame;
    // The clips of a frame: its own, or those of the layer behind.
    struct Layer {
        Clip color = Clip::source, depth = Clip::depth, motion = Clip::motion;
    };
    Node(const EffectType& type, Effect effect, const Moment& moment)
        : type_(&type), effect_(effect), moment_(moment), values_(effect, moment.time) {}
    Status read_clips();
    void read_sizes();
    Status read_chain();
    Status read_camera(CameraFiles& files);
    void find_wanted();
    Camera camera_at(int offset) const;
    Region display_region() const;
    Result<OneFrame> read_at(int offset, RoleSet present, const Layer& layer) const;
    Status read_behind(Frame& frame) const;
    void add_neighbors(RoleSet present, Frame& frame) const;
    uint64_t bytes() const;

    struct ConnectedClip {
        ClipHandle handle = nullptr;
        bool connected = false;
        double first = 0, last = 0;  // frames that it has
    };
    ClipHandle clip(Clip one) const { return clips_[size_t(one)].handle; }
    bool connected(Clip one) const { return clips_[size_t(one)].connected; }

    const EffectType* type_;
    Effect effect_;
    Moment moment_;
    Values values_;
    std::array<ConnectedClip, kClips> clips_;
    double pixel_aspect_ = 1;
    Bounds source_, display_, window_;
    Chain chain_;
    Conventions conventions_;
    std::shared_ptr<const CameraFile> camera_file_;  // may be null
    bool cut_before_ = false, cut_after_ = false;
    RoleSet own_, wanted_;
};

}  // namespace postchain::openfx
