// A camera that hands move: about a point, along the picture, or through the scene.
#pragma once

#include "luxfield/scene/scene.h"

namespace luxfield::view {

class CameraControl {
 public:
  // `pivot_m`: how far ahead the point lies that Orbit turns about. The axis of the world that is
  // nearest to the camera's own upward direction counts as up.
  explicit CameraControl(const scene::Camera& camera, double pivot_m = 1);

  const scene::Camera& camera() const { return camera_; }
  // Puts the pivot on the view's axis; as far as what is seen there.
  void SetPivot(double distance_m);
  double pivot_m() const { return pivot_m_; }

  // About the pivot: to the right by `yaw`, upwards by `pitch`; radians. Stops before the view is
  // upright.
  void Orbit(double yaw, double pitch);
  // About the camera itself, likewise.
  void Turn(double yaw, double pitch);
  // Across the view by parts of the picture's height, as seen at the pivot.
  void Pan(double right, double up);
  // Towards the pivot: its distance is multiplied by `factor`.
  void Dolly(double factor);
  // Through the scene, metres along the camera's own axes.
  void Fly(double right, double up, double forward);
  void SetFieldOfView(double vertical_deg);

 private:
  void Look(lightfield::Vec3 position, lightfield::Vec3 forward);
  lightfield::Vec3 Turned(double yaw, double pitch) const;

  scene::Camera camera_;
  lightfield::Vec3 up_;
  double pivot_m_ = 1;
};

}  // namespace luxfield::view
