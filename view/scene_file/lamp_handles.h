// What hands take hold of to move and aim a lamp in a picture: the geometry.
//
// Pixels are continuous as scene::Camera::Direction has them: 0.5 is the centre of the first one.
#pragma once

#include <optional>

#include "luxfield/scene/scene.h"
#include "luxfield/view/scene_file/lamp_placement.h"

namespace luxfield::view {

struct PicturePoint {
  double column = 0, row = 0;
};

// Where a camera sees a point; empty where that does not lie before it.
std::optional<PicturePoint> SeenAt(const scene::Camera& camera, lightfield::Vec3 point);

// Metres of the world that span the picture's height at the distance of a point.
double HeightAt(const scene::Camera& camera, lightfield::Vec3 point);

// How far along the line from `origin` in the direction `axis`, a unit vector, the point lies that is
// nearest to what the pixel sees:
//
//   t = ((w.a) - (w.d) (a.d)) / (1 - (a.d)^2),  w = eye - origin,  d the unit vector of the pixel's ray
//
// Empty where the ray runs along the line, so that a pixel more would be metres.
std::optional<double> AlongAxis(const scene::Camera& camera, PicturePoint pixel,
                                lightfield::Vec3 origin, lightfield::Vec3 axis);

// The point that the pixel sees in the plane through `point` that is parallel to the picture.
lightfield::Vec3 BesideInPicture(const scene::Camera& camera, PicturePoint pixel,
                                 lightfield::Vec3 point);

// The lamp with its axis towards `target`, which becomes the point that it looks at; a lamp that is
// placed by angles is turned by the smallest rotation that does it. The same lamp where that is none.
LampPlacement Aimed(const LampPlacement& lamp, lightfield::Vec3 target);

enum class Axis { kX, kY, kZ };

// The lamp's place and axis mirrored in the plane where that coordinate of the world is `at`. What it
// sends out is not mirrored: a light field is measured, and stays what it is.
LampPlacement Mirrored(const LampPlacement& lamp, Axis axis, double at);

// The angles whose scene::RotationXyz is that rotation; of the two that are, or the many where y is
// 90 degrees, those with y from -90 to 90, x = 0 in the latter case.
lightfield::Vec3 AnglesOf(const scene::Pose& rotation);

}  // namespace luxfield::view
