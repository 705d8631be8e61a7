/* A frame's plan as data, for hosts that execute it themselves: in Direct3D 12, Metal, or a render
 * hardware interface of their own. Needs no device. C11 and C++20. Introduction:
 * docs/own_device.md. */
/*                                                                                                  */
/*   pc_plan_create()  pc_chain_create()  pc_plan_programs()      once */
/*   pc_plan_frame()                                              every frame, then execute it */

/* Chains, results, pc_error(), pc_frame and the rules about structs, flags, handles and threads are
 * those of postchain.h, which this header includes. A planner is an instance: two threads cannot be
 * in calls on one planner; the second one gets PC_ERROR_ARGUMENT. Two planners share nothing. The
 * structs of the arrays, which have no struct_size, never change. */

/* A frame: pc_frame without handles. In each pc_texture, `name` is a number that the host chooses
 * for its texture: not 0, and equal if two are one texture, as output over color. internal_format
 * is a PC_FORMAT_*. Row 0 is the top, unless PC_BOTTOM_LEFT is set. A host's view selects slice and
 * level: pc_slice members are 0, and so is `barriers`. A chain with `focus_at` is PC_ERROR_CHAIN,
 * because it needs a depth read back from the device: unset it, and give focus_distance. */

/* A frame like the last ones changes values alone: pc_plan_frame() writes the uniform blocks, work
 * groups and sizes, and allocates nothing. It plans, which allocates, if the chain's values, a
 * format or a convention are new, or a pass that was skipped begins to work. */
