// What is read from a picture and kept: probes, the profile between them, the histogram.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/panels/picture_area.h"
#include "luxfield/view/picture/histogram.h"
#include "luxfield/view/picture/look.h"

namespace luxfield::view {

class ReadingsPanel {
 public:
  void Add(PicturePlace place) { probes_.push_back(place); }
  void Clear() { probes_.clear(); }
  const std::vector<PicturePlace>& probes() const { return probes_; }

  // On the picture: probes as crosses with numbers, and the line between the last two.
  void Mark(const PictureArea& area) const;
  // Into the ImGui window that is begun, of a document with a picture.
  void Draw(const Document& document, const Look& look);

 private:
  void DrawProbes(const Document& document) const;
  void DrawProfile(const render::Frame& frame);
  void DrawHistogram(const Document& document, const Look& look);

  std::vector<PicturePlace> probes_;
  bool along_illuminance_ = false;        // what the profile shows
  std::optional<std::uint64_t> counted_;  // the picture's number whose histogram this is
  Histogram histogram_;
};

}  // namespace luxfield::view
