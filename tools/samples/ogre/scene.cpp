#include "scene.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace host {

namespace {

// Squares of two colors, of slightly different brightness each.
void make_texture(const char* name, int squares, std::array<int, 3> first,
                  std::array<int, 3> second) {
    constexpr int kSize = 512;
    std::vector<uint8_t> texels(size_t(kSize * kSize * 3));
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const int column = x * squares / kSize, row = y * squares / kSize;
            const auto& color = (column + row) % 2 == 0 ? first : second;
            const uint32_t mixed =
                (uint32_t(column) * 73856093u ^ uint32_t(row) * 19349663u) * 2654435761u;
            const double shade = 0.55 + 0.45 * double(mixed >> 24) / 255.0;
            for (size_t c = 0; c < 3; ++c)
                texels[size_t(y * kSize + x) * 3 + c] = uint8_t(color[c] * shade);
        }
    }
    Ogre::Image image;
    image.loadDynamicImage(texels.data(), kSize, kSize, 1, Ogre::PF_BYTE_RGB);
    Ogre::TextureManager::getSingleton().loadImage(name, Ogre::RGN_DEFAULT, image,
                                                   Ogre::TEX_TYPE_2D, Ogre::MIP_UNLIMITED, 1.0f,
                                                   false, Ogre::PF_UNKNOWN, true);
}

}  // namespace

void Scene::make_textures() {
    make_texture("wall", 48, {230, 225, 210}, {70, 90, 120});
    make_texture("floor", 40, {190, 150, 110}, {60, 50, 45});
    make_texture("sails", 12, {240, 200, 90}, {150, 30, 30});
    make_texture("ball", 8, {90, 200, 120}, {20, 50, 60});
    make_texture("crate", 6, {220, 120, 60}, {80, 60, 160});
    make_texture("weapon", 5, {120, 130, 150}, {60, 65, 80});
}

Scene::Scene(Ogre::Root& root, int width, int height) : manager_(*root.createSceneManager()) {
    Ogre::SceneNode* top = manager_.getRootSceneNode();
    using Ogre::SceneManager;
    add(top, SceneManager::PT_CUBE, "Host/Wall", {30, 30, 0.1f}, {0, 0, -10});
    add(top, SceneManager::PT_CUBE, "Host/Floor", {30, 0.1f, 30}, {0, -1.8f, -6});
    sails_ = top->createChildSceneNode(Ogre::Vector3(-0.9f, 0.2f, -4.2f));
    add(sails_, SceneManager::PT_CUBE, "Host/Sails", {2.4f, 0.32f, 0.06f}, {0, 0, 0});
    add(sails_, SceneManager::PT_CUBE, "Host/Sails", {0.32f, 2.4f, 0.06f}, {0, 0, 0.02f});
    ball_ = add(top, SceneManager::PT_SPHERE, "Host/Ball", {0.8f, 0.8f, 0.8f}, {0, 0, 0});
    crate_ = add(top, SceneManager::PT_CUBE, "Host/Crate", {1.3f, 1.3f, 1.3f}, {0, 0, 0});
    for (int i = 0; i < 6; ++i)
        add(top, SceneManager::PT_SPHERE, "Host/Lamp", {0.12f, 0.12f, 0.12f},
            {-4.5f + 1.8f * float(i), 2.2f - 0.5f * float(i % 3), -9.7f});

    camera_ = manager_.createCamera("camera");
    camera_->setNearClipDistance(0.5f);
    camera_->setFarClipDistance(60.0f);
    camera_->setFOVy(Ogre::Degree(33));
    camera_->setAspectRatio(float(width) / float(height));
    eye_ = top->createChildSceneNode();
    eye_->attachObject(camera_);
}

Ogre::SceneNode* Scene::add(Ogre::SceneNode* parent, Ogre::SceneManager::PrefabType shape,
                            const char* material, const Ogre::Vector3& size,
                            const Ogre::Vector3& place) {
    Ogre::Entity* entity = manager_.createEntity(shape);
    entity->setMaterialName(material);
    Ogre::SceneNode* node = parent->createChildSceneNode(place);
    node->setScale(size / 100.0f);  // OGRE's prefabs are 100 units wide
    node->attachObject(entity);
    return node;
}

void Scene::add_weapon() {
    weapon_ = eye_->createChildSceneNode();
    const auto part = [this](const Ogre::Vector3& size, const Ogre::Vector3& place) {
        add(weapon_, Ogre::SceneManager::PT_CUBE, "Host/Weapon", size, place);
    };
    part({0.09f, 0.11f, 0.7f}, {0.0f, 0.0f, 0.0f});
    part({0.05f, 0.05f, 0.3f}, {0.0f, 0.02f, -0.45f});
    part({0.02f, 0.05f, 0.02f}, {0.0f, 0.07f, -0.55f});
    part({0.07f, 0.3f, 0.12f}, {0.0f, -0.16f, 0.15f});
}

void Scene::pose(double frame) {
    const float t = float(frame);
    eye_->setPosition(0.5f * std::sin(0.15f * t), 0.1f * std::cos(0.2f * t), 0.0f);
    eye_->setOrientation(
        Ogre::Quaternion(Ogre::Radian(0.12f * std::sin(0.2f * t)), Ogre::Vector3::UNIT_Y));
    camera_->setFrustumOffset(0, 0);
    if (weapon_ != nullptr)  // sways with each step
        weapon_->setPosition(0.27f + 0.01f * std::sin(0.25f * t),
                             -0.22f + 0.01f * std::sin(0.5f * t), -1.2f);
    sails_->setOrientation(Ogre::Quaternion(Ogre::Radian(0.22f * t), Ogre::Vector3::UNIT_Z));
    ball_->setPosition(0.9f * std::sin(0.35f * t), -0.45f + 0.1f * std::sin(0.7f * t), -2.6f);
    crate_->setPosition(1.7f, 0.4f + 0.6f * std::sin(0.3f * t), -6.5f);
    crate_->setOrientation(
        Ogre::Quaternion(Ogre::Radian(0.12f * t), Ogre::Vector3(0.6f, 0.8f, 0.0f)));
}

void Scene::look_from(float right, float up, float focus_distance) {
    eye_->translate(Ogre::Vector3(right, up, 0), Ogre::Node::TS_LOCAL);
    camera_->setFocalLength(focus_distance);
    camera_->setFrustumOffset(-right, -up);
}

}  // namespace host