#ifndef POSTCHAIN_POSTCHAIN_PLAN_H
#define POSTCHAIN_POSTCHAIN_PLAN_H
#include <postchain/postchain.h>
#ifdef __cplusplus
extern "C" {
#endif

/* Formats; docs/own_device.md has those of DXGI, Metal and Vulkan. Components without a suffix are
 * normalized; F: float, S: signed normalized, UI: unsigned integers. */
typedef uint32_t pc_format;
enum {
    PC_FORMAT_NONE = 0,
    /* Of the plan's textures, and of a host's up to PC_FORMAT_R8. */
    PC_FORMAT_RGBA32F = 1,
    PC_FORMAT_RGBA16F = 2,
    PC_FORMAT_RG32F = 3,
    PC_FORMAT_RG16F = 4,
    PC_FORMAT_R32F = 5,
    PC_FORMAT_R16F = 6,
    PC_FORMAT_RGBA8 = 7,
    PC_FORMAT_RG8 = 8,
    PC_FORMAT_R8 = 9,
    PC_FORMAT_RGBA32UI = 10,
    PC_FORMAT_R32UI = 11,
    PC_FORMAT_LIST = 12, /* a buffer of 32-bit numbers, not a texture */
    /* Of a host's textures alone. Depth formats are those of a view of the depth aspect. */
    PC_FORMAT_R11G11B10F = 13,
    PC_FORMAT_RGB9E5 = 14,
    PC_FORMAT_RGBA16 = 15,
    PC_FORMAT_BGRA8 = 16,
    PC_FORMAT_RGB10A2 = 17,
    PC_FORMAT_RGBA8_SRGB = 18,
    PC_FORMAT_BGRA8_SRGB = 19,
    PC_FORMAT_RGBA16S = 20,
    PC_FORMAT_RGBA8S = 21,
    PC_FORMAT_RG16 = 22,
    PC_FORMAT_RG16S = 23,
    PC_FORMAT_RG8S = 24,
    PC_FORMAT_R16 = 25,
    PC_FORMAT_D32F = 26,
    PC_FORMAT_D24 = 27,
    PC_FORMAT_D16 = 28
};

#define PC_PLAN_NONE 0xffffffffu /* instead of an index */

/* ------------------------------------------------------------------------------------ planner */
typedef struct pc_planner pc_planner; /* plans that are kept for frames of known shapes */

typedef struct pc_plan_create_info {
    uint32_t struct_size;
    uint32_t api_version;  /* PC_API_VERSION */
    pc_create_flags flags; /* PC_VALIDATE: bounds, lens, singular matrices, an output over another
                              plane than color */
    /* The largest frame: slots have room for it, and a frame of any size up to it costs values
     * alone. A larger one is PC_ERROR_INPUT. */
    uint32_t max_width, max_height;
    uint32_t reserved;
} pc_plan_create_info;
/* On failure *planner is NULL, and the text is in pc_error(). */
PC_API pc_result pc_plan_create(const pc_plan_create_info* info, pc_planner** planner);
PC_API void pc_plan_destroy(pc_planner*);

/* The programs of every frame of this frame's kind (pc_prepare() of postchain.h): keys of the files
 * that postchain-programs writes. *count: in, room in keys; out, number of keys. */
PC_API pc_result pc_plan_programs(pc_planner*, pc_chain*, const pc_frame*, uint64_t* keys,
                                  uint32_t* count);

/* --------------------------------------------------------------------------------------- plan */
/* How steps use a texture; bits of a set. */
typedef uint32_t pc_plan_uses;
enum {
    PC_PLAN_SAMPLED = 1,     /* fetched as a sampled texture: nearest, clamped to the edge */
    PC_PLAN_IMAGE_READ = 2,  /* read as a storage image */
    PC_PLAN_IMAGE_WRITE = 4, /* written as a storage image, not read */
    PC_PLAN_LIST_READ = 8,   /* a buffer that is read */
    PC_PLAN_LIST_WRITE = 16, /* a buffer that is read and written, by atomics too */
    PC_PLAN_INDIRECT = 32,   /* the arguments of an indirect dispatch */
    PC_PLAN_ZEROED = 64      /* the host's own write of zeros at the beginning (pc_plan_slot) */
};

/* Storage that the host makes: a texture, or for PC_FORMAT_LIST a buffer of `bytes`. Slots of one
 * format and size, of other plans too, may be one object if the plans run one after another. */
typedef struct pc_plan_slot {
    pc_format format;
    uint32_t width, height;
    uint32_t slices; /* of an array; 0 = not an array */
    uint64_t bytes;
    uint32_t zero_bytes; /* the first bytes that are 0 when a frame begins; the host writes them */
    uint32_t reserved;
} pc_plan_slot;

typedef struct pc_plan_texture {
    const char* name;               /* "0.motion_blur.tile_max" */
    uint32_t host;                  /* the host's: its pc_texture.name; otherwise 0 */
    uint32_t slot;                  /* index into slots; PC_PLAN_NONE for the host's */
    pc_format format;               /* PC_FORMAT_NONE for the host's */
    uint32_t width, height;         /* the texels that are used on this frame, from 0, 0 */
    uint32_t first_step, last_step; /* that use it; PC_PLAN_NONE if none does. last_step of the
                                       result is step_count. Textures of one slot have disjoint
                                       lives */
    uint32_t reserved;
} pc_plan_texture;

enum { PC_PLAN_UNIT_TEXTURE = 0, PC_PLAN_UNIT_IMAGE = 1, PC_PLAN_UNIT_LIST = 2 };
typedef struct pc_plan_binding {
    uint32_t kind, unit; /* PC_PLAN_UNIT_*; the number in its kind, from 0, as the program's index
                            file has it */
    uint32_t texture;    /* index into textures */
    pc_plan_uses access; /* by this step */
} pc_plan_binding;

/* The storage of `texture` was used as `from`, and is used as `to` from here on. `before`: the
 * texture that used the storage last, usually the same one. from = 0: no step of this frame has
 * used it; its state is the one in which the frame before or the host left it. */
typedef struct pc_plan_barrier {
    uint32_t texture, before; /* before: PC_PLAN_NONE if from is 0 or PC_PLAN_ZEROED */
    pc_plan_uses from, to;
} pc_plan_barrier;

typedef struct pc_plan_dispatch {
    uint32_t first_group[2]; /* the program's push constant */
    uint32_t groups[3];
    uint32_t reserved;
} pc_plan_dispatch;

typedef struct pc_plan_step {
    const char* name; /* "motion_blur.gather" */
    uint64_t program; /* its key */
    uint32_t level;   /* steps of one level do not depend on each other. A level begins after all
                         steps before have finished and their writes are visible */
    uint32_t barrier_count, binding_count, dispatch_count;
    const pc_plan_barrier* barriers;    /* before it; they serve the whole level */
    const pc_plan_binding* bindings;    /* a unit of the program that has none: any texture */
    const pc_plan_dispatch* dispatches; /* one, or bands of a step that would take long; with `list`
                                           none */
    uint32_t list;           /* launches it: the texture whose buffer begins with three work group
                                counts; first_group is 0, 0. PC_PLAN_NONE: `dispatches` do */
    uint32_t bands_wait;     /* 1: each dispatch waits for the one before */
    uint32_t uniform_offset; /* of its block in pc_plan.uniforms, a multiple of 256 */
    uint32_t uniform_bytes;  /* 0 = it has no block */
    /* Texture fetches, and bytes of the textures read and written, at most, of the frame for which
     * the plan was made (pc_plan.made_width). */
    uint64_t fetches, read_bytes, written_bytes;
} pc_plan_step;

/* Work that the frame does not need. Numbers in the reason are those of the frame for which the
 * plan was made. */
typedef struct pc_plan_elision {
    const char* item;   /* "depth_of_field", "motion_blur.tile_variance" */
    const char* rule;   /* "identity_by_facts": docs/architecture.md */
    const char* reason; /* "largest half-velocity 0.31 px <= 0.5 px" */
    uint64_t fetches, bytes;
    uint32_t dispatches, reserved;
} pc_plan_elision;

typedef struct pc_plan { /* its arrays stay valid until the next call on the planner */
    uint32_t struct_size;
    uint32_t result; /* index into textures: the host's output, or a texture of the plan.
                        PC_PLAN_NONE: color itself, because there is nothing to do */
    /* Unique in this process. While it is equal, only these have changed: width, height, host and
     * result; barriers if the host's textures have become or ceased to be one; dispatches;
     * uniforms. If the chain has new values: made_width, made_height, fetches, bytes and elisions.
     */
    uint64_t shape;
    uint32_t slot_count, texture_count, step_count, elision_count;
    const pc_plan_slot* slots;
    const pc_plan_texture* textures;
    const pc_plan_step* steps; /* in an order in which they can run */
    const pc_plan_elision* elisions;
    const void* uniforms; /* the blocks of all steps; copied by the host for each frame in flight */
    uint64_t uniform_bytes;
    uint64_t slot_bytes;              /* of all slots */
    uint32_t made_width, made_height; /* the frame for which fetches and bytes are counted */
} pc_plan;
/* The plan of a frame. Errors: those of pc_run() that its arguments cause. A chain in which no pass
 * has work is not an error. */
PC_API pc_result pc_plan_frame(pc_planner*, pc_chain*, const pc_frame*, pc_plan*);
#ifdef __cplusplus
}
#endif
#endif
