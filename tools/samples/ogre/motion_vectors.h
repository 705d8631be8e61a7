// Each object's matrix in the previous frame, from which the scene's shader computes velocity.
#pragma once
#include <Ogre.h>

#include <unordered_map>

namespace host {

// Sets custom parameters 0 to 2 of each part of every entity: the rows x, y and w of the previous
// frame's matrix from object to clip space, y up (scene.vert).
class MotionVectors {
  public:
    // Call once a frame, when the scene is ready to be drawn. A new object has no velocity.
    void update(Ogre::SceneManager& scene, const Ogre::Camera& camera);
    // At a cut: the next frame has no velocity.
    void forget() { previous_.clear(); }

  private:
    std::unordered_map<const Ogre::SubEntity*, Ogre::Matrix4> previous_;
};

}  // namespace host
