// A place to look at one light field: a floor, a wall beside it, and a screen ahead at a distance
// that can be changed. Metres, z up; the screen is the plane y = 0, the lamp shines along +y.
#pragma once

#include <filesystem>

#include "luxfield/scene/scene.h"

namespace luxfield::view {

constexpr double kNearestScreen_m = 0.01, kFarthestScreen_m = 100;
constexpr double kFirstScreen_m = 5;

// Where the lamp stands so that the screen is `distance_m` from the middle of its filter plane.
scene::Pose StageLamp(double distance_m);

// Beside and behind the lamp, with the lit part of the screen ahead.
scene::Camera StageCamera(double distance_m, int width, int height);

// With the lamp and the camera for that distance. The file is not opened.
scene::Scene Stage(const std::filesystem::path& light_field, double distance_m, int width,
                   int height);

}  // namespace luxfield::view
