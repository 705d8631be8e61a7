#include "postchain_pass.h"

#include <epoxy/gl.h>

#include <cmath>

namespace host {

namespace {

constexpr char kName[] = "postchain";

// Describes a texture of OGRE to the chain. The format comes from GL, because OGRE uses another one
// if the card lacks the script's.
pc_texture texture_of(const Ogre::TexturePtr& texture) {
    pc_texture result = {};
    texture->getCustomAttribute("GLID", &result.name);
    GLint format = 0;
    glGetTextureLevelParameteriv(result.name, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    result.internal_format = uint32_t(format);
    result.width = int32_t(texture->getWidth());
    result.height = int32_t(texture->getHeight());
    return result;
}

}  // namespace

float Lens::focal_length_mm(const Ogre::Camera& camera) const {
    const float half_fov_y = camera.getFOVy().valueRadians() / 2.0f;
    return sensor_width_mm / (2.0f * std::tan(half_fov_y) * camera.getAspectRatio());
}

// An instance of the pass in a compiled compositor, with its textures.
class PostchainPass::Operation : public Ogre::CompositorInstance::RenderSystemOperation {
  public:
    Operation(PostchainPass& owner, Ogre::CompositorInstance& compositor,
              const Ogre::CompositionPass& pass)
        : owner_(owner), compositor_(compositor), pass_(pass) {}

    void execute(Ogre::SceneManager*, Ogre::RenderSystem*) override {
        owner_.run(input(0), input(1), input(2), input(3),
                   *compositor_.getChain()->getViewport()->getCamera());
    }

  private:
    Ogre::TexturePtr input(size_t i) const {
        const auto& place = pass_.getInput(i);
        return compositor_.getTextureInstance(place.name, place.mrtIndex);
    }

    PostchainPass& owner_;
    Ogre::CompositorInstance& compositor_;
    const Ogre::CompositionPass& pass_;
};

PostchainPass::PostchainPass() {
    Ogre::CompositorManager::getSingleton().registerCustomCompositionPass(kName, this);
}

PostchainPass::~PostchainPass() {
    Ogre::CompositorManager::getSingleton().unregisterCustomCompositionPass(kName);
    pc_chain_destroy(chain_);
    pc_destroy(instance_);
}

void PostchainPass::set_chain(pc_chain* chain) {
    pc_chain_destroy(chain_);
    chain_ = chain;
}

Ogre::CompositorInstance::RenderSystemOperation* PostchainPass::createOperation(
    Ogre::CompositorInstance* compositor, const Ogre::CompositionPass* pass) {
    return OGRE_NEW Operation(*this, *compositor, *pass);
}

// The first frame creates the instance, on OGRE's context.
bool PostchainPass::start() {
    if (instance_ != nullptr) return true;
    pc_create_info info = {};
    info.struct_size = sizeof(info);
    info.api_version = PC_API_VERSION;
    // OGRE caches GL state and sets only differences, so the state must be restored.
    info.state = PC_STATE_RESTORE;
    return pc_create(&info, &instance_) == PC_OK;
}

void PostchainPass::run(const Ogre::TexturePtr& color, const Ogre::TexturePtr& velocity,
                        const Ogre::TexturePtr& mask, const Ogre::TexturePtr& depth,
                        const Ogre::Camera& camera) {
    error_.clear();
    if (chain_ == nullptr) return;
    if (!start()) {
        error_ = pc_error();
        return;
    }
    const uint64_t number = frame_.frame_number + 1;
    frame_ = {};
    frame_.struct_size = sizeof(frame_);
    frame_.frame_number = number;
    frame_.color = texture_of(color);
    frame_.motion = texture_of(velocity);
    frame_.depth = texture_of(depth);
    if (masked) frame_.mask = texture_of(mask);
    frame_.output = output ? texture_of(output) : frame_.color;

    // OGRE draws into textures upside down: row 0 is the top of the image.
    if (color->getBuffer()->getRenderTarget()->requiresTextureFlipping())
        frame_.flags |= PC_TOP_LEFT;

    // scene.frag: this frame minus previous, in normalized device coordinates, y along the rows.
    frame_.motion_scale[0] = float(frame_.color.width) / 2.0f;
    frame_.motion_scale[1] = float(frame_.color.height) / 2.0f;

    const bool reverse =
        Ogre::Root::getSingleton().getRenderSystem()->isReverseDepthBufferEnabled();
    frame_.depth_encoding = reverse ? PC_DEPTH_REVERSE : PC_DEPTH_FORWARD;
    frame_.near_clip = camera.getNearClipDistance();
    frame_.far_clip = camera.getFarClipDistance();

    frame_.focal_length_mm = lens.focal_length_mm(camera);
    frame_.sensor_width_mm = lens.sensor_width_mm;
    frame_.f_stop = lens.f_stop;
    frame_.focus_distance = lens.focus_distance;
    frame_.meters_per_unit = lens.meters_per_unit;
    frame_.shutter_frames = lens.shutter_frames;
    // The next frame draws into color, and a host may read it back.
    frame_.barriers = GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT;
    if (adjust) adjust(frame_);

    pc_result result = pc_run(instance_, chain_, &frame_, nullptr);
    // The first frame of a chain compiles its programs; a game does that while it loads.
    if (result == PC_ERROR_PREPARE) {
        result = pc_prepare(instance_, chain_, &frame_, 1);
        if (result == PC_OK) result = pc_run(instance_, chain_, &frame_, nullptr);
    }
    // On failure color is unchanged.
    if (result != PC_OK) error_ = pc_last_error(instance_);
}

}  // namespace host
