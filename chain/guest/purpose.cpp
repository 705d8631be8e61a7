#include "chain/guest/purpose.h"

namespace postchain::guest {

Status resolve(const Chain& chain, const HostFrame& frame, const PlanKey& key,
               ResolvedChain& resolved, Purpose& purpose) {
    purpose = {key, options_of(frame), {}, {}, values_of(frame), frame.given->frame_number};
    purpose.rules = purpose.options.rules(chain);
    if (Status s = resolved.resolve(chain, describe(frame), purpose.options, purpose.rules);
        !s.ok())
        return s;
    purpose.shape = resolved.shape();
    return Status();
}

shared::GuestUniforms uniforms_of(const HostFrame& frame, const HostPlan& host, const Plan& plan) {
    shared::GuestUniforms uniforms = uniforms_of(frame);
    uniforms.makes = host.makes;
    if (host.shown < 0) return uniforms;
    const PlanTexture& shown = plan.textures[size_t(host.shown)];
    uniforms.shown_size = {shown.width, shown.height};
    const std::pair<TextureId, const pc_texture&> views[] = {{host.color, frame.given->color},
                                                             {host.depth, frame.given->depth},
                                                             {host.motion, frame.given->motion}};
    for (const auto& [id, texture] : views)
        if (host.shown == id) uniforms.shown_at = {texture.x, texture.y};
    return uniforms;
}

}  // namespace postchain::guest
