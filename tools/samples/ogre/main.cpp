// An engine to copy from: OGRE 1.12 with the chain as a pass of its compositor.
//
// ogre_host [FRAMES [PICTURE.png [CHAIN]]]: ends after so many frames (0 = when it is interrupted),
// and writes the last one. CHAIN is a list of passes, default "joint_blur,fxaa". Builds in the
// tree, and alone: CMakeLists.txt. Where what is:
//
//   postchain_pass.*   the chain as a pass of the compositor: this is what to copy
//   motion_vectors.*   where every object was a frame ago, for the velocity
//   media/             the compositor's script, materials, shaders, the overlay
//   host.*  scene.*    OGRE's start, and something to look at
#include <cstdio>
#include <cstdlib>
#include <string>

#include "host.h"

namespace {

int run(int frames, const char* picture, const char* passes) {
    host::Host host({});
    pc_chain* chain = nullptr;
    if (pc_chain_create(passes, &chain) != PC_OK) {
        std::fprintf(stderr, "%s: %s\n", passes, pc_create_error());
        return 1;
    }
    host.postchain().set_chain(chain);
    for (int i = 0; frames == 0 || i < frames; ++i) {
        host.postchain().camera_cut = i == 0;
        host.set_text("frame " + std::to_string(i) + "\n" + passes);
        host.draw(i);
        if (!host.postchain().error().empty()) {
            std::fprintf(stderr, "postchain: %s\n", host.postchain().error().c_str());
            return 1;
        }
    }
    if (picture != nullptr) host.window().writeContentsToFile(picture);
    return 0;
}

}  // namespace

int main(int count, char** arguments) {
    try {
        return run(count > 1 ? std::atoi(arguments[1]) : 0, count > 2 ? arguments[2] : nullptr,
                   count > 3 ? arguments[3] : "joint_blur,fxaa");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "OGRE: %s\n", error.what());
        return 1;
    }
}
