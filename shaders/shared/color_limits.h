// Colors that passes can average. NaN counts as 0; infinities, and values beyond kMaxColor, count as
// the largest half of their sign. No sum over samples of the rest overflows.
#ifndef POSTCHAIN_SHARED_COLOR_LIMITS_H
#define POSTCHAIN_SHARED_COLOR_LIMITS_H

#ifdef __cplusplus
namespace postchain::shared {
#endif
const float kMaxColor = 1e34f;
const float kMaxHalf = 65504.0f;
#ifdef __cplusplus
}  // namespace postchain::shared
#endif

#endif
