// Curves between stored values and light, at points computed from their standards.
#include "tools/sequence/image/transfer.h"

#include <gtest/gtest.h>

namespace postchain::io {
namespace {

struct CurvePoint {
    Curve curve;
    double stored, light;
};

TEST(Transfer, CurvesMeetTheirStandards) {
    const CurvePoint points[] = {
        {Curve::linear, -0.5, -0.5},
        // IEC 61966-2-1: ((v + 0.055) / 1.055)^2.4, or v / 12.92.
        {Curve::srgb, 0.5, 0.2140411},
        {Curve::srgb, 0.04, 0.0030960},
        // BT.2020-2: ((v + a - 1) / a)^(1 / 0.45) with a = 1.0992968, or v / 4.5.
        {Curve::rec709, 0.5, 0.2597194},
        {Curve::rec709, 0.04, 0.0088889},
        {Curve::gamma22, 0.5, 0.2176376},
        {Curve::gamma22, -0.5, -0.2176376},
        // Codes of 10 bits: white 685, black 95, and 10^((445 - 685) 0.002 / 0.6) without black.
        {Curve::cineon, 685 / 1023.0, 1},
        {Curve::cineon, 95 / 1023.0, 0},
        {Curve::cineon, 445 / 1023.0, 0.1493036}};
    for (const CurvePoint& point : points) {
        SCOPED_TRACE(concat(name_of(point.curve), " ", point.stored));
        EXPECT_NEAR(decode(point.curve, point.stored), point.light, 1e-6);
        EXPECT_NEAR(encode(point.curve, decode(point.curve, point.stored)), point.stored, 1e-12);
    }
}

}  // namespace
}  // namespace postchain::io
