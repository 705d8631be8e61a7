// postchain as a pass of OGRE's compositor. In a script:
//
//   pass render_custom postchain { input 0 scene 0  input 1 scene 1  input 2 scene 2 ... }
//
// The four inputs are color, velocity, mask and depth. It filters color in place.
#pragma once
#include <Ogre.h>
#include <OgreCustomCompositionPass.h>
#include <postchain/postchain.h>

#include <functional>
#include <string>

namespace host {

// Values that OGRE's camera lacks. Focal length and sensor follow from its field of view.
struct Lens {
    float f_stop = 1.4f;
    float focus_distance = 4.2f;  // scene units
    float sensor_width_mm = 36.0f;
    float meters_per_unit = 0.1f;
    float shutter_frames = 0.5f;

    float focal_length_mm(const Ogre::Camera& camera) const;
};

class PostchainPass : public Ogre::CustomCompositionPass {
  public:
    // Registers itself as "postchain". Call before scripts that use it are parsed.
    PostchainPass();
    // The GL context must be current, as it is until OGRE's root is shut down.
    ~PostchainPass() override;
    PostchainPass(const PostchainPass&) = delete;
    PostchainPass& operator=(const PostchainPass&) = delete;

    // Takes ownership of the chain; null: the image is unchanged.
    void set_chain(pc_chain* chain);

    Lens lens;
    bool masked = false;      // something in the frame is: a mask costs time
    Ogre::TexturePtr output;  // null: color itself
    // Called with each frame's description, to set further members (bounds, debug_view).
    std::function<void(pc_frame&)> adjust;
    const std::string& error() const { return error_; }  // of the last frame; empty = none
    const pc_frame& frame() const { return frame_; }     // the last frame, as it was described
    pc_instance* instance() const { return instance_; }  // null before the first frame

    Ogre::CompositorInstance::RenderSystemOperation* createOperation(
        Ogre::CompositorInstance* compositor, const Ogre::CompositionPass* pass) override;

  private:
    class Operation;
    void run(const Ogre::TexturePtr& color, const Ogre::TexturePtr& velocity,
             const Ogre::TexturePtr& mask, const Ogre::TexturePtr& depth,
             const Ogre::Camera& camera);
    bool start();

    pc_instance* instance_ = nullptr;
    pc_chain* chain_ = nullptr;
    pc_frame frame_ = {};
    std::string error_;
};

}  // namespace host
