#include "motion_vectors.h"

namespace host {

void MotionVectors::update(Ogre::SceneManager& scene, const Ogre::Camera& camera) {
    scene.getRootSceneNode()->_update(true, false);
    const Ogre::Matrix4 view_projection =
        camera.getProjectionMatrixWithRSDepth() * camera.getViewMatrix();
    std::unordered_map<const Ogre::SubEntity*, Ogre::Matrix4> current;
    for (const auto& [name, object] : scene.getMovableObjects("Entity")) {
        for (Ogre::SubEntity* part : static_cast<Ogre::Entity*>(object)->getSubEntities()) {
            Ogre::Matrix4 world;
            part->getWorldTransforms(&world);
            const Ogre::Matrix4 now = current[part] = view_projection * world;
            const auto before = previous_.find(part);
            const Ogre::Matrix4& there = before == previous_.end() ? now : before->second;
            const int rows[] = {0, 1, 3};
            for (size_t i = 0; i < 3; ++i) {
                const Ogre::Real* row = there[size_t(rows[i])];
                part->setCustomParameter(i, Ogre::Vector4(row[0], row[1], row[2], row[3]));
            }
        }
    }
    previous_ = std::move(current);
}

}  // namespace host
