// Up to this radius of the circle of confusion, pixels, an image is in focus: a pixel keeps its color
// to the bit.
#ifndef POSTCHAIN_SHARED_SHARP_RADIUS_H
#define POSTCHAIN_SHARED_SHARP_RADIUS_H

#ifdef __cplusplus
namespace postchain::shared {
#endif
const float kSharpRadiusPx = 0.5f;
#ifdef __cplusplus
}  // namespace postchain::shared
#endif

#endif
