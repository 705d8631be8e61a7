#include "host.h"

#include <OgreFont.h>
#include <OgreFontManager.h>
#include <OgreOverlay.h>
#include <OgreOverlayElement.h>
#include <OgreOverlayManager.h>

#include <stdexcept>

namespace host {

Host::Host(const HostSettings& settings) {
    log_ = std::make_unique<Ogre::LogManager>();
    // Warnings and errors go to the console, nothing to a file.
    log_->createLog("", true, true, true)->setLogDetail(Ogre::LL_LOW);
    root_ = std::make_unique<Ogre::Root>("", "", "");
    try {
        start(settings);
    } catch (const Ogre::Exception& error) {
        // Its code may be in a plugin, which is unloaded with the root.
        throw std::runtime_error(error.getDescription());
    }
}

void Host::start(const HostSettings& settings) {
    overlays_ = std::make_unique<Ogre::OverlaySystem>();
    open_window(settings);
    postchain_ = std::make_unique<PostchainPass>();
    Scene::make_textures();
    load_media();
    scene_ = std::make_unique<Scene>(*root_, settings.width, settings.height);
    if (settings.first_person) scene_->add_weapon();
    postchain_->masked = settings.first_person;
    scene_->manager().addRenderQueueListener(overlays_.get());

    Ogre::Viewport* viewport = window_->addViewport(&scene_->camera());
    compositor_ = Ogre::CompositorManager::getSingleton().addCompositor(viewport, "Host/Frame");
    if (compositor_ == nullptr) throw std::runtime_error("there is no compositor Host/Frame");
    compositor_->setEnabled(true);
    Ogre::OverlayManager::getSingleton().getByName("Host/Hud")->show();
}

Host::~Host() {
    postchain_->output.reset();
    Ogre::CompositorManager::getSingleton().removeAll();
    postchain_.reset();  // while its context exists
    scene_->manager().removeRenderQueueListener(overlays_.get());
    root_->destroySceneManager(&scene_->manager());
    overlays_.reset();
    root_.reset();
}

void Host::open_window(const HostSettings& settings) {
    root_->loadPlugin(OGRE_PLUGIN_FOLDER "/RenderSystem_GL3Plus");
    root_->loadPlugin(OGRE_PLUGIN_FOLDER "/Codec_STBI");  // PNG
    Ogre::RenderSystem* renderer = root_->getAvailableRenderers().front();
    renderer->setConfigOption("Reversed Z-Buffer", settings.reverse_depth ? "Yes" : "No");
    root_->setRenderSystem(renderer);
    root_->initialise(false);
    window_ = root_->createRenderWindow("postchain in OGRE", uint32_t(settings.width),
                                        uint32_t(settings.height), false);
}

void Host::load_media() {
    auto& groups = Ogre::ResourceGroupManager::getSingleton();
    groups.addResourceLocation(SAMPLE_MEDIA, "FileSystem", Ogre::RGN_DEFAULT);
    groups.addResourceLocation(OGRE_MEDIA_FOLDER "/packs/SdkTrays.zip", "Zip", "Fonts");
    groups.initialiseResourceGroup(Ogre::RGN_DEFAULT);
    // OGRE creates a font's material. GL3Plus has no fixed-function pipeline, so it needs programs.
    auto font = Ogre::FontManager::getSingleton().getByName("Host/Font", Ogre::RGN_DEFAULT);
    font->load();
    Ogre::Pass* pass = font->getMaterial()->getTechnique(0)->getPass(0);
    pass->setVertexProgram("Host/FlatVertex");
    pass->setFragmentProgram("Host/TextFragment");
}

void Host::draw(double frame) {
    scene_->pose(frame);
    motion_vectors_.update(scene_->manager(), scene_->camera());
    draw();
}

void Host::draw() {
    root_->renderOneFrame();
}

Ogre::TexturePtr Host::plane(size_t index) const {
    return compositor_->getTextureInstance("scene", index);
}

void Host::set_text(const std::string& text) {
    Ogre::OverlayManager::getSingleton().getOverlayElement("Host/Hud/Text")->setCaption(text);
}

}  // namespace host
