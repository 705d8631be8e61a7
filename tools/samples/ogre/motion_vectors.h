// What the scene's shader needs for velocity: where each object was a frame ago.
#pragma once
#include <Ogre.h>

#include <unordered_map>

namespace host {

// For every entity of a scene, as custom parameters 0 to 2 of its parts: the rows x, y and w of the
// matrix from object to clip space that it had a frame ago, y up (scene.vert).
class MotionVectors {
  public:
    // Once a frame, when the scene stands as it will be drawn. An object that is new has no
    // velocity.
    void update(Ogre::SceneManager& scene, const Ogre::Camera& camera);
    // At a cut: the next frame has no velocity.
    void forget() { previous_.clear(); }

  private:
    std::unordered_map<const Ogre::SubEntity*, Ogre::Matrix4> previous_;
};

}  // namespace host
