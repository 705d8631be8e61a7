// The place of a work group and of an invocation in the step. A dispatch may be a band of a step
// (chain/plan/bands.h): its first work group is then not (0, 0). Include it after the work group's size.
#ifdef VULKAN
layout(push_constant) uniform FirstGroup { uvec2 first_group; };
#else
layout(location = 0) uniform uvec2 first_group;
#endif

ivec2 group_at() {
    return ivec2(first_group + gl_WorkGroupID.xy);
}

ivec2 invocation_at() {
    return group_at() * ivec2(gl_WorkGroupSize.xy) + ivec2(gl_LocalInvocationID.xy);
}
