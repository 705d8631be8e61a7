#include "chain/guest/purpose.h"

namespace postchain::guest {

Status resolve(const Chain& chain, const HostFrame& frame, const PlanKey& key,
               ResolvedChain& resolved, Purpose& purpose) {
    purpose = {key, options_of(frame), {}, {}, values_of(frame), frame.given->frame_number};
    purpose.rules = purpose.options.rules(chain);
    RETURN_IF_ERROR(
        resolved.resolve(chain, describe(frame, chain), purpose.options, purpose.rules));
    purpose.shape = resolved.shape();
    return Status();
}

shared::GuestUniforms uniforms_of(const HostFrame& frame, const HostPlan& host, const Plan& plan) {
    shared::GuestUniforms uniforms = uniforms_of(frame);
    uniforms.makes = host.makes;
    if (host.shown < 0) return uniforms;
    const PlanTexture& shown = plan.textures[size_t(host.shown)];
    uniforms.shown_size = {shown.width, shown.height};
    const struct {
        TextureId id;
        const pc_texture& texture;
        const HostTexture& checked;
    } views[] = {{host.color, frame.given->color, frame.color},
                 {host.depth, frame.given->depth, frame.depth},
                 {host.motion, frame.given->motion, frame.motion},
                 {host.mask, frame.given->mask, frame.mask}};
    for (const auto& [id, texture, checked] : views) {
        if (host.shown != id) continue;
        uniforms.shown_at = {texture.x, texture.y};
        uniforms.shown_size = {checked.width, checked.height};
        uniforms.shown_image = {checked.image.layer, checked.image.level};
    }
    return uniforms;
}

}  // namespace postchain::guest
