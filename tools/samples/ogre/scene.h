// The scene of the sample: a turning windmill, a ball that passes in front of it, a crate that
// tumbles behind it and lamps on a wall. The camera pans and moves, and may carry a weapon.
#pragma once
#include <Ogre.h>

namespace host {

class Scene {
  public:
    // Creates the textures that the materials of media/ name. Call before these are parsed.
    static void make_textures();
    // `width` / `height` is the camera's aspect ratio.
    Scene(Ogre::Root& root, int width, int height);

    // A first-person weapon, which the mask covers.
    void add_weapon();

    // Moves everything to a time in frames; fractions are times within the shutter.
    void pose(double frame);
    // Moves the camera to a point of its lens, in scene units to its right and upward. Objects at
    // `focus_distance` keep their place in the image.
    void look_from(float right, float up, float focus_distance);

    Ogre::SceneManager& manager() { return manager_; }
    Ogre::Camera& camera() { return *camera_; }

  private:
    Ogre::SceneNode* add(Ogre::SceneNode* parent, Ogre::SceneManager::PrefabType shape,
                         const char* material, const Ogre::Vector3& size,
                         const Ogre::Vector3& place);

    Ogre::SceneManager& manager_;
    Ogre::Camera* camera_ = nullptr;
    Ogre::SceneNode* eye_ = nullptr;
    Ogre::SceneNode* sails_ = nullptr;
    Ogre::SceneNode* ball_ = nullptr;
    Ogre::SceneNode* crate_ = nullptr;
    Ogre::SceneNode* weapon_ = nullptr;
};

}  // namespace host
