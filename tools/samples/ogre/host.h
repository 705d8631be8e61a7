// OGRE without its configuration files: GL3Plus, a window, a scene, the compositor of media/ with
// the chain, and an overlay on top.
#pragma once
#include <Ogre.h>
#include <OgreOverlaySystem.h>

#include <memory>
#include <string>

#include "motion_vectors.h"
#include "postchain_pass.h"
#include "scene.h"

namespace host {

struct HostSettings {
    int width = 640, height = 360;
    bool reverse_depth = false;  // 1 at the near plane, 0 at the far one
    bool first_person = false;   // the camera carries a weapon
};

class Host {
  public:
    // Throws std::runtime_error: no display, no OpenGL, or a missing file of media/.
    explicit Host(const HostSettings& settings);
    ~Host();
    Host(const Host&) = delete;
    Host& operator=(const Host&) = delete;

    // One frame of a film: the scene at this frame, with the motion from the frame drawn before.
    void draw(double frame);
    // The scene without moving it.
    void draw();

    Scene& scene() { return *scene_; }
    MotionVectors& motion_vectors() { return motion_vectors_; }
    PostchainPass& postchain() { return *postchain_; }
    Ogre::RenderWindow& window() { return *window_; }
    // The textures of the scene: color (0), velocity (1), mask (2), depth (3).
    Ogre::TexturePtr plane(size_t index) const;
    void set_text(const std::string& text);

  private:
    void start(const HostSettings& settings);
    void open_window(const HostSettings& settings);
    void load_media();

    std::unique_ptr<Ogre::LogManager> log_;
    std::unique_ptr<Ogre::Root> root_;
    std::unique_ptr<Ogre::OverlaySystem> overlays_;
    Ogre::RenderWindow* window_ = nullptr;
    std::unique_ptr<PostchainPass> postchain_;
    std::unique_ptr<Scene> scene_;
    MotionVectors motion_vectors_;
    Ogre::CompositorInstance* compositor_ = nullptr;
};

}  // namespace host
