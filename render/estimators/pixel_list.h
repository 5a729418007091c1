// Some pixels of a G-buffer as a G-buffer of their own. Internal to estimators/.
#pragma once

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

class PixelList {
 public:
  explicit PixelList(const Device& device);

  // Positions and normals of `pixels`, a picture of one row.
  GBuffer Gather(const GBuffer& gbuffer, const std::vector<cl_int>& pixels);
  // Adds irradiance of what Gather() was last given to the pixels it came from, times `share` where
  // that is not null.
  void Scatter(const Buffer& irradiance, const Buffer& share, Lighting& lighting);

 private:
  Device device_;
  Kernel gather_, scatter_;
  Buffer pixels_;
  cl_int count_ = 0;
};

}  // namespace luxfield::render
