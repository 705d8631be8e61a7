// Linear Rec. 709 RGB and XYZ (IEC 61966-2-1's primaries and white), in double.
#pragma once

namespace postchain::metrics {

inline constexpr double kRgbToXyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};
// XYZ of RGB (1, 1, 1): the row sums.
inline constexpr double kWhite[3] = {kRgbToXyz[0][0] + kRgbToXyz[0][1] + kRgbToXyz[0][2],
                                     kRgbToXyz[1][0] + kRgbToXyz[1][1] + kRgbToXyz[1][2],
                                     kRgbToXyz[2][0] + kRgbToXyz[2][1] + kRgbToXyz[2][2]};

}  // namespace postchain::metrics
