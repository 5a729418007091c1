// Some pixels of a G-buffer as a G-buffer of their own. Internal to estimators/.
#pragma once

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

// What of the light of each pixel of a G-buffer is seen; null: all of it.
struct SeenShares {
  const Buffer& traced;  // VisibleShare::Shares
  const Buffer& soft;    // PatchShadows::Shares
};

class PixelList {
 public:
  explicit PixelList(const Device& device);

  // Positions and normals of `pixels`, a picture of one row.
  GBuffer Gather(const GBuffer& gbuffer, const std::vector<cl_int>& pixels);
  // Adds irradiance of what Gather() was last given to the pixels it came from, as far as it is
  // seen there.
  void Scatter(const Buffer& irradiance, const SeenShares& shares, Lighting& lighting);

 private:
  Device device_;
  Kernel gather_, scatter_;
  Buffer pixels_;
  cl_int count_ = 0;
};

}  // namespace luxfield::render
