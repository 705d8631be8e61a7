// Tuned constants of the inverse warp, for its steps and for their double-precision reference. The line above
// a group says what it was chosen on and what it gains. "Tuning": the tuning set (docs/scenes.md), dB of PSNR;
// joint: of shutter and lens, lens, motion: of one alone, means of three scenes.
// docs/inverse_warp.md#rules-and-their-gains has the gains of rules without a constant.
#ifndef POSTCHAIN_SHARED_INVERSE_WARP_CONSTANTS_H
#define POSTCHAIN_SHARED_INVERSE_WARP_CONSTANTS_H

#ifdef __cplusplus
#define INVERSE_WARP_NUMBER inline constexpr double
#define INVERSE_WARP_COUNT inline constexpr int
namespace postchain::inverse_warp {
#else
#define INVERSE_WARP_NUMBER const float
#define INVERSE_WARP_COUNT const int
#endif

// ------------------------------------------------------------------------------------- surfaces
// Chosen on tuning: 1.02 loses joint .032, lens .060, motion .029, 1.1 loses .002, .008, .073.
INVERSE_WARP_NUMBER kOneDepth = 1.05;  // inverse depths up to this ratio are one surface
// Chosen on tuning; kOneDepth in its place gains .007, .000, .007 and loses .05 on *test* (station).
INVERSE_WARP_NUMBER kFarther = 1.02;  // inverse depths beyond this ratio are farther

// Chosen on closed forms (InverseWarp.WhatTurns...): 6.3 dB on five rendered balls that bounce, .3 on a pendulum.
// With .16 and .36 flagpole gains .03 (motion .06), and grass in gusts (*test*) loses .05.
INVERSE_WARP_NUMBER kBent = 0.25, kTurned = 0.44;  // (|b|/|a|)^2 from which a path may bounce, and does fully
// Likewise if a neighbor does not show the surface: from a path on that stops. Chosen on exact shots: temporal error
// of bounce .164 to .143 (balanced), .139 to .114 (best); from 1.0 to 2.0 that of stop .114 to .123.
INVERSE_WARP_NUMBER kBentUnseen = 0.81, kTurnedUnseen = 1.0;
// Accelerations in the neighbors along that in this frame, as parts of it: up to the first one a surface bounces,
// from the second one on it turns. Then likewise across it.
INVERSE_WARP_NUMBER kBounce = 0.2, kTurn = 0.5;
INVERSE_WARP_NUMBER kBounceAcross = 0.5, kTurnAcross = 0.8;
// Another surface's motion between two frames differs by more: px, parts of the motion.
INVERSE_WARP_NUMBER kOtherMotionPx = 1.0, kOtherMotion = 0.25;

// --------------------------------------------------------------------------------- bright edges
// Chosen on tuning: up to .7 dB.
INVERSE_WARP_NUMBER kBrighter = 4.0;  // a pixel with a lamp's light: times its own surface around it
INVERSE_WARP_NUMBER kLampBrighter = 10.0;  // the lamp: times the surface around
INVERSE_WARP_NUMBER kOtherBrighter = 1.1;  // the lamp: times the pixel
// Chosen on tuning: joint .005, lens .015, crossing .041.
INVERSE_WARP_NUMBER kCovered = 0.1;  // a pixel with less of a surface behind it goes on hiding that
// Chosen on tuning: joint .26, lens .60, crossing 1.75.
INVERSE_WARP_NUMBER kLampApartPx = 1.0;  // least difference between both displacements
INVERSE_WARP_NUMBER kStaysPx = 3.0;  // longest displacement of a surface that keeps the light behind it
// Chosen on tuning and edges_test.cpp. kFarPx: lens .015, wheels .048.
INVERSE_WARP_COUNT kWidePx = 16;  // a light that goes on for so long is no lamp ...
INVERSE_WARP_NUMBER kWide = 0.5;  // ... with this part of the light at the edge ...
INVERSE_WARP_NUMBER kFarPx = 3.0;  // ... if the surfaces part by so much motion

// --------------------------------------------------------------------------- pixels of two surfaces
// Chosen on tuning and edges_test.cpp: a disc of .05 before .8, 44 px a frame: .039 to .011.
INVERSE_WARP_NUMBER kPartPx = 0.5;  // surfaces part by so much motion, from which on blur fades in ...
INVERSE_WARP_NUMBER kLensPartPx = 3.0;  // ... or by so much radius
// Chosen on tuning. kRest: joint .012, lens .071. kContrast gains .000: it keeps equal colors from a division.
INVERSE_WARP_NUMBER kRest = 0.1;  // largest distance to a mixture, in parts of both colors' difference
INVERSE_WARP_NUMBER kContrast = 0.05;  // least difference of both colors, in parts of the larger one
// Chosen on edges_test.cpp, kept on tuning: depth of field with neighbors .03 to .17.
INVERSE_WARP_NUMBER kMostLeaving = 0.4;  // a pixel with less of its own surface shows the one in front
// Chosen on edges_test.cpp and tuning (motion .04): a disc at 4 px a frame: .37 to .08, with mixed motion mended.
INVERSE_WARP_NUMBER kMostSlow = 0.9;  // likewise if both surfaces part slowly:
INVERSE_WARP_NUMBER kFastPx = 6.0, kSlowerPx = 5.0;  // px: from kFastPx on not at all, kSlowerPx less: fully
// Chosen on edges_test.cpp: a disc that a camera follows: .270 to .049.
INVERSE_WARP_NUMBER kMostStill = 0.8, kMostStillLens = 0.65;  // likewise if the one in front stays in place
// Chosen on edges_test.cpp, kept on tuning (motion .10, flagpole .31): that disc, by averaged motion: .19 to .02.
INVERSE_WARP_NUMBER kLeastPart = 0.02;  // of the surface in front, and of the other one
// Chosen on edges_test.cpp. kLeastShareThin: slanted lines .100 to .018.
INVERSE_WARP_NUMBER kLeastShare = -0.1, kMostShare = 1.1;  // of its own surface in a mixture
INVERSE_WARP_NUMBER kLeastShareThin = -1.0;  // twice as much of a thin surface as the pixel that has its color
// Chosen on tuning: motion .026, lens .009, joint -.005.
INVERSE_WARP_COUNT kSlackPx2 = 1;  // px^2 beyond the nearest pixel with a surface's color

// -------------------------------------------------------------------------------- background, fill
// Chosen on tuning: .045 in the mean of best.
INVERSE_WARP_NUMBER kLamp = 3.0;  // times as bright as its surroundings
INVERSE_WARP_NUMBER kLeastLampPart = 1.0e-4;  // of its weight
// Chosen on closed forms (Neighbors.HelpAndDoNoHarm, rack_focus: with 1.0 an error of .0078 in place of .0069).
// Tuning: frame 11 gains up to .13 with 1.0, frame 10 of crossing loses .04.
INVERSE_WARP_NUMBER kEdgeWeight = 0.25;  // of an edge pixel whose color is mixed

// Chosen on tuning: .1 to .3 dB for 1.15 to 1.3 times the time; kOneColor .04, kLost .15 (flagpole, lens).
INVERSE_WARP_NUMBER kShows = 0.3;  // least part of a cell at the end of a line
INVERSE_WARP_NUMBER kOneColor = 0.25;  // largest difference of both ends (brightness.glsl)
INVERSE_WARP_NUMBER kContinuedLevel = 1.5;  // level of that comparison, times the brightness around
INVERSE_WARP_NUMBER kLost = 0.4;  // largest loss of light that a longer line may cause
INVERSE_WARP_COUNT kMuchLonger = 2;  // longest line, times the shortest

// ------------------------------------------------------------------------------------ neighbors
// Chosen on tuning: .3 to .7 dB under moving shadows for 5 % of the time.
INVERSE_WARP_NUMBER kOneMotionPx = 1.0, kOneMotion = 0.5;  // paths of one surface differ by at most: px, parts
INVERSE_WARP_COUNT kLightStepPx = 2;  // every second pixel of every second row of a patch
INVERSE_WARP_COUNT kLightPixels = 4;  // least number of a patch
INVERSE_WARP_COUNT kLightRings = 2;  // of patches around a pixel's
INVERSE_WARP_NUMBER kLightLevel = 3.0;  // level of the comparison, times the brightness around
INVERSE_WARP_NUMBER kLightDifference = 0.004;  // squared, beyond the variance within this frame
// Chosen on a bent sheet that turns on film: pixels with holes in alpha 16 to 0.
INVERSE_WARP_NUMBER kBehind = 1.3;  // inverse depths up to this ratio are hardly farther
INVERSE_WARP_NUMBER kFilled = 0.9;  // least part of the fill that is not farther
// Chosen on closed forms (Neighbors.HelpAndDoNoHarm, a sheet): tuning .000 to .002.
INVERSE_WARP_NUMBER kClosePx = 2.5;  // of a surface that comes almost to a pixel, along each axis
// Chosen on edges_test.cpp: a still bar before the focus, with neighbors.
INVERSE_WARP_NUMBER kStillPx = 0.5;  // path of a surface that stays in place

// --------------------------------------------------------------------------------------- search
// Chosen on tuning; the third step in a neighbor on closed forms (Neighbors.ShowWhatIsHiddenOfWhatStretches).
INVERSE_WARP_NUMBER kAcceptPx = 0.75;  // |X + D(X) - p| along each axis
INVERSE_WARP_COUNT kSteps = 2;  // from each start surface
INVERSE_WARP_COUNT kNeighborSteps = 3;  // likewise in a neighbor ...
INVERSE_WARP_COUNT kSecondSteps = 3;  // ... and in the layer behind
// Chosen on tuning: joint .069, lens .030, motion .060 over equal depths. Random for stability: .000 to .013.
INVERSE_WARP_NUMBER kMinDepthRatio = 1.01, kMaxDepthRatio = 1.03;  // up to which depths are equal
// Chosen on exact shots: still_texture .0045 to .0043 (balanced); tuning -.010 to .004, 2 px loses .029 (lens).
INVERSE_WARP_NUMBER kAlikePx = 1.0;  // surfaces less apart are one start surface

// ---------------------------------------------------------------------------------------- color
// Chosen on tuning: .04 to .65 dB.
INVERSE_WARP_NUMBER kTogetherPx = 2.0, kTogetherLensPx = 1.0;  // displacements of surfaces that move together
INVERSE_WARP_NUMBER kSamePathPx = 0.25;  // paths that are the same
// Chosen on tuning: joint -.002, lens -.041, motion .110; HDR-FLIP gains in all three.
INVERSE_WARP_NUMBER kSharpening = 1.5;  // of bilinear weights about their center
// Chosen on closed forms: rms on a wall of waves .0098 to .0002 at 1 px.
INVERSE_WARP_NUMBER kFilledStillPx = 0.125;  // longest path of a surface that fills a small circle
INVERSE_WARP_NUMBER kOneRadiusPx = 0.25;  // radii of one circle differ by at most this

// ------------------------------------------------------------------------------ denoising, samples
// Chosen on tuning: 3.7 dB with 32 samples of the joint blur, .8 dB with 128.
INVERSE_WARP_NUMBER kSoftSpread = 8.0;  // least variance of blurred samples, px^2: a radius of 4 px
INVERSE_WARP_NUMBER kWindow = 5.7, kWindowWithShutter = 4.2;  // weight exp(-k sqrt(samples) d^T C^-1 d)
INVERSE_WARP_NUMBER kLeastWeight = 1.0 / 64.0;  // taken off every weight: the window ends without a step
// Chosen on tuning: balanced .02 to .10 dB at equal HDR-FLIP, a fainter hatch. Other numbers cover the lens better
// with one turn: fast loses up to 3 % on exact shots with two, 128 samples .15 dB.
INVERSE_WARP_NUMBER kFewestTurned = 20.0, kMostTurned = 32.0;  // samples whose inner half has a turn of its own
// Chosen on tuning: fast 0 to .05 dB, balanced 0 to .14 (docs/fxaa.md#the-hint).
INVERSE_WARP_NUMBER kLeastNoise = 0.002, kMoreNoise = 0.004;  // as shown: FXAA begins; more, for all of it
INVERSE_WARP_NUMBER kLeastBlurPx = 1.0, kMoreBlurPx = 3.0;  // radius of an even disc, likewise

#ifdef __cplusplus
}  // namespace postchain::inverse_warp
#endif

#undef INVERSE_WARP_NUMBER
#undef INVERSE_WARP_COUNT
#endif
