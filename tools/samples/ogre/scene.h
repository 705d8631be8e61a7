// The scene of the sample: a windmill that turns, a ball that passes before it, a crate that
// tumbles behind it and lamps on a wall, seen by a camera that pans and moves.
#pragma once
#include <Ogre.h>

namespace host {

class Scene {
  public:
    // The textures that the materials of media/ name: before these are parsed.
    static void make_textures();
    // `width` / `height` is the camera's aspect ratio.
    Scene(Ogre::Root& root, int width, int height);

    // Everything at a time in frames; fractions are times within the shutter.
    void pose(double frame);
    // The camera at a point of its lens: moved by so many scene units to its right and upward,
    // while what is at `focus_distance` stays where it is in the picture.
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
};

}  // namespace host
